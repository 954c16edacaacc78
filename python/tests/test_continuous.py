"""Continuous steering from Python: paths without jumps, trajectories that a program of one's own follows."""

import os

import numpy as np
import pytest

import n3p

COUNT = int(os.environ.get("N3P_TRAJECTORIES", "90"))


def scenes(count):
    kinds, levels = ["forward", "parallel", "reverse"], ["easy", "complex", "extreme"]
    for i in range(count):
        yield n3p.generate(kinds[i % 3], levels[i // 3 % 3], seed=9100, first=i)[0]


def integrated(columns, wheelbase, start):
    """The bicycle, driven with a trajectory's speed and steering angle by the method of Runge and Kutta."""
    t, s = columns["time_s"], columns["distance_m"]
    v, a, kappa = columns["speed_mps"], columns["acceleration_mps2"], np.tan(columns["steer_rad"]) / wheelbase
    x, y, heading = start
    for i in range(len(t) - 1):
        dt = t[i + 1] - t[i]
        # The jerk is constant between two samples, and the curvature changes steadily with the distance.
        jerk = 2.0 * (v[i + 1] - v[i] - a[i] * dt) / dt**2
        speed = lambda q: v[i] + q * (a[i] + q * jerk / 2.0)
        driven = lambda q: abs(q * (v[i] + q * (a[i] / 2.0 + q * jerk / 6.0)))
        way = s[i + 1] - s[i]
        # At a change of gear the wheels have turned to another angle while the car stood.
        share = lambda q: driven(q) / way if way > 1e-12 else 0.0
        curvature = lambda q: kappa[i] + (kappa[i + 1] - kappa[i]) * share(q)

        def rate(q, h):
            return np.array([speed(q) * np.cos(h), speed(q) * np.sin(h), speed(q) * curvature(q)])

        k1 = rate(0.0, heading)
        k2 = rate(dt / 2, heading + k1[2] * dt / 2)
        k3 = rate(dt / 2, heading + k2[2] * dt / 2)
        k4 = rate(dt, heading + k3[2] * dt)
        x, y, heading = np.array([x, y, heading]) + dt * (k1 + 2 * k2 + 2 * k3 + k4) / 6
    return x, y, heading


def test_trajectories_integrate_to_the_goal_within_every_limit():
    parker = n3p.Parker(standstill_steering="at-changes")
    vehicle = parker.vehicle
    plans = parker.plan_batch(list(scenes(COUNT)))
    worst, without = 0.0, 0
    for plan in plans:
        if isinstance(plan, n3p.N3PError):
            assert "steering at standstill" in str(plan)
            without += 1
            continue
        driven = plan.trajectory()
        x, y, heading = integrated(driven, vehicle.wheelbase, plan.poses[0])
        goal = plan.poses[-1]
        worst = max(worst, np.hypot(x - goal[0], y - goal[1]))
        assert abs((heading - goal[2] + np.pi) % (2 * np.pi) - np.pi) < 1e-3
        speed, gear, steer = driven["speed_mps"], driven["gear"], driven["steer_rad"]
        limit = np.where(gear > 0, vehicle.forward_speed, vehicle.backward_speed)
        assert (np.abs(speed) <= limit + 1e-9).all()
        assert (np.abs(driven["acceleration_mps2"]) <= 1.0 + 1e-9).all()
        assert (speed**2 * np.abs(driven["curvature_per_m"]) <= 2.0 + 1e-9).all()
        assert (np.abs(steer) <= vehicle.max_steer + 1e-9).all()
        turned = np.abs(np.diff(steer)) / np.diff(driven["time_s"])
        assert (turned <= vehicle.steer_rate * (1 + 1e-6) + 1e-4).all(), turned.max()
        assert driven.report["steer_rate_kept"]
    assert worst < 1e-3
    assert without * 100 <= COUNT


def test_what_is_asked_for_is_what_is_there():
    scene = n3p.generate("parallel", "complex", seed=3)[0]
    arcs = n3p.Parker().plan_scene(scene)
    assert (arcs.steer_from == arcs.steer).all() and (arcs.steer_to == arcs.steer).all()
    assert (arcs.motions[:, 0] == arcs.motions[:, 1]).all()
    smooth = n3p.Parker(standstill_steering="never").plan_scene(scene)
    assert np.abs(smooth.steer_to[:-1] - smooth.steer_from[1:]).max() < 1e-6
    assert smooth.steer_from[0] == 0.0 and smooth.motions.shape[1] == 3
    short = n3p.Parker(standstill_steering="at-changes", least_move=0.0, last_straight=0.0).plan_scene(scene)
    assert short.length <= n3p.Parker(standstill_steering="at-changes").plan_scene(scene).length + 1e-9
    few = n3p.Parker(method="ha-rs", cost={"gear_change": 30.0}).plan_scene(scene)
    many = n3p.Parker(method="ha-rs", cost={"gear_change": 0.0}).plan_scene(scene)
    assert few.direction_changes <= many.direction_changes


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"standstill_steering": "sometimes"}, "never, at-changes or anywhere"),
        ({"least_move": -1.0}, "least_move"),
        ({"last_straight": float("nan")}, "last_straight"),
        ({"cost": {"gears": 1.0}}, "gears"),
        ({"cost": {"gear_change": -1.0}}, "gear_change"),
        ({"cost": 3.0}, "cost"),
        ({"vehicle": {"length": 4.0, "width": 1.8, "wheelbase": 2.5, "rear_overhang": 0.8,
                      "max_steer": 0.6, "steer_rate": 0.0}}, "steer_rate"),
    ],
)
def test_what_cannot_be_is_refused(arguments, message):
    with pytest.raises(n3p.BadInput, match=message):
        n3p.Parker(**arguments)
