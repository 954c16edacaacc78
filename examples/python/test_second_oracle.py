"""The second oracle refuses what is wrong. Run by `python examples/python/test_second_oracle.py`."""

import copy
import math
import unittest

from second_oracle import Refused, check

VEHICLE = {"length": 4.97, "width": 1.86, "wheelbase": 2.83, "rear_overhang": 1.1, "max_steer": 0.6}


def drive(steer, gear, length, pose, step=0.05):
    """Poses along an arc, the first included."""
    curvature = math.tan(steer) / VEHICLE["wheelbase"]
    poses, n = [pose], round(length / step)
    for _ in range(n):
        x, y, h = poses[-1]
        to = h + gear * step * curvature
        if curvature:
            x += (math.sin(to) - math.sin(h)) / curvature
            y -= (math.cos(to) - math.cos(h)) / curvature
        else:
            x, y = x + gear * step * math.cos(h), y + gear * step * math.sin(h)
        poses.append((x, y, to))
    return poses


def right(far=0.0):
    """Three metres to the left, then two back, between a wall, a box and a point; all of it `far` away."""
    forth = drive(0.4, 1, 3.0, (far, -far, 0.3))
    back = drive(-0.3, -1, 2.0, forth[-1])
    path = {
        "poses": [list(p) for p in forth + back[1:]],
        "gears": [1] * 60 + [-1] * 41,
        "steer": [0.4] * 60 + [-0.3] * 41,
        "method": "test",
    }
    box = [[far + 2, -far - 4], [far + 4, -far - 4], [far + 4, -far - 3], [far + 2, -far - 3]]
    scene = {
        "name": "test",
        "vehicle": VEHICLE,
        "start": list(path["poses"][0]),
        "goal": list(path["poses"][-1]),
        "obstacles": [box, [[far - 5, -far + 6], [far + 9, -far + 6]]],
        "points": [[far + 9.0, -far + 0.0]],
        "bounds": [far - 10, -far - 10, far + 10, -far + 10],
    }
    return scene, path


class SecondOracle(unittest.TestCase):
    def refuses(self, why, change, far=0.0):
        scene, path = copy.deepcopy(right(far))
        change(scene, path)
        with self.assertRaises(Refused) as caught:
            check(scene, path)
        self.assertIn(why, str(caught.exception))

    def test_what_is_right_passes_anywhere(self):
        for far in (0.0, 1e6):
            self.assertAlmostEqual(check(*right(far)), 5.0, places=6)

    def test_ends(self):
        self.refuses("does not begin", lambda s, p: s["start"].__setitem__(0, 1e-5))
        self.refuses("from the goal", lambda s, p: s.__setitem__("goal", [9, 9, 0]))

    def test_steering(self):
        self.refuses("limit", lambda s, p: s["vehicle"].__setitem__("max_steer", 0.39))
        self.refuses("the motion ends", lambda s, p: p["steer"].__setitem__(7, 0.35))
        self.refuses("the motion ends", lambda s, p: p["gears"].__setitem__(7, -1))

    def test_bodies(self):
        middle = right()[1]["poses"][50]
        self.refuses("meets obstacle", lambda s, p: s["points"].append(middle[:2]))
        # Within the body alone, and round the whole of it.
        x, y = middle[:2]
        small = [[x, y], [x + 0.1, y], [x, y + 0.1]]
        self.refuses("meets obstacle", lambda s, p: s["obstacles"].append(small))
        large = [[-30, -30], [30, -30], [30, 30], [-30, 30]]
        self.refuses("meets obstacle", lambda s, p: s["obstacles"].append(large))
        # Thinner than the way between two poses.
        self.refuses("meets obstacle", lambda s, p: s["obstacles"].append([[1.02, -9], [1.021, 9]]))
        self.refuses("bounds", lambda s, p: s["bounds"].__setitem__(2, 2.0))
        self.refuses("meets", lambda s, p: s["points"].append([1e6 + 1, -1e6 + 0.3]), far=1e6)

    def test_arrays(self):
        self.refuses("lengths", lambda s, p: p["gears"].pop())
        self.refuses("none", lambda s, p: p["steer"].__setitem__(3, math.nan))


if __name__ == "__main__":
    unittest.main()
