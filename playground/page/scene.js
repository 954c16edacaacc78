// The scene on the page, in the scene format of N3P. A scene is never changed, only replaced, so that undoing
// is remembering.
"use strict";

const lot = {
  scene: null,
  past: [],
  future: [],

  /** Another scene; undo comes back to this one. */
  replace(scene) {
    if (this.scene) this.past.push(this.scene);
    if (this.past.length > 200) this.past.shift();
    this.future = [];
    this.scene = scene;
  },

  /** The same while something is dragged: all of it is one step of undo. */
  adjust(scene) {
    this.scene = scene;
  },

  undo() {
    if (!this.past.length) return false;
    this.future.push(this.scene);
    this.scene = this.past.pop();
    return true;
  },

  redo() {
    if (!this.future.length) return false;
    this.past.push(this.scene);
    this.scene = this.future.pop();
    return true;
  },
};

const goalsOf = (scene) => scene.goals ?? [scene.goal];

function withGoal(scene, index, pose) {
  // What the file said of the spot need not be true of another place.
  const freed = { ...scene, parking_type: null };
  return scene.goals ? { ...freed, goals: scene.goals.with(index, pose) } : { ...freed, goal: pose };
}

/** What can be selected: {what: "start"}, {what: "goal", index}, {what: "obstacle", index}, and a side of the bounds,
    {what: "bound", index}. */
const same = (a, b) => a?.what === b?.what && a?.index === b?.index;

/** The sides of the bounds, as the scene has them: even ones lie along y, odd ones along x. */
const SIDES = ["Left", "Lower", "Right", "Upper"];
/** The least distance between two sides, metres. */
const LEAST_ROOM = 2;

/** The same with a side of the bounds elsewhere, as far as the opposite one lets it. */
function withBound(scene, index, value) {
  const opposite = scene.bounds[(index + 2) % 4];
  const kept = index < 2 ? Math.min(value, opposite - LEAST_ROOM) : Math.max(value, opposite + LEAST_ROOM);
  return kept === scene.bounds[index] ? scene : { ...scene, bounds: scene.bounds.with(index, kept) };
}

/** The pose of a car, or null for anything else. */
function poseOf(scene, thing) {
  if (thing.what === "start") return scene.start;
  if (thing.what === "goal") return goalsOf(scene)[thing.index];
  return null;
}

function withPose(scene, thing, pose) {
  return thing.what === "start" ? { ...scene, start: pose } : withGoal(scene, thing.index, pose);
}

const withObstacle = (scene, index, points) => ({ ...scene, obstacles: scene.obstacles.with(index, points) });

function moved(scene, thing, by) {
  if (thing.what === "bound") {
    const along = by[thing.index % 2];
    return along ? withBound(scene, thing.index, scene.bounds[thing.index] + along) : scene;
  }
  const pose = poseOf(scene, thing);
  if (pose) return withPose(scene, thing, [pose[0] + by[0], pose[1] + by[1], pose[2]]);
  return withObstacle(scene, thing.index, movedBy(scene.obstacles[thing.index], by));
}

/** Turned about the middle of its body. */
function turned(scene, thing, angle) {
  if (thing.what === "bound") return scene;
  const pose = poseOf(scene, thing);
  if (!pose) return withObstacle(scene, thing.index, turnedBy(scene.obstacles[thing.index], angle));
  const middle = middleOf(scene.vehicle);
  const [x, y] = along(pose, middle);
  return withPose(scene, thing, along([x, y, pose[2] + angle], -middle));
}

function without(scene, thing) {
  if (thing.what === "bound") return { ...scene, bounds: null };
  if (thing.what === "obstacle") return { ...scene, obstacles: scene.obstacles.toSpliced(thing.index, 1) };
  if (thing.what === "goal" && scene.goals?.length > 1) {
    return { ...scene, goals: scene.goals.toSpliced(thing.index, 1) };
  }
  return scene;
}

/** The same with another vehicle: bodies stay where they are in the middle. */
function withVehicle(scene, vehicle) {
  const shift = middleOf(scene.vehicle) - middleOf(vehicle);
  const all = { ...scene, vehicle, start: along(scene.start, shift) };
  if (scene.goals) return { ...all, goals: scene.goals.map((goal) => along(goal, shift)) };
  return { ...all, goal: along(scene.goal, shift) };
}

/** With bounds around all there is, some way off. */
function withBounds(scene) {
  const cars = [scene.start, ...goalsOf(scene)].flatMap((pose) => footprint(scene.vehicle, pose));
  const box = boxAround([...cars, ...scene.obstacles.flat(), ...(scene.points ?? []), ...(scene.polylines ?? []).flat()]);
  return { ...scene, bounds: box.map((v, i) => Math.round(10 * (v + (i < 2 ? -1 : 1))) / 10) };
}

/** Nothing but the car and its goal. */
const emptied = (scene) => {
  const { points, polylines, low, drivable_area, previous, ...rest } = scene;
  return { ...rest, obstacles: [], name: "mine", source: "drawn in the playground", parking_type: null, bounds: null };
};
