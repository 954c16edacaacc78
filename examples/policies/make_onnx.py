"""Writes greedy.onnx: the rule of greedy.py as a graph, with every arc tried at once.

Run with `pip install onnx==1.23.2`; the file beside this script came from it. The squared way that
is left after an arc is linear in the goal's position, so one MatMul scores all 168 arcs: the mask's
42 motions, each for 1, 2, 4 and 8 steps.

    position = target[0] * target[1:3]
    free     = [mask, mask, mask, mask]
    score    = [position, target[3:5]] @ WEIGHTS + BIAS + 100 * free
    action   = ACTIONS[argmax(score)] * [1, free[argmax(score)]]
"""

import math
from pathlib import Path

import numpy as np
from onnx import TensorProto, checker, helper, numpy_helper, save

WHEELBASE, MAX_STEER = 2.83, 0.6091  # as in greedy.py
FULL_STEP = {+1: 1.0, -1: 0.5}
REACHES = (1, 2, 4, 8)
HEADING = 2.0

weights, bias, actions = [], [], []
for reach in REACHES:
    for gear in (1, -1):
        for i in range(21):
            steer = (10 - i) / 10
            length = gear * FULL_STEP[gear] * reach
            curvature = math.tan(steer * MAX_STEER) / WHEELBASE
            turn = curvature * length
            x = length if turn == 0 else math.sin(turn) / curvature
            y = 0.0 if turn == 0 else (1 - math.cos(turn)) / curvature
            weights.append([2 * x, 2 * y, HEADING * math.cos(turn), HEADING * math.sin(turn)])
            bias.append(-(x * x + y * y))
            actions.append([steer, gear])


def constant(name, values, dtype=np.float32):
    return numpy_helper.from_array(np.array(values, dtype), name)


def tensor(name, size):
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size])


graph = helper.make_graph(
    [
        helper.make_node("Split", ["target", "parts"], ["distance", "bearing", "heading"], axis=1),
        helper.make_node("Mul", ["distance", "bearing"], ["position"]),
        helper.make_node("Concat", ["position", "heading"], ["goal"], axis=1),
        helper.make_node("MatMul", ["goal", "WEIGHTS"], ["merit"]),
        helper.make_node("Add", ["merit", "BIAS"], ["open_merit"]),
        helper.make_node("Concat", ["mask"] * len(REACHES), ["free"], axis=1),
        helper.make_node("Mul", ["free", "FREE"], ["free_merit"]),
        helper.make_node("Add", ["open_merit", "free_merit"], ["score"]),
        helper.make_node("ArgMax", ["score"], ["best"], axis=1, keepdims=0),
        helper.make_node("Gather", ["ACTIONS", "best"], ["full"], axis=0),
        helper.make_node("Gather", ["free", "best"], ["free_share"], axis=1),
        helper.make_node("Concat", ["ONE", "free_share"], ["share"], axis=1),
        helper.make_node("Mul", ["full", "share"], ["action"]),
    ],
    "greedy",
    [tensor("target", 5), tensor("mask", 42)],
    [tensor("action", 2)],
    [
        constant("parts", [1, 2, 2], np.int64),
        constant("WEIGHTS", np.transpose(weights)),
        constant("BIAS", [bias]),
        constant("FREE", 100),
        constant("ACTIONS", actions),
        constant("ONE", [[1]]),
    ],
)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
checker.check_model(model, full_check=True)
save(model, Path(__file__).with_name("greedy.onnx"))
