#!/usr/bin/env python3
"""Compares our planners with fastsim-navigation (C++17 Hybrid A*) on the same scenes.

See README.md beside this file. Without --inside the script makes a virtual environment,
installs the peer into it and starts itself again there.
"""

import argparse
import csv
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PEER = "fastsim-navigation==0.1.2"
TYPES = ["forward", "parallel", "reverse"]
LEVELS = ["easy", "complex", "extreme"]

# What all settings share. Penalties stay at the peer's defaults (others made it slower); its
# analytic expansion is scaled from 3 m, the default for a robot that turns on 0.4 m; its
# smoother is off, since it adds time and hardly changes the path.
COMMON = {"analytic_expansion_max_length": 20.0, "smooth_path": False}
# Cell of the cost map, and step between the collision checks of a motion, both metres.
SETTINGS = {
    "fastsim-0.1": (0.1, {"collision_check_step": 0.1}),
    "fastsim-0.2": (0.2, {"collision_check_step": 0.2}),
    "fastsim-0.2-coarse": (0.2, {"collision_check_step": 0.4}),
    "fastsim-0.3": (0.3, {"collision_check_step": 0.3}),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10, help="scenes per type and level")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--methods", default="ha-rs,n3p", help="ours, separated by commas")
    parser.add_argument("--settings", default="fastsim-0.2,fastsim-0.2-coarse,fastsim-0.3",
                        help=", ".join(SETTINGS))
    parser.add_argument("--timeout", type=float, default=5.0, help="the peer's, seconds a plan")
    parser.add_argument("--venv", type=Path, default=ROOT / "target" / "peers-venv")
    parser.add_argument("--out", type=Path, help="also write the raw results here, as JSON")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def restart_in_venv(args):
    """Installs the peer where it is missing and runs this script there."""
    python = args.venv / "bin" / "python"
    if not python.exists():
        venv.create(args.venv, with_pip=True)
    known = subprocess.run([python, "-c", "import fastsim_navigation"], capture_output=True)
    if known.returncode != 0:
        subprocess.run([python, "-m", "pip", "install", "--quiet", PEER], check=True)
    subprocess.run(
        ["cargo", "build", "--release", "--locked", "--bin", "n3p-eval", "--example",
         "export_scenes", "--example", "check_path"],
        cwd=ROOT, check=True,
    )
    os.execv(python, [str(python), __file__, *sys.argv[1:], "--inside"])


def one_core():
    """Binds this process, and all it starts, to one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


class Peer:
    """fastsim-navigation with one setting."""

    def __init__(self, name, timeout):
        import fastsim_navigation

        self.lib, self.name = fastsim_navigation, name
        self.cell, special = SETTINGS[name]
        self.config = {**COMMON, **special, "max_planning_time_seconds": timeout}

    def cost_map(self, scene):
        """The scene as a grid: a cell is taken where its centre lies in an obstacle.

        The grid reaches 4 m beyond the bounds, which hold for the rear axle only.
        """
        import numpy

        x0, y0, x1, y1 = scene["bounds"]
        x0, y0, x1, y1 = x0 - 4.0, y0 - 4.0, x1 + 4.0, y1 + 4.0
        columns, rows = math.ceil((x1 - x0) / self.cell), math.ceil((y1 - y0) / self.cell)
        x, y = numpy.meshgrid(
            x0 + (numpy.arange(columns) + 0.5) * self.cell,
            y0 + (numpy.arange(rows) + 0.5) * self.cell,
        )
        cells = numpy.zeros((rows, columns), numpy.uint8)
        for polygon in scene["obstacles"]:
            inside = numpy.zeros(x.shape, bool)
            for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1]):
                if ay != by:
                    crosses = (ay > y) != (by > y)
                    inside ^= crosses & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
            cells[inside] = 254
        return self.lib.Costmap(cells, self.cell, x0, y0)

    def plan(self, scene):
        """Median time of up to three plans; only the first where it takes long.

        Timed is `plan` alone: the map is there already, as is the planner. Every plan has a
        planner of its own, or it would find the last one's heuristic in its cache.
        """
        lib, vehicle = self.lib, scene["vehicle"]
        request = lib.PlanRequest()
        request.start, request.goal = lib.Pose2D(*scene["start"]), lib.Pose2D(*scene["goal"])
        back, half = -vehicle["rear_overhang"], vehicle["width"] / 2
        front = vehicle["length"] - vehicle["rear_overhang"]
        corners = [(back, -half), (front, -half), (front, half), (back, half)]
        request.footprint = lib.PolygonFootprint([lib.Point2D(*c) for c in corners])
        config = lib.PlannerConfig()
        config.minimum_turning_radius = vehicle["wheelbase"] / math.tan(vehicle["max_steer"])
        for field, value in self.config.items():
            setattr(config, field, value)
        assert not config.validate(), config.validate()
        cost_map, times = self.cost_map(scene), []
        while len(times) < 3 and sum(times) < 1.0:
            planner = lib.HybridAStar(cost_map)
            before = time.perf_counter()
            result = planner.plan(request, config)
            times.append(time.perf_counter() - before)
        poses = result.path_array.tolist()
        return {
            "ok": result.status == lib.PlannerStatus.SUCCESS,
            "reason": result.status.name,
            "time_s": statistics.median(times),
            "poses": poses,
            "gears": [int(g) for g in result.directions_array],
        }


def turn(a, b):
    """The signed turn from heading a to heading b."""
    return math.remainder(b - a, math.tau)


def describe(scene, episode):
    """Length, direction changes, end error and sharpest turn of a foreign path."""
    poses = episode["poses"]
    length, changes, gear, sharpest = 0.0, 0, 0, 0.0
    for (ax, ay, ah), (bx, by, bh) in zip(poses, poses[1:]):
        step = math.hypot(bx - ax, by - ay)
        length += step
        if step > 1e-6:
            now = 1 if (bx - ax) * math.cos(ah) + (by - ay) * math.sin(ah) >= 0 else -1
            changes += gear not in (0, now)
            gear = now
        if step > 0.01:
            sharpest = max(sharpest, abs(turn(ah, bh)) / step)
    goal = scene["goal"]
    episode["length_m"], episode["changes"] = length, changes
    episode["end_mm"] = 1e3 * math.hypot(poses[-1][0] - goal[0], poses[-1][1] - goal[1])
    episode["end_rad"] = abs(turn(poses[-1][2], goal[2]))
    episode["curvature"] = sharpest


def dense(poses, step=0.01):
    """Poses at most `step` apart, interpolated linearly."""
    out = poses[:1]
    for (ax, ay, ah), (bx, by, bh) in zip(poses, poses[1:]):
        n = max(1, math.ceil(math.hypot(bx - ax, by - ay) / step))
        for i in range(1, n + 1):
            t = i / n
            out.append([ax + t * (bx - ax), ay + t * (by - ay), ah + t * turn(ah, bh)])
    return out


def target(name):
    """A program built by cargo."""
    folder = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
    return str(Path(folder).resolve() / "release" / name)


def check_footprints(scene_file, poses, method, folder):
    """What the oracle says about every footprint along `poses`; None where all are free."""
    n = len(poses)
    path = {"poses": poses, "gears": [1] * n, "steer": [0.0] * n, "method": method}
    file = folder / "foreign.json"
    file.write_text(json.dumps(path))
    command = [target("examples/check_path"), "--footprints", str(scene_file), str(file)]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(answer.stdout)["violation"]


def ours(scene_file, methods, folder):
    """Runs n3p-eval on one scene; its rows carry the verdict of the same oracle."""
    scenes, out = folder / "one", folder / "out"
    for old in (scenes, out):
        shutil.rmtree(old, ignore_errors=True)
    scenes.mkdir()
    shutil.copy(scene_file, scenes)
    command = [target("n3p-eval"), "--scenes", str(scenes), "--methods", methods,
               "--paths", str(out / "paths"), "--out", str(out)]
    if any(m in methods for m in ("n3p", "knn-n3p")):
        command += ["--model", "models/knn.bin"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    episodes = {}
    for row in csv.DictReader((out / "rows.csv").open()):
        ok = row["ok"] == "true"
        path = out / "paths" / f"{scene_file.stem}.{row['method']}.json"
        violation = None
        if path.exists():
            poses = dense(json.loads(path.read_text())["poses"])
            violation = check_footprints(scene_file, poses, row["method"], folder)
        episodes[row["method"]] = {
            "ok": ok,
            "reason": row["reason"],
            "time_s": float(row["plan_time_s"]),
            "free": ok and violation is None,
            "violation": violation or row["checked"],
            "length_m": float(row["length_m"]) if ok else None,
            "changes": int(row["direction_changes"]) if ok else None,
        }
    return episodes


def theirs(peer, scene_file, scene, folder):
    episode = peer.plan(scene)
    episode["free"] = False
    if episode["ok"]:
        describe(scene, episode)
        violation = check_footprints(scene_file, dense(episode["poses"]), peer.name, folder)
        episode["free"], episode["violation"] = violation is None, violation
    del episode["poses"], episode["gears"]
    return episode


def mean(values):
    values = list(values)
    return f"{statistics.mean(values):.2f}" if values else "–"


def three_digits(value):
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def table(results, base):
    """One line per type, level and planner. The ratio is of medians, to `base`."""
    print("| type | level | planner | success | free | median ms | mean ms | ratio | length m "
          "| changes |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for kind in TYPES + ["all"]:
        for level in LEVELS if kind != "all" else ["all"]:
            chosen = [r for r in results if kind in (r["type"], "all")
                      and level in (r["level"], "all")]
            if not chosen:
                continue
            names = list(chosen[0]["episodes"])
            reference = statistics.median(r["episodes"][base]["time_s"] for r in chosen)
            for name in names:
                episodes = [r["episodes"][name] for r in chosen]
                times = [e["time_s"] for e in episodes]
                done = [e for e in episodes if e["ok"]]
                middle = statistics.median(times)
                print(f"| {kind} | {level} | {name} | {len(done)}/{len(episodes)} "
                      f"| {sum(e['free'] for e in episodes)}/{len(episodes)} "
                      f"| {three_digits(1e3 * middle)} | {three_digits(1e3 * statistics.mean(times))} "
                      f"| {three_digits(middle / reference)} | {mean(e['length_m'] for e in done)} "
                      f"| {mean(e['changes'] for e in done)} |")


def same_scenes(results, base):
    """Length and direction changes where both planners have a free path."""
    print(f"\n| planner | scenes both solve | its length m | {base} | its changes | {base} |")
    print("|---|---|---|---|---|---|")
    for name in results[0]["episodes"]:
        pairs = [(r["episodes"][name], r["episodes"][base]) for r in results
                 if r["episodes"][name]["free"] and r["episodes"][base]["free"]]
        if not pairs or name == base:
            continue
        print(f"| {name} | {len(pairs)} | {mean(a['length_m'] for a, _ in pairs)} "
              f"| {mean(b['length_m'] for _, b in pairs)} | {mean(a['changes'] for a, _ in pairs)} "
              f"| {mean(b['changes'] for _, b in pairs)} |")


def quality_of_theirs(results, settings):
    print()
    for name in settings:
        done = [r["episodes"][name] for r in results if r["episodes"][name]["ok"]]
        reasons = {}
        for r in results:
            e = r["episodes"][name]
            if not e["ok"]:
                reasons[e["reason"]] = reasons.get(e["reason"], 0) + 1
        if done:
            sharp = max(e["curvature"] for e in done)
            print(f"{name}: ends at most {max(e['end_mm'] for e in done):.1f} mm and "
                  f"{max(e['end_rad'] for e in done):.4f} rad from the goal; sharpest curvature "
                  f"{sharp:.3f} 1/m; failures {reasons or 'none'}")
        else:
            print(f"{name}: no path at all; failures {reasons}")


def main():
    args = arguments()
    if not args.inside:
        restart_in_venv(args)
    one_core()
    settings = args.settings.split(",")
    peers = [Peer(name, args.timeout) for name in settings]
    base = args.methods.split(",")[0]
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        subprocess.run([target("examples/export_scenes"), str(folder / "scenes"),
                        str(args.count), str(args.seed)], check=True)
        files = [folder / "scenes" / f"{level}-{kind}-{i:04}.json"
                 for kind in TYPES for level in LEVELS for i in range(args.count)]
        for done, file in enumerate(files):
            if sys.stderr.isatty():
                print(f"\r{done}/{len(files)} {file.stem}   ", end="", file=sys.stderr)
            scene = json.loads(file.read_text())
            level, kind, _ = file.stem.split("-")
            # Alternating: every planner on this scene before any on the next.
            episodes = ours(file, args.methods, folder)
            for peer in peers:
                episodes[peer.name] = theirs(peer, file, scene, folder)
            results.append({"scene": file.stem, "type": kind, "level": level,
                            "episodes": episodes})
    table(results, base)
    same_scenes(results, base)
    quality_of_theirs(results, settings)
    if args.out:
        args.out.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
