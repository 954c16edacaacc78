#!/usr/bin/env python3
# A policy as a process: one JSON object per line in, one per line out (docs/policies.md).
#   in:  {"step": 0, "lidar": [120 numbers], "target": [5], "mask": [42]}   step 0: a new episode
#   out: {"steer": -1 (right) ... 1 (left), "speed": -1 (backward) ... 1 (forward)}
# Of the mask's motions this one starts the arc that leads nearest to the goal and its heading, if
# driven for up to eight steps. It plans no change of direction, so hard scenes are beyond it.
#   n3p-eval --policy "python3 examples/policies/greedy.py" --methods ha-rs,policy
import json
import math
import sys

WHEELBASE, MAX_STEER = 2.83, 0.6091  # of the paper's car
FULL_STEP = {+1: 1.0, -1: 0.5}  # metres forward and backward
REACHES = (1, 2, 4, 8)  # steps
HEADING = 2.0  # square metres that a heading square to the goal's costs


def act(target, mask):
    distance, bearing_cos, bearing_sin, heading_cos, heading_sin = target
    goal_x, goal_y = distance * bearing_cos, distance * bearing_sin

    def cost(steer, gear, free, reach):
        length = gear * FULL_STEP[gear] * reach
        curvature = math.tan(steer * MAX_STEER) / WHEELBASE
        turn = curvature * length
        x, y = (math.sin(turn) / curvature, (1 - math.cos(turn)) / curvature) if turn else (length, 0)
        facing = heading_cos * math.cos(turn) + heading_sin * math.sin(turn)
        return (goal_x - x) ** 2 + (goal_y - y) ** 2 - HEADING * facing - 100 * free

    # 21 steering values from full left to full right, forward and then backward.
    motions = [((10 - i % 21) / 10, 1 if i < 21 else -1, free) for i, free in enumerate(mask)]
    steer, gear, free = min(motions, key=lambda motion: min(cost(*motion, reach) for reach in REACHES))
    return {"steer": steer, "speed": gear * free}


for line in sys.stdin:
    seen = json.loads(line)
    print(json.dumps(act(seen["target"], seen["mask"])), flush=True)
