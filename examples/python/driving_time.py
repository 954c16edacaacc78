"""How long continuous paths take to drive, beside arcs at whose joints the car stops and turns its wheels."""

import n3p

KINDS, LEVELS = ("forward", "parallel", "reverse"), ("easy", "complex", "extreme")


def seconds(plans, **how):
    return sum(plan.trajectory(**how).report["duration_s"] for plan in plans) / len(plans)


def main():
    scenes = [s for kind in KINDS for level in LEVELS for s in n3p.generate(kind, level, 100, seed=20261126)]
    continuous = seconds(n3p.Parker(standstill_steering="at-changes").plan_batch(scenes))
    stopping = seconds(n3p.Parker().plan_batch(scenes), stop_to_steer=True)
    print(f"{continuous:.1f} s continuous, {stopping:.1f} s stopping to steer: {stopping / continuous:.2f} times as long")


if __name__ == "__main__":
    main()
