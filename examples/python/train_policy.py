"""Trains a driving policy from Python, and writes it for `n3p-eval --policy`.

    pip install './python[gym]' onnx
    python examples/python/train_policy.py --minutes 3 --out policy.onnx
    n3p-eval --policy policy.onnx --methods ha-rs,policy

Proximal policy optimisation in plain numpy: two small networks, 64 environments. The policy chooses
among the 42 motions of the action mask, so none that is blocked is ever tried. It draws while it
learns; the file takes the most probable motion. Prints its curve and writes it beside the file, as
.svg. onnx is needed for the file alone.
"""

import argparse
import os
import time
from pathlib import Path

# The networks are small: more threads only wait for each other, and for the environments'.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

import n3p.gym  # noqa: F401 (registers the environment)

ENVIRONMENTS, STEPS = 64, 64
EPOCHS, BATCH = 4, 1024
GAMMA, LAMBDA, CLIP = 0.99, 0.95, 0.2
RATE, ENTROPY = 7e-4, 0.01
HIDDEN = 64

# Steer and speed of the motions of the mask: forward from left to right, then backward.
MOTIONS = np.array(
    [(1 - i / 10, speed) for speed in (1.0, -1.0) for i in range(21)], dtype=np.float32
)


def features(seen):
    """What the networks see (N, 167): lidar and distance in tens of metres, the rest as it is."""
    target = seen["target"] * np.array([0.1, 1, 1, 1, 1], np.float32)
    return np.concatenate([seen["lidar"] * np.float32(0.1), target, seen["mask"]], axis=1)


class Network:
    """Two hidden layers of tanh; trained by Adam."""

    def __init__(self, rng, outputs, last):
        sizes = [167, HIDDEN, HIDDEN, outputs]
        scales = [1.0, 1.0, last]
        self.weights = [
            (scale * rng.standard_normal((a, b)) / np.sqrt(a)).astype(np.float32)
            for a, b, scale in zip(sizes, sizes[1:], scales)
        ]
        self.weights += [np.zeros(b, np.float32) for b in sizes[1:]]
        self.moments = [(np.zeros_like(w), np.zeros_like(w)) for w in self.weights]
        self.updates = 0

    def forward(self, x):
        w1, w2, w3, b1, b2, b3 = self.weights
        first = np.tanh(x @ w1 + b1)
        second = np.tanh(first @ w2 + b2)
        return second @ w3 + b3, (x, first, second)

    def learn(self, layers, slope, rate):
        """One step against `slope`, the derivative of the loss by the outputs."""
        x, first, second = layers
        _, w2, w3, *_ = self.weights
        back2 = (slope @ w3.T) * (1 - second**2)
        back1 = (back2 @ w2.T) * (1 - first**2)
        slopes = [x.T @ back1, first.T @ back2, second.T @ slope]
        slopes += [back1.sum(0), back2.sum(0), slope.sum(0)]
        size = np.sqrt(sum(float((s**2).sum()) for s in slopes))
        shrink = min(1.0, 0.5 / (size + 1e-8))
        self.updates += 1
        for w, s, (m, v) in zip(self.weights, slopes, self.moments):
            s = s * shrink
            m += 0.1 * (s - m)
            v += 0.001 * (s * s - v)
            mean, square = m / (1 - 0.9**self.updates), v / (1 - 0.999**self.updates)
            w -= rate * mean / (np.sqrt(square) + 1e-8)


def probabilities(logits, mask):
    """Of the motions, those that are blocked left out (all alike, where all are)."""
    logits = np.where(mask > 0, logits, -1e9)
    shares = np.exp(logits - logits.max(axis=1, keepdims=True))
    return shares / shares.sum(axis=1, keepdims=True)


def collect(envs, seen, scripted, policy, critic, rng):
    """STEPS steps of all environments."""
    shape = (STEPS, ENVIRONMENTS)
    x = np.empty((*shape, 167), np.float32)
    mask = np.empty((*shape, 42), np.float32)
    chosen, old = np.empty(shape, np.int64), np.empty(shape, np.float32)
    free, rewards = np.empty(shape, bool), np.empty(shape, np.float32)
    values, ended = np.empty((STEPS + 1, ENVIRONMENTS), np.float32), np.empty(shape, bool)
    parked = episodes = 0
    everyone = np.arange(ENVIRONMENTS)
    for t in range(STEPS):
        x[t], mask[t], free[t] = features(seen), seen["mask"], ~scripted
        shares = probabilities(policy.forward(x[t])[0], mask[t])
        draws = rng.random((ENVIRONMENTS, 1)) * shares.sum(axis=1, keepdims=True)
        chosen[t] = np.minimum((shares.cumsum(axis=1) < draws).sum(axis=1), 41)
        old[t], values[t] = shares[everyone, chosen[t]], critic.forward(x[t])[0][:, 0]
        # As far as the motion is free: the rest of it would not be driven anyway.
        actions = MOTIONS[chosen[t]] * np.stack(
            [np.ones(ENVIRONMENTS), mask[t, everyone, chosen[t]]], axis=1
        )
        seen, reward, terminated, truncated, infos = envs.step(actions.astype(np.float32))
        rewards[t], ended[t], scripted = reward, terminated | truncated, infos["scripted"]
        if truncated.any():
            # What would have followed still counts.
            late = np.flatnonzero(truncated)
            last = [infos["final_obs"][i] for i in late]
            last = {name: np.stack([o[name] for o in last]) for name in seen}
            rewards[t, late] += GAMMA * critic.forward(features(last))[0][:, 0]
        parked += int((infos["is_success"] & ended[t]).sum())
        episodes += int(ended[t].sum())
    values[STEPS] = critic.forward(features(seen))[0][:, 0]
    gain, ahead = np.empty(shape, np.float32), np.zeros(ENVIRONMENTS, np.float32)
    for t in reversed(range(STEPS)):
        goes_on = (~ended[t]).astype(np.float32)
        surprise = rewards[t] + GAMMA * goes_on * values[t + 1] - values[t]
        ahead = surprise + GAMMA * LAMBDA * goes_on * ahead
        gain[t] = ahead
    data = (x, mask, chosen, old, free, gain, gain + values[:-1])
    return seen, scripted, [d.reshape(-1, *d.shape[2:]) for d in data], parked, episodes


def improve(policy, critic, data, rate, rng):
    x, mask, chosen, old, free, gain, returns = data
    gain = (gain - gain[free].mean()) / (gain[free].std() + 1e-6)
    for _ in range(EPOCHS):
        order = rng.permutation(len(x))
        for batch in np.split(order, len(x) // BATCH):
            logits, layers = policy.forward(x[batch])
            shares = probabilities(logits, mask[batch])
            rows = np.arange(len(batch))
            taken = shares[rows, chosen[batch]]
            ratio = taken / old[batch]
            g = gain[batch]
            clipped = ((g > 0) & (ratio > 1 + CLIP)) | ((g < 0) & (ratio < 1 - CLIP))
            # While a curve drives nothing was chosen.
            weight = np.where(free[batch] & ~clipped, g * ratio, 0.0) / len(batch)
            hit = np.zeros_like(shares)
            hit[rows, chosen[batch]] = 1.0
            logs = np.log(shares + 1e-9)
            entropy = -(shares * logs).sum(axis=1, keepdims=True)
            slope = -weight[:, None] * (hit - shares)
            slope += ENTROPY / len(batch) * free[batch][:, None] * shares * (logs + entropy)
            policy.learn(layers, slope.astype(np.float32), rate)
            value, layers = critic.forward(x[batch])
            slope = (value[:, 0] - returns[batch])[:, None] / len(batch)
            critic.learn(layers, slope.astype(np.float32), rate)


def train(minutes, course, seed):
    """The policy, and its curve: steps, share of episodes parked."""
    rng = np.random.default_rng(seed)
    envs = gymnasium.make_vec(
        "n3p/Parking-v0",
        num_envs=ENVIRONMENTS,
        course=course,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    policy, critic = Network(rng, 42, 0.01), Network(rng, 1, 1.0)
    seen, infos = envs.reset(seed=seed)
    scripted, curve, window, steps = infos["scripted"], [], [], 0
    start, told = time.monotonic(), 0.0
    while (spent := (time.monotonic() - start) / (60 * minutes)) < 1:
        seen, scripted, data, parked, episodes = collect(envs, seen, scripted, policy, critic, rng)
        improve(policy, critic, data, RATE * (1 - spent), rng)
        steps += STEPS * ENVIRONMENTS
        window = (window + [(parked, episodes)])[-10:]
        share = sum(p for p, _ in window) / max(1, sum(e for _, e in window))
        curve.append((steps, share))
        if spent - told >= 0.05 or told == 0.0:
            told = spent
            bar = "#" * round(40 * share)
            print(f"{steps:9,} steps  {100 * share:5.1f} % parked  {bar}", flush=True)
    seconds = time.monotonic() - start
    print(
        f"{steps:,} steps in {seconds:.0f} s, {steps / seconds:,.0f} per second, learning included"
    )
    return policy, curve


def write_onnx(policy, path):
    """The most probable motion, as docs/policies.md wants it."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    names = ["w1", "w2", "w3", "b1", "b2", "b3"]
    constants = dict(zip(names, policy.weights))
    constants["tenth"] = np.float32(0.1).reshape(1)
    constants["scale"] = np.array([[0.1, 1, 1, 1, 1]], np.float32)
    constants["never"] = np.float32(-1e9).reshape(1)
    constants["none"] = np.float32(0.0).reshape(1)
    constants["motions"] = MOTIONS
    constants["steer_only"] = np.array([[1.0, 0.0]], np.float32)
    constants["speed_only"] = np.array([[0.0, 1.0]], np.float32)
    node = helper.make_node
    nodes = [
        node("Mul", ["lidar", "tenth"], ["lidar_scaled"]),
        node("Mul", ["target", "scale"], ["target_scaled"]),
        node("Concat", ["lidar_scaled", "target_scaled", "mask"], ["x"], axis=1),
    ]
    inner = "x"
    for i in (1, 2, 3):
        nodes.append(node("MatMul", [inner, f"w{i}"], [f"product{i}"]))
        nodes.append(node("Add", [f"product{i}", f"b{i}"], [f"sum{i}"]))
        if i < 3:
            nodes.append(node("Tanh", [f"sum{i}"], [f"layer{i}"]))
        inner = f"layer{i}"
    nodes += [
        node("Greater", ["mask", "none"], ["free"]),
        node("Where", ["free", "sum3", "never"], ["logits"]),
        node("ArgMax", ["logits"], ["entry"], axis=1, keepdims=0),
        node("Gather", ["motions", "entry"], ["motion"], axis=0),
        # As far as it is free: steer, and speed times its share.
        node("Gather", ["mask", "entry"], ["share"], axis=1),
        node("Mul", ["share", "speed_only"], ["shares_of_speed"]),
        node("Add", ["shares_of_speed", "steer_only"], ["shares"]),
        node("Mul", ["motion", "shares"], ["action"]),
    ]

    def tensor(name, size):
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size])

    graph = helper.make_graph(
        nodes,
        "parking",
        [tensor("lidar", 120), tensor("target", 5), tensor("mask", 42)],
        [tensor("action", 2)],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    opset = [helper.make_opsetid("", 17)]
    model = helper.make_model(graph, opset_imports=opset, ir_version=8, producer_name="n3p")
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def write_svg(curve, path):
    """The share of episodes parked over steps."""
    width, height, edge = 640, 320, 40
    most = curve[-1][0]
    points = " ".join(
        f"{edge + (width - 2 * edge) * steps / most:.1f},{height - edge - (height - 2 * edge) * share:.1f}"
        for steps, share in curve
    )
    lines = "".join(
        f'<path d="M{edge},{y} H{width - edge}" stroke="#ccc"/><text x="4" y="{y + 4}">{percent} %</text>'
        for percent in (0, 50, 100)
        for y in [height - edge - (height - 2 * edge) * percent / 100]
    )
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>'
        f'{lines}<polyline points="{points}" fill="none" stroke="#1f5fbf" stroke-width="2"/>'
        f'<text x="{width - edge}" y="{height - 12}" text-anchor="end">{most:,} steps</text>'
        f'<text x="{edge}" y="20">episodes parked</text></svg>\n'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--course", default="eval", choices=["eval", "simple"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("policy.onnx"))
    args = parser.parse_args()
    policy, curve = train(args.minutes, args.course, args.seed)
    picture = args.out.with_suffix(".svg")
    write_svg(curve, picture)
    write_onnx(policy, args.out)
    print(f"written: {args.out}, and its curve: {picture}")


if __name__ == "__main__":
    main()
