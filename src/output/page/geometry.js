// Plane geometry. A pose is [x, y, θ] of the rear axle; metres, radians, counter-clockwise.
"use strict";

/** A point of a body, given in its own frame, seen from outside. */
function outOf(pose, [x, y]) {
  const [c, s] = [Math.cos(pose[2]), Math.sin(pose[2])];
  return [pose[0] + c * x - s * y, pose[1] + s * x + c * y];
}

/** The pose whose rear axle is at the origin of `pose` moved along its heading. */
const along = (pose, distance) => [...outOf(pose, [distance, 0]), pose[2]];

/** From the rear axle to the middle of the body. */
const middleOf = (vehicle) => vehicle.length / 2 - vehicle.rear_overhang;

function footprint(vehicle, pose) {
  const [back, front, side] = [-vehicle.rear_overhang, vehicle.length - vehicle.rear_overhang, vehicle.width / 2];
  return [[back, -side], [front, -side], [front, side], [back, side]].map((corner) => outOf(pose, corner));
}

function boxAround(points) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  }
  return box;
}

function centreOf(points) {
  const box = boxAround(points);
  return [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
}

const movedBy = (points, [dx, dy]) => points.map(([x, y]) => [x + dx, y + dy]);

function turnedBy(points, angle) {
  const [cx, cy] = centreOf(points);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return points.map(([x, y]) => [cx + c * (x - cx) - s * (y - cy), cy + s * (x - cx) + c * (y - cy)]);
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** Whether four corners are about what a parked car covers. */
function isCar(points) {
  if (points.length !== 4) return false;
  const sides = points.map((p, i) => distance(p, points[(i + 1) % 4]));
  const [short, long] = [Math.min(sides[0], sides[1]), Math.max(sides[0], sides[1])];
  const isSquare = Math.abs(distance(points[0], points[2]) - distance(points[1], points[3])) < 0.3;
  return isSquare && short > 1.2 && short < 2.8 && long > 2.2 && long < 7.5;
}

/** The angle nearest to `angle` that is a whole number of quarter turns from `to`, if it is near; else itself. */
function snapped(angle, to) {
  const quarter = Math.PI / 2;
  const near = to + Math.round((angle - to) / quarter) * quarter;
  return Math.abs(angle - near) < 0.04 ? near : angle;
}

const lerp = (a, b, share) => a + (b - a) * share;

function lerpAngle(a, b, share) {
  const turn = Math.atan2(Math.sin(b - a), Math.cos(b - a));
  return a + turn * share;
}
