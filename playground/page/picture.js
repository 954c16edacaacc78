// Draws the scene and its plans. The picture is in metres, y up; `view` says which part is seen.
"use strict";

const picture = (() => {
  const svg = document.getElementById("picture");
  const layer = (id) => document.getElementById(id);
  const { element, set, text, line, transform, surroundings, drawCar } = drawing;
  /** What is known of an obstacle, found out once: its corners never change. */
  const known = new WeakMap();
  const about = (points) => {
    if (!known.has(points)) {
      const kind = isCar(points) ? "parked" : points.length === 2 ? "wall" : "block";
      known.set(points, { kind, centre: centreOf(points), drawn: text(points) });
    }
    return known.get(points);
  };

  const view = { x: 0, y: 0, scale: 30 };
  let selected = null;
  let plans = [];
  let wrong = null;

  /** Pixels of the picture. */
  const size = () => [svg.clientWidth || 600, svg.clientHeight || 400];

  function look() {
    const [w, h] = size();
    layer("world").setAttribute("transform",
      `translate(${w / 2} ${h / 2}) scale(${view.scale} ${-view.scale}) translate(${-view.x} ${-view.y})`);
    const [right, top] = [w / 2 / view.scale, h / 2 / view.scale];
    // A line every five metres, while that is not too dense.
    let d = "";
    if (view.scale > 4) {
      for (let x = Math.ceil((view.x - right) / 5) * 5; x < view.x + right; x += 5) d += `M${x} ${view.y - top}v${2 * top}`;
      for (let y = Math.ceil((view.y - top) / 5) * 5; y < view.y + top; y += 5) d += `M${view.x - right} ${y}h${2 * right}`;
    }
    layer("ground").setAttribute("d", d);
    drawHandles();
  }

  /** Where the picture is in the window: measured when a gesture begins, because it takes a while. */
  let box = svg.getBoundingClientRect();
  const measure = () => { box = svg.getBoundingClientRect(); };

  /** The point of the world under a point of the window. */
  function at(event) {
    return [
      view.x + (event.clientX - box.left - box.width / 2) / view.scale,
      view.y - (event.clientY - box.top - box.height / 2) / view.scale,
    ];
  }

  /** Larger or smaller, while a point of the world stays where it is. */
  function zoom(factor, [x, y] = [view.x, view.y]) {
    const scale = Math.min(400, Math.max(2, view.scale * factor));
    view.x = x + (view.x - x) * view.scale / scale;
    view.y = y + (view.y - y) * view.scale / scale;
    view.scale = scale;
    look();
  }

  /** Shows start, goals and the path, and what is next to them. */
  function fit() {
    const { scene } = lot;
    const reach = scene.vehicle.length * 0.85;
    const seen = [scene.start, ...goalsOf(scene), ...plans.flatMap((plan) => plan.path?.poses ?? [])];
    const box = boxAround(seen);
    // Below the tools and above the legend.
    const [top, bottom] = [document.getElementById("tools").offsetHeight + 14, 34];
    const [w, h] = [size()[0], size()[1] - top - bottom];
    view.scale = Math.min(60 * 5 / scene.vehicle.length,
      w / (box[2] - box[0] + 2 * reach), h / (box[3] - box[1] + 2 * reach));
    view.x = (box[0] + box[2]) / 2;
    view.y = (box[1] + box[3]) / 2 + (top - bottom) / 2 / view.scale;
    look();
  }

  function drawVehicle(group, vehicle, pose, kind, name) {
    const key = JSON.stringify([vehicle, kind, name]);
    if (group.dataset.key !== key) {
      drawCar(group, vehicle, kind, name);
      group.dataset.key = key;
    }
    set(group, { transform: transform(pose) });
    // Names are read from the left.
    const label = group.querySelector(".name");
    const { length, rear_overhang: back } = vehicle;
    const turn = Math.cos(pose[2]) < -0.01 ? " rotate(180)" : "";
    if (label) set(label, { transform: `translate(${length * 0.31 - back} 0) scale(1 -1)${turn}` });
  }

  /** As many children of a layer as there are things, each focusable. */
  function matchChildren(parent, count, name) {
    while (parent.children.length > count) parent.lastChild.remove();
    while (parent.children.length < count) element(name, { class: "thing", role: "button" }, parent);
    return [...parent.children];
  }

  const metres = (value) => `${value.toFixed(1)} m`;
  const degrees = (turn) => `${Math.round(turn * 180 / Math.PI)}°`;
  const told = (name, [x, y, turn]) => `${name} at ${metres(x)}, ${metres(y)}, heading ${degrees(turn)}`;

  function mark(node, thing, label, reachable) {
    set(node, {
      "data-what": thing.what,
      "data-index": thing.index ?? 0,
      tabindex: reachable || same(thing, selected) ? 0 : -1,
      "aria-label": label,
      "aria-pressed": same(thing, selected),
    });
    node.classList.toggle("wrong", wrong !== null && wrong.some((other) => same(thing, other)));
  }

  /** What stands around that is drawn already: a scan has very many points. */
  let drawnAround = [null];
  /** What can be reached by Tab: the nearest to the goal. */
  const REACHABLE = 16;

  function drawScene() {
    const { scene } = lot;
    drawVehicle(layer("start"), scene.vehicle, scene.start, "thing start", "Start");
    mark(layer("start"), { what: "start" }, told("Start", scene.start), true);
    const goals = goalsOf(scene);
    matchChildren(layer("goals"), goals.length, "g").forEach((node, index) => {
      drawVehicle(node, scene.vehicle, goals[index], "thing goal", "Goal");
      mark(node, { what: "goal", index }, told("Goal", goals[index]), true);
    });
    const obstacles = scene.obstacles.map(about);
    const byNearness = obstacles.map(({ centre }, i) => [distance(centre, goals[0]), i]).sort((a, b) => a[0] - b[0]);
    const near = new Set(byNearness.slice(0, REACHABLE).map(([, i]) => i));
    matchChildren(layer("obstacles"), scene.obstacles.length, "polygon").forEach((node, index) => {
      const { kind, centre, drawn } = obstacles[index];
      set(node, { class: `thing ${kind}`, points: drawn });
      const name = { parked: "Parked car", wall: "Wall", block: "Obstacle" }[kind];
      mark(node, { what: "obstacle", index }, `${name} at ${metres(centre[0])}, ${metres(centre[1])}`, near.has(index));
    });
    const around = [scene.points, scene.polylines, scene.low, scene.drivable_area];
    if (around.some((part, i) => part !== drawnAround[i])) {
      drawnAround = around;
      for (const [id, d] of Object.entries(surroundings(scene))) set(layer(id), { d });
    }
    drawBounds(scene);
    drawHandles();
  }

  /** Each side of the bounds is a thing of its own. Tab reaches one of them, the key B the others. */
  function drawBounds(scene) {
    const sides = scene.bounds ? SIDES : [];
    matchChildren(layer("bounds"), sides.length, "g").forEach((node, index) => {
      if (!node.children.length) for (const kind of ["reach", "edge"]) element("path", { class: kind }, node);
      set(node, { class: `thing bound ${index % 2 ? "flat" : "upright"}` });
      const d = line(endsOf(scene.bounds, index));
      for (const path of node.children) set(path, { d });
      const isFirst = index === 0 && selected?.what !== "bound";
      mark(node, { what: "bound", index }, `${SIDES[index]} bound at ${metres(scene.bounds[index])}`, isFirst);
    });
  }

  /** The ends of a side of the bounds, where it meets the next side and the one before. */
  function endsOf(bounds, index) {
    const at = (other) => (index % 2 ? [bounds[other], bounds[index]] : [bounds[index], bounds[other]]);
    return [at((index + 1) % 4), at((index + 3) % 4)];
  }

  /** A path, part by part of one gear. */
  function drawPath(group, path) {
    group.replaceChildren();
    if (!path) return;
    const { poses, gears } = path;
    for (let from = 0; from + 1 < poses.length;) {
      let to = from + 1;
      while (to + 1 < poses.length && gears[to] === gears[from]) to += 1;
      element("path", { d: line(poses.slice(from, to + 1)), class: gears[from] > 0 ? "forward" : "backward" }, group);
      from = to;
    }
  }

  /** What a car covers on a path: its footprints, all turning the same way, so that they fill as one. */
  function drawSwept(path, vehicle) {
    const group = layer("swept");
    group.replaceChildren();
    if (!path) return;
    // Finer once it stays.
    const apart = vehicle.length * (edit.dragging ? 0.06 : 0.02);
    let d = "";
    let last = null;
    for (const pose of path.poses) {
      if (last && distance(pose, last) + Math.abs(pose[2] - last[2]) * vehicle.length / 2 < apart) continue;
      last = pose;
      d += `M${text(footprint(vehicle, pose)).replaceAll(" ", "L")}Z`;
    }
    element("path", { d }, group);
  }

  function drawPlans() {
    const { vehicle } = lot.scene;
    drawPath(layer("path-a"), plans[0]?.path);
    drawPath(layer("path-b"), plans[1]?.path);
    drawSwept(plans[0]?.path, vehicle);
    svg.classList.toggle("comparing", plans.length > 1);
    svg.classList.toggle("stale", wrong !== null);
    const spot = plans[0]?.spot;
    const [lane, space] = spot?.lane_and_spot ?? [[], []];
    set(layer("lane"), { points: text(lane) });
    set(layer("spot"), { points: text(space) });
    const preparatory = spot?.preparatory;
    layer("preparatory").toggleAttribute("hidden", !preparatory);
    if (preparatory) drawVehicle(layer("preparatory"), vehicle, preparatory, "prepared", "");
  }

  /** Handles of what is selected: one to turn it, and the corners of walls and blocks. */
  function drawHandles() {
    const group = layer("handles");
    group.replaceChildren();
    if (!selected || !lot.scene) return;
    const { scene } = lot;
    const pixel = 1 / view.scale;
    const handle = (point, name, corner = "") => {
      const node = element("g", { class: "handle", "data-handle": name, "data-corner": corner }, group);
      element("circle", { class: "reach", cx: point[0], cy: point[1], r: 20 * pixel }, node);
      element("circle", { class: "knob", cx: point[0], cy: point[1], r: 7 * pixel }, node);
    };
    if (selected.what === "bound") {
      const { index } = selected;
      endsOf(scene.bounds, index).forEach((point, i) => handle(point, "corner", (index + (i ? 3 : 1)) % 4));
      return;
    }
    const { centre, tip } = turningHandle(scene, selected, 26 * pixel);
    element("path", { class: "stem", d: line([centre, tip]) }, group);
    handle(tip, "turn");
    const points = selected.what === "obstacle" ? scene.obstacles[selected.index] : [];
    if (points.length <= 12 && !isCar(points)) points.forEach((point, i) => handle(point, "corner", i));
  }

  /** Where the handle that turns a thing is, and what it turns about. */
  function turningHandle(scene, thing, beyond) {
    const pose = poseOf(scene, thing);
    if (pose) {
      const centre = along(pose, middleOf(scene.vehicle));
      return { centre, tip: along(centre, scene.vehicle.length / 2 + beyond) };
    }
    const points = scene.obstacles[thing.index];
    const centre = centreOf(points);
    // Square to the first side, which may be the only one.
    const [a, b] = points;
    const side = Math.atan2(b[1] - a[1], b[0] - a[0]);
    const out = isCar(points) && distance(a, b) > distance(b, points[2]) ? side : side + Math.PI / 2;
    const pointed = [centre[0], centre[1], out];
    const far = Math.max(...points.map((p) => (p[0] - centre[0]) * Math.cos(out) + (p[1] - centre[1]) * Math.sin(out)));
    return { centre, tip: along(pointed, far + beyond) };
  }

  new ResizeObserver(look).observe(svg);

  return {
    svg, view, element, line, layer, transform,
    measure, at, zoom, fit, look, drawScene, drawVehicle, turningHandle,
    /** Draws answers: the plans, and the things that are wrong where there can be none; else null. */
    show(newPlans, newWrong) {
      if (newPlans) plans = newPlans;
      wrong = newWrong;
      drawPlans();
      drawScene();
    },
    select(thing) {
      selected = thing;
      drawScene();
    },
    get selected() { return selected; },
    get plans() { return plans; },
  };
})();
