"""Plans the scenes that a list names, writes each path, and says what a warm plan takes.

    python examples/python/ten_scenes.py [examples/ten-scenes.txt FOLDER]

The files are, byte for byte, those of `n3p-plan --out` and of the same programs in C++
(examples/c/ten_scenes.cpp) and Rust (examples/embed).
"""

import sys
import time
from pathlib import Path

import n3p


def main(listing="examples/ten-scenes.txt", folder=None):
    parkers = {}
    for name in Path(listing).read_text().splitlines():
        scene = n3p.load_scene(name)
        if scene.vehicle not in parkers:
            parkers[scene.vehicle] = n3p.Parker(vehicle=scene.vehicle)
        parker = parkers[scene.vehicle]
        plan = parker.plan_scene(scene)
        fastest = float("inf")
        for _ in range(100):
            start = time.perf_counter()
            parker.plan_scene(scene)
            fastest = min(fastest, time.perf_counter() - start)
        print(f"{Path(name).stem:26} {plan.length:6.2f} m, {plan.direction_changes} changes, {1e6 * fastest:7.1f} us")
        if folder:
            Path(folder).mkdir(parents=True, exist_ok=True)
            (Path(folder) / (Path(name).stem + ".json")).write_text(plan.to_json())


if __name__ == "__main__":
    main(*sys.argv[1:])
