"""How fast the package is: the same scenes as `cargo run --release --example throughput`.

    python examples/python/speed.py

Prints what one plan takes, how many a batch plans a second, and how
many steps a second 64 environments drive. See docs/python.md.
"""

import time

import numpy as np

import n3p

SEED = 7
BATCH = 10_000


def microseconds(plan, items):
    """Mean over the items, of each the fastest time, which other programs disturb least."""
    fastest = [float("inf")] * len(items)
    for _ in range(100):
        for i, item in enumerate(items):
            start = time.perf_counter()
            plan(item)
            fastest[i] = min(fastest[i], time.perf_counter() - start)
    return 1e6 * sum(fastest) / len(items)


def main():
    parker = n3p.Parker()
    easy = n3p.generate("reverse", "easy", 200, SEED)
    for scene in easy:
        parker.plan_scene(scene)
    as_arrays = [
        dict(
            start=scene.start,
            goal=scene.goal,
            polygons=scene.obstacles,
            bounds=scene["bounds"],
            parking_type=scene.parking_type,
        )
        for scene in easy
    ]
    as_lists = [
        dict(
            given,
            start=given["start"].tolist(),
            goal=given["goal"].tolist(),
            polygons=[polygon.tolist() for polygon in given["polygons"]],
        )
        for given in as_arrays
    ]
    as_dicts = [scene.to_dict() for scene in easy]
    for name, plan, items in [
        ("plan_scene", parker.plan_scene, easy),
        ("plan of arrays", lambda given: parker.plan(**given), as_arrays),
        ("plan of lists", lambda given: parker.plan(**given), as_lists),
        ("plan_scene of a dict", parker.plan_scene, as_dicts),
        ("plan_scene and poses", lambda scene: parker.plan_scene(scene).poses, easy),
    ]:
        print(f"{name:21}{microseconds(plan, items):8.1f} us")

    each = -(-BATCH // 9)
    scenes = [
        scene
        for kind in ("forward", "parallel", "reverse")
        for level in ("easy", "complex", "extreme")
        for scene in n3p.generate(kind, level, each, SEED)
    ][:BATCH]
    for _ in range(3):
        start = time.perf_counter()
        plans = parker.plan_batch(scenes)
        seconds = time.perf_counter() - start
        failed = sum(isinstance(plan, n3p.N3PError) for plan in plans)
        print(f"batch of {BATCH}: {BATCH / seconds:.0f} plans per second, {failed} failed")
        del plans

    try:
        import gymnasium

        from n3p import gym  # noqa: F401
    except ImportError:
        print("no gymnasium: the environments are not measured")
        return
    for course in ("eval", "simple"):
        envs = gymnasium.make_vec("n3p/Parking-v0", num_envs=64, course=course)
        envs.reset(seed=1)
        actions = np.random.default_rng(1).uniform(-1, 1, (500, 64, 2)).astype(np.float32)
        start, cpu = time.perf_counter(), time.process_time()
        for action in actions:
            envs.step(action)
        wall, cpu = time.perf_counter() - start, time.process_time() - cpu
        steps = actions.shape[0] * actions.shape[1]
        print(
            f"64 environments, {course}: {steps / wall:.0f} steps/s, {steps / cpu:.0f} per CPU second"
        )


if __name__ == "__main__":
    main()
