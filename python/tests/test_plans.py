"""Plans are those of the program, however they are asked for."""

import hashlib
import json
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import GOAL, POLYGONS, ROOT, START
from numpy.lib.recfunctions import structured_to_unstructured

import n3p

# SHA-256 of what `n3p-plan --scene FILE --out OUT` writes.
PATHS = json.loads((Path(__file__).parent / "paths.json").read_text())


def planned(file):
    scene = n3p.load_scene(ROOT / file)
    return n3p.Parker(vehicle=scene.vehicle).plan_scene(scene)


@pytest.mark.parametrize("file", PATHS)
def test_paths_are_the_programs_to_the_byte(file):
    text = planned(file).to_json().encode()
    assert hashlib.sha256(text).hexdigest() == PATHS[file]


@pytest.mark.parametrize("file", PATHS)
def test_the_program_here_writes_the_same(file, n3p_plan, tmp_path):
    out = tmp_path / "path.json"
    command = [n3p_plan, "--scene", ROOT / file, "--out", out]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    assert out.read_text() == planned(file).to_json()


def test_arrays_have_the_types_and_shapes_they_say(parker):
    plan = parker.plan(START, GOAL, polygons=POLYGONS)
    count = len(plan)
    assert (plan.poses.dtype, plan.poses.shape) == (np.float64, (count, 3))
    assert (plan.gears.dtype, plan.gears.shape) == (np.int8, (count,))
    assert (plan.steer.dtype, plan.steer.shape) == (np.float64, (count,))
    assert plan.poses[0].tolist() == list(START) and plan.poses[-1].tolist() == list(GOAL)
    assert set(plan.gears.tolist()) <= {1, -1}
    assert plan.segments.shape[1] == 2
    assert np.abs(plan.segments[:, 1]).sum() == pytest.approx(plan.length)
    assert plan.direction_changes == np.count_nonzero(np.diff(plan.gears))
    steps = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    assert steps.max() <= 0.05 + 1e-9
    assert plan.method == "n3p" and plan.goal_index == 0 and plan.route
    file = json.loads(plan.to_json())
    assert file["poses"] == plan.poses.tolist() and file["steer"] == plan.steer.tolist()
    assert repr(plan).startswith(f"<Plan by n3p: {plan.length:.2f} m")
    for name in ("poses", "gears", "steer", "segments"):
        assert getattr(plan, name) is getattr(plan, name)
        with pytest.raises(ValueError):
            getattr(plan, name)[0] = 0


def test_segments_lead_from_start_to_goal(parker):
    plan = parker.plan(START, GOAL, polygons=POLYGONS, tolerance=(0.2, 0.05))
    x, y, heading = plan.poses[0]
    for curvature, length in plan.segments:
        turned = heading + curvature * length
        if curvature:
            x += (np.sin(turned) - np.sin(heading)) / curvature
            y -= (np.cos(turned) - np.cos(heading)) / curvature
        else:
            x, y = x + length * np.cos(heading), y + length * np.sin(heading)
        heading = turned
    assert (x, y) == pytest.approx(plan.poses[-1, :2], abs=1e-6)
    assert np.cos(heading - plan.poses[-1, 2]) == pytest.approx(1.0)


def test_a_trajectory_is_columns(parker):
    plan = parker.plan(START, GOAL, polygons=POLYGONS)
    driven = plan.trajectory()
    assert isinstance(driven, dict) and len({len(column) for column in driven.values()}) == 1
    assert driven["speed_mps"][-1] == 0.0 and driven["x_m"][-1] == GOAL[0]
    assert driven["distance_m"][-1] == pytest.approx(plan.length)
    assert driven.report["duration_s"] == driven["time_s"][-1]
    assert plan.trajectory(stop_to_steer=True).report["steer_rate_kept"]
    assert plan.trajectory(acceleration=0.3).report["max_acceleration_mps2"] == 0.3
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(n3p.BadInput, match="acceleration"):
            plan.trajectory(acceleration=wrong)
    with pytest.raises(TypeError):
        plan.trajectory(acceleration="fast")


def within(rows, offset, stride):
    """The rows as a view that begins `offset` bytes into a buffer and takes `stride` for a row."""
    rows = np.array(rows)
    view = np.ndarray(
        rows.shape, float, bytearray(offset + stride * len(rows)), offset, (stride, 8)
    )
    view[:] = rows
    return view


def among_records(rows):
    """The rows as the first fields of records that have an `int32` behind them, and no gaps."""
    rows = np.array(rows)
    names = [f"c{i}" for i in range(rows.shape[1])]
    records = np.zeros(len(rows), [*((name, float) for name in names), ("id", np.int32)])
    for name, column in zip(names, rows.T):
        records[name] = column
    return structured_to_unstructured(records[names])


@pytest.mark.parametrize(
    "form",
    [
        lambda rows: np.array(rows),
        lambda rows: np.array(rows, dtype=np.float32),
        lambda rows: np.asfortranarray(rows),
        lambda rows: np.repeat(np.array(rows), 2, axis=0)[::2],
        lambda rows: np.array([rows, rows])[0, ::-1][::-1],
        lambda rows: tuple(map(list, rows)),
        lambda rows: [np.array(row) for row in rows],
        lambda rows: [[np.float32(v) for v in row] for row in rows],
        among_records,
        lambda rows: within(rows, 0, 28),
        lambda rows: within(rows, 1, 32),
        lambda rows: within(rows, 4, 28)[::-1][::-1],
        lambda rows: np.frombuffer(b"?" + np.array(rows).tobytes(), offset=1).reshape(
            len(rows), -1
        ),
    ],
)
def test_numbers_may_come_in_any_form(parker, form):
    # These corners are the same in single precision.
    polygons = [[(-4.25, -2.5), (-1.5, -2.5), (-1.5, 2.5), (-4.25, 2.5)]]
    expected = parker.plan(START, (0.0, -1.5, 1.5), polygons=polygons)
    given = parker.plan(form([START])[0], form([(0.0, -1.5, 1.5)])[0], polygons=map(form, polygons))
    assert given.to_json() == expected.to_json()


def test_views_of_records_are_copied():
    """Theirs are strides that are no whole numbers of values, and values that are not aligned."""
    rows = np.arange(8.0).reshape(4, 2)
    assert among_records(rows).strides == (20, 8)
    for view in (among_records(rows), within(rows, 1, 16), within(rows, 0, 20)[::-1]):
        scene = n3p.Scene(view[:3, 0], (0, 0, 0), points=view)
        assert scene.points.tolist() == view.tolist()
        assert scene.start.tolist() == view[:3, 0].tolist()


def test_whole_numbers_are_numbers(parker):
    plan = parker.plan(np.array([-9, 6, 0]), [0, -2, 0], points=np.array([[20, 20]]))
    assert plan.poses[-1].tolist() == [0.0, -2.0, 0.0]


def test_a_grid_is_what_it_holds(parker):
    cells = np.zeros((50, 100), dtype=bool)
    cells[10:30, 20:40] = True
    square = [(-6.0, -2.0), (-2.0, -2.0), (-2.0, 2.0), (-6.0, 2.0)]
    expected = parker.plan(START, (6.0, 0.0, 0.0), polygons=[square])
    full = cells.astype(np.uint8) * 100
    # The third is an array of bool that holds other bytes than 0 and 1.
    for array in (cells, full, full.view(bool), cells.astype(float), cells.tolist()):
        plan = parker.plan(START, (6.0, 0.0, 0.0), grid=(array, 0.2, (-10.0, -4.0)))
        np.testing.assert_allclose(plan.poses, expected.poses, atol=1e-6)
    turned = np.asfortranarray(cells)[:, ::-1][:, ::-1]
    assert len(parker.plan(START, (6.0, 0.0, 0.0), grid=(turned, 0.2, (-10.0, -4.0))))


def test_goals_tolerance_and_type_are_heard(parker):
    far, near = (30.0, 0.0, 0.0), (5.0, 6.0, 0.0)
    plan = parker.plan(START, goals=[far, near])
    assert plan.goal_index == 1 and plan.poses[-1].tolist() == list(near)
    for tolerance in ((0.3, 0.1), {"position_m": 0.3, "heading_rad": 0.1}):
        plan = parker.plan(START, GOAL, polygons=POLYGONS, tolerance=tolerance)
        assert np.hypot(*(plan.poses[-1] - GOAL)[:2]) <= 0.3 + 1e-9
    assert (
        parker.plan(START, GOAL, polygons=POLYGONS, parking_type="reverse").parking_type
        == "reverse"
    )


def test_a_batch_is_one_by_one(parker):
    scenes = n3p.generate("parallel", "complex", 20, seed=3)
    request = dict(start=START, goal=GOAL, polygons=POLYGONS)
    file = ROOT / "examples/scenes/reverse.json"
    batch = [*scenes, request, file, str(file), scenes[0].to_dict()]
    one_by_one = [parker.plan_scene(scene) for scene in scenes]
    one_by_one += [parker.plan(**request), parker.plan_scene(file), parker.plan_scene(file)]
    one_by_one.append(one_by_one[0])
    together = parker.plan_batch(batch)
    assert [plan.to_json() for plan in together] == [plan.to_json() for plan in one_by_one]
    assert parker.plan_batch([]) == [] and parker.plan_batch(iter(scenes[:1]))[0].length > 0


def test_a_batch_says_of_each_what_is_wrong(parker):
    walled = dict(START_AND_GOAL, polygons=[[(-3, 4), (3, 4), (3, 5), (-3, 5)]])
    scene = n3p.generate("reverse", "easy")[0]
    other = n3p.Scene(START, GOAL, vehicle=n3p.Vehicle(length=4.0, wheelbase=2.5))
    items = [None, scene, 3, {}, scene, dict(START_AND_GOAL, gaol=GOAL), walled, other, "no.json"]
    plans = parker.plan_batch(items)
    kinds = [type(plan).__name__ for plan in plans]
    assert kinds == ["BadInput", "Plan", "BadInput", "BadInput", "Plan", "BadInput"] + [
        kinds[6],
        "BadInput",
        "BadInput",
    ]
    assert "gaol" in str(plans[5]) and "vehicle" in str(plans[7]) and "no.json" in str(plans[8])


START_AND_GOAL = dict(start=START, goal=GOAL)


def test_no_path_has_a_reason():
    ring = [
        [(-20, -20), (20, -20)],
        [(20, -20), (20, 20)],
        [(20, 20), (-20, 20)],
        [(-20, 20), (-20, -20)],
    ]
    parker = n3p.Parker(method="ha-rs", max_expansions=2000)
    with pytest.raises(n3p.NoPath, match="no path: ") as caught:
        parker.plan((0, 0, 0), (40, 0, 0), polylines=ring)
    assert caught.value.reason in str(caught.value) and caught.value.reason
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), again.reason) == (n3p.NoPath, caught.value.reason)
    assert not isinstance(caught.value, ValueError) and issubclass(n3p.BadInput, ValueError)


@pytest.mark.parametrize("method", n3p.METHODS)
def test_every_method_plans(method):
    scene = n3p.generate("parallel", "easy")[0]
    plan = n3p.Parker(method=method).plan_scene(scene)
    assert plan.method == method and plan.poses[-1].tolist() == scene.goal.tolist()


@pytest.mark.parametrize("method", ["rl-simple", "rl-eval", "policy"])
def test_policies_are_not_for_this_package(method):
    assert method not in n3p.METHODS
    for use in (lambda: n3p.Parker(method=method), lambda: n3p.evaluate([], [method])):
        with pytest.raises(n3p.BadInput, match=f"{method} is a policy.*expected one of ha, .*n3p$"):
            use()


def test_settings_are_heard():
    scene = n3p.load_scene(ROOT / "examples/scenes/forward.json")
    usual = n3p.Parker(method="ha-rs").plan_scene(scene)
    first = n3p.Parker(method="ha-rs", effort="first").plan_scene(scene)
    assert first.expansions < usual.expansions
    with pytest.raises(n3p.NoPath, match="budget"):
        n3p.Parker(method="ha", max_expansions=3).plan_scene(scene)
    wide = n3p.Parker(margin=0.1).plan_scene(scene)
    assert 0.005 < wide.margin <= 0.1
    own = n3p.Parker(models=[ROOT / "models/knn.bin"]).plan_scene(scene)
    assert own.to_json() == n3p.Parker().plan_scene(scene).to_json()
    into = dict(polygons=[[(3.5, -1), (5, -1), (5, 1), (3.5, 1)]])
    with pytest.raises(n3p.BadInput, match="start: the footprint"):
        n3p.Parker().plan((-0.3, 0, 0), (-9, 0, 0), **into)
    assert n3p.Parker(allow_contact=0.2).plan((-0.3, 0, 0), (-9, 0, 0), **into).length > 8
