"""Checks paths by other means than N3P: numpy for the motions, shapely for the bodies.

    python examples/python/second_oracle.py SCENES PATHS     two folders: scene files, and n3p-eval --paths
    python examples/python/second_oracle.py FILE.jsonl …     samples of n3p-experiment volume --samples
    … | python examples/python/second_oracle.py -            the same lines on standard input

Needs numpy and shapely 2. Written from docs/formats.md alone; it shares no code with N3P. Of each path it asks:
does it begin at the start and end at the goal, do gear and steering lead from each pose to the next, does the
steering keep the vehicle's limit, does the rear axle stay in the bounds, and does the body, placed at least every
centimetre that any corner moves, stay out of every obstacle? Prints what it refuses and a summary; exit code 1 if
anything was refused, 2 if there was nothing to check.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
import shapely

STEP = 0.01  # of any corner between two bodies, metres; for vehicles below 4 m in proportion
DEPTH = 1e-4  # how deep a body may reach into an obstacle, metres
END = 1e-6  # how far ends may lie aside, metres and radians
MOTION = 1e-5  # how far a motion may end from the next pose, metres and radians
LIMIT = 1e-6  # excess of the curvature limit that passes, as a share

# Gauss-Legendre on [0, 1], exact far beyond double precision for motions of decimetres.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2


class Refused(Exception):
    """Why a path is none."""


def turn(angle):
    """An angle as its distance from no turn, radians."""
    return np.abs((angle + np.pi) % (2 * np.pi) - np.pi)


def drive(poses, s, start_curvature, rate):
    """Where driving `s` metres (signed) from `poses` leads, the curvature changing by `rate` per metre driven."""
    along = s[:, None] * NODES
    driven = np.abs(along)
    sign = np.sign(s)[:, None]
    # The heading turns by the signed curvature times the signed length.
    heading = poses[:, 2:] + sign * (start_curvature[:, None] * driven + rate[:, None] * driven**2 / 2)
    x = poses[:, 0] + s * (np.cos(heading) @ WEIGHTS)
    y = poses[:, 1] + s * (np.sin(heading) @ WEIGHTS)
    length = np.abs(s)
    theta = poses[:, 2] + np.sign(s) * (start_curvature * length + rate * length**2 / 2)
    return np.stack([x, y, theta], axis=1)


def bodies(vehicle, poses, less):
    """The vehicle's rectangle at each pose, made smaller by `less` on every side."""
    rear = -vehicle["rear_overhang"] + less
    front = vehicle["length"] - vehicle["rear_overhang"] - less
    side = vehicle["width"] / 2 - less
    corners = np.array([[rear, -side], [front, -side], [front, side], [rear, side]])
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x = poses[:, :1] + cos * corners[:, 0] - sin * corners[:, 1]
    y = poses[:, 1:2] + sin * corners[:, 0] + cos * corners[:, 1]
    return shapely.polygons(np.stack([x, y], axis=2))


def shapes(scene, origin):
    """The obstacles, relative to `origin`."""
    found = []
    for vertices in scene["obstacles"]:
        vertices = np.array(vertices, dtype=float) - origin
        if len(vertices) == 2:
            found.append(shapely.linestrings(vertices))
        else:
            polygon = shapely.polygons(vertices)
            found.append(polygon if polygon.is_valid else shapely.make_valid(polygon))
    points = np.array(scene.get("points") or np.empty((0, 2)), dtype=float)
    return found + list(shapely.points(points - origin))


def check(scene, path):
    """Raises Refused where `path` is no path of `scene`; else the metres driven."""
    vehicle = scene["vehicle"]
    poses = np.array(path["poses"], dtype=float)
    gears = np.array(path["gears"], dtype=float)
    steer = np.array(path["steer"], dtype=float)
    ends = [np.array(path.get(name) or steer, dtype=float) for name in ("steer_from", "steer_to")]
    if not len(poses) == len(gears) == len(steer) == len(ends[0]) == len(ends[1]) > 0:
        raise Refused("the arrays have different lengths")
    if not (np.isfinite(poses).all() and np.isfinite(steer).all() and np.isin(gears, [1, -1]).all()):
        raise Refused("a number is none, or a gear neither 1 nor -1")
    goals = np.array(scene.get("goals") or [scene["goal"]], dtype=float)
    start = np.array(scene["start"], dtype=float)
    # What coordinates do not resolve so far from the origin, metres.
    blur = 4 * np.spacing(np.abs(np.concatenate([start[:2], goals[:, :2].ravel()])).max())
    origin = start[:2].copy()
    poses[:, :2] -= origin
    goals[:, :2] -= origin

    if np.hypot(*poses[0, :2]) > END + blur or turn(poses[0, 2] - start[2]) > END:
        raise Refused("does not begin at the start")
    tolerance = scene.get("goal_tolerance") or {}
    apart = np.hypot(*(goals[:, :2] - poses[-1, :2]).T)
    arrived = (apart <= tolerance.get("position_m", 0) + END + blur) & (
        turn(goals[:, 2] - poses[-1, 2]) <= tolerance.get("heading_rad", 0) + END
    )
    if not arrived.any():
        raise Refused(f"ends {apart.min() * 1e3:.3f} mm from the goal")

    if len(poses) > 1:
        before, after, gears = poses[:-1], poses[1:], gears[:-1]
        curvature = [np.tan(e[:-1]) / vehicle["wheelbase"] for e in ends]
        most = np.tan(vehicle["max_steer"]) / vehicle["wheelbase"] * (1 + LIMIT)
        if max(np.abs(c).max() for c in curvature) > most:
            raise Refused("steers beyond the vehicle's limit")
        # The length of an arc of the mean curvature over this chord.
        chord = np.hypot(*(after[:, :2] - before[:, :2]).T)
        mean = np.abs(curvature[0] + curvature[1]) / 2
        half = np.minimum(mean * chord / 2, 1)
        length = np.where(half < 1e-9, chord, 2 * np.arcsin(half) / np.where(mean > 0, mean, 1))
        rate = np.where(length > 0, (curvature[1] - curvature[0]) / np.where(length > 0, length, 1), 0)
        led = drive(before, gears * length, curvature[0], rate)
        aside = np.hypot(*(led[:, :2] - after[:, :2]).T)
        worst = int(np.argmax(aside))
        if aside[worst] > MOTION + blur or turn(led[:, 2] - after[:, 2]).max() > MOTION:
            raise Refused(f"pose {worst}: the motion ends {aside[worst] * 1e3:.3f} mm from the next pose")
        # The farthest corner moves at most this much faster than the rear axle.
        reach = np.hypot(max(vehicle["rear_overhang"], vehicle["length"] - vehicle["rear_overhang"]), vehicle["width"] / 2)
        moved = length * (1 + np.maximum(np.abs(curvature[0]), np.abs(curvature[1])) * reach)
        step = STEP * min(vehicle["length"] / 4, 1)
        count = np.maximum(np.ceil(moved / step).astype(int), 1)
        index = np.repeat(np.arange(len(before)), count)
        part = (np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)) / count[index]
        placed = drive(before[index], (gears * length)[index] * part, curvature[0][index], rate[index])
        placed = np.concatenate([placed, poses[-1:]])
        driven = length.sum()
    else:
        placed, driven = poses, 0.0

    if scene.get("bounds"):
        low, high = np.array(scene["bounds"], dtype=float).reshape(2, 2) - origin
        out = max((low - placed[:, :2]).max(), (placed[:, :2] - high).max())
        if out > 1e-6 + blur:
            raise Refused(f"the rear axle is {out * 1e3:.3f} mm out of bounds")
    obstacles = shapes(scene, origin)
    if obstacles:
        tree = shapely.STRtree(obstacles)
        hits = tree.query(bodies(vehicle, placed, DEPTH + blur), predicate="intersects")
        if hits.size:
            raise Refused(f"the body meets obstacle {hits[1][0]} at {placed[hits[0][0]].tolist()}")
    return driven


def pairs(arguments):
    """Name, scene and path of everything there is to check."""
    if len(arguments) == 2 and all(Path(a).is_dir() for a in arguments):
        for file in sorted(Path(arguments[0]).glob("*.json")):
            scene = json.loads(file.read_text())
            for path in sorted(Path(arguments[1]).glob(f"{file.stem}.*.json")):
                yield path.name, scene, json.loads(path.read_text())
        return
    for name in arguments:
        with sys.stdin if name == "-" else open(name) as lines:
            for line in lines:
                both = json.loads(line)
                yield both["scene"]["name"], both["scene"], both["path"]


def main(arguments):
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__)
        return 2
    begun, checked, refused, metres = time.monotonic(), 0, 0, 0.0
    for name, scene, path in pairs(arguments):
        checked += 1
        try:
            metres += check(scene, path)
        except Refused as why:
            refused += 1
            print(f"{name}: {why}")
    if not checked:
        print("nothing to check: give two folders, scenes and paths, or files of samples")
        return 2
    seconds = time.monotonic() - begun
    print(f"{checked} paths, {metres / 1e3:.1f} km: {refused} refused ({seconds:.0f} s, shapely {shapely.__version__})")
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
