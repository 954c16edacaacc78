"""Whatever is given, an exception says what is wrong; the interpreter goes on."""

import gc
import threading

import numpy as np
import pytest
from conftest import GOAL, POLYGONS, START

import n3p

NAN, INF = float("nan"), float("inf")


class Odd:
    """An object that is nothing."""


class Raising:
    """A number that will not say which."""

    def __float__(self):
        raise RuntimeError("no")


itself = []
itself.append(itself)

POSES = [
    None,
    "here",
    b"abc",
    3,
    (),
    (1, 2),
    (1, 2, 3, 4),
    ("1", "2", "3"),
    (1, None, 3),
    (NAN, 0, 0),
    (0, INF, 0),
    (0, 0, 1e300),
    (1e300, 0, 0),
    (10**400, 0, 0),
    (1j, 0, 0),
    [[1, 2, 3]],
    np.zeros(2),
    np.zeros((3, 1)),
    np.array(["1", "2", "3"]),
    np.array([1, 2, None]),
    np.zeros(3, dtype=complex),
    np.array(3.0),
    {"x": 1},
    {1, 2, 3},
    Odd(),
    Raising(),
    (Raising(), 0, 0),
    itself,
]


@pytest.mark.parametrize("pose", POSES, ids=lambda p: str(type(p).__name__))
def test_no_pose(parker, pose):
    with pytest.raises(n3p.BadInput, match="^start"):
        parker.plan(pose, GOAL)
    with pytest.raises(n3p.BadInput, match="goal"):
        parker.plan(START, pose)


POLYGONS_WRONG = [
    "walls",
    3,
    {"a": POLYGONS[0]},
    [None],
    ["wall"],
    [[]],
    [[(0, 0)]],
    [np.zeros(2)],
    [np.zeros((4, 3))],
    [np.zeros((2, 4, 2))],
    np.zeros((4, 2)),
    [[(0, 0), (1, "1"), (2, 2)]],
    [[(0, 0), (1, NAN), (2, 2)]],
    [[(0, 0), (1e300, 1), (2, 2)]],
    [[(0, 0), (1, 1), None]],
    [np.full((4, 2), NAN)],
    [np.full((4, 2), INF, dtype=np.float32)],
    [np.array([["a", "b"]] * 3)],
    [Odd()],
    itself,
]


@pytest.mark.parametrize("polygons", POLYGONS_WRONG, ids=lambda p: str(type(p).__name__))
def test_no_polygons(parker, polygons):
    with pytest.raises(n3p.BadInput):
        parker.plan(START, GOAL, polygons=polygons)
    with pytest.raises(n3p.BadInput):
        n3p.Scene(START, GOAL, polygons=polygons) and parker.plan(START, GOAL, polygons=polygons)


def test_the_message_says_where(parker):
    with pytest.raises(n3p.BadInput, match=r"^polygons\[1\]\[2\]\[0\]: is 'a' \(str\)"):
        parker.plan(START, GOAL, polygons=[POLYGONS[0], [(0, 0), (1, 1), ("a", 2)]])
    with pytest.raises(
        n3p.BadInput, match=r"^polygons\[0\]: has shape \(4, 3\); expected \(any, 2\)"
    ):
        parker.plan(START, GOAL, polygons=[np.zeros((4, 3))])
    with pytest.raises(n3p.BadInput, match=r"obstacles\[0\]\[1\]"):
        parker.plan(START, GOAL, polygons=[[(0, 0), (1, NAN), (2, 2)]])


@pytest.mark.parametrize(
    "arguments",
    [
        {"points": 3},
        {"points": "abc"},
        {"points": [(1, 2, 3)]},
        {"points": np.zeros((2, 3))},
        {"points": [(NAN, 0)]},
        {"polylines": [[(0, 0)]]},
        {"polylines": [[(20, 20), (NAN, 0)]]},
        {"bounds": (0, 0, 1)},
        {"bounds": (1, 1, -1, -1)},
        {"bounds": "wide"},
        {"goals": [GOAL]},
        {"tolerance": 1},
        {"tolerance": (-1, 0)},
        {"tolerance": (NAN, 0)},
        {"tolerance": (100, 0)},
        {"tolerance": {"metres": 1}},
        {"parking_type": "sideways"},
        {"parking_type": 3},
        {"grid": 3},
        {"grid": np.zeros((3, 3))},
        {"grid": (np.zeros((3, 3)), 0.1)},
        {"grid": (np.zeros(9), 0.1, (50, 50))},
        {"grid": (np.zeros((3, 3, 3), bool), 0.1, (50, 50))},
        {"grid": (np.zeros((3, 3)), 0.0, (50, 50))},
        {"grid": (np.zeros((3, 3)), -0.1, (50, 50))},
        {"grid": (np.zeros((3, 3)), NAN, (50, 50))},
        {"grid": (np.zeros((3, 3)), "fine", (50, 50))},
        {"grid": (np.zeros((3, 3)), 0.1, (50,))},
        {"grid": (np.full((3, 3), NAN), 0.1, (50, 50))},
        {"grid": (np.array([["#", " "]] * 2), 0.1, (50, 50))},
        {"grid": (None, 0.1, (50, 50))},
        {"grid": (np.ones((3, 3)), 1e300, (50, 50))},
        {"grid": (np.ones((3, 3)), 0.1, (1e300, 50))},
    ],
    ids=str,
)
def test_no_lot(parker, arguments):
    with pytest.raises(n3p.BadInput) as caught:
        parker.plan(START, GOAL, **arguments)
    assert str(caught.value)


def test_goals_are_one_or_more(parker):
    with pytest.raises(n3p.BadInput, match="goal: is missing"):
        parker.plan(START)
    for goals in ([], np.zeros((0, 3)), [GOAL] * 300, [(1, 2)], 3, [None]):
        with pytest.raises(n3p.BadInput, match="goals"):
            parker.plan(START, goals=goals)


@pytest.mark.parametrize(
    "scene",
    [
        None,
        3,
        [],
        b"x",
        Odd(),
        {},
        {"start": 3},
        {1: 2},
        {"vehicle": itself},
        "missing.json",
        "",
        "\0",
    ],
    ids=str,
)
def test_no_scene(parker, scene):
    with pytest.raises(n3p.BadInput):
        parker.plan_scene(scene)


@pytest.mark.parametrize(
    "change, told",
    [
        ({"start": [0, 0]}, "start"),
        ({"start": [NAN, 0, 0]}, r"start\[0\]"),
        ({"start": "here"}, "start"),
        ({"goal": None}, "goal"),
        ({"goal": [1e300, 0, 0]}, "goal|coordinate"),
        ({"obstacles": 3}, "obstacles is 3; expected a list"),
        ({"obstacles": [[[0, 0], [1, NAN]]]}, r"obstacles\[0\]\[1\]\[1\]"),
        ({"obstacles": [Odd()]}, r"obstacles\[0\]: is a Odd"),
        ({"obstacles": itself}, "too deep"),
        ({"obstacles": [[[10**400, 0]]]}, "too large"),
        ({"vehicle": {}}, "vehicle|length"),
        ({"vehicle": n3p.Vehicle()}, "vehicle: is a Vehicle"),
        ({"gaol": 1}, "gaol"),
        ({"bounds": [1, 2]}, "bounds"),
        ({"name": "x" * 300}, "name"),
    ],
    ids=str,
)
def test_no_dict(change, told):
    scene = n3p.generate("reverse", "easy")[0].to_dict()
    with pytest.raises(n3p.BadInput, match=told):
        n3p.Scene.from_dict({**scene, **change})


@pytest.mark.parametrize(
    "make",
    [
        lambda: n3p.Parker(vehicle=3),
        lambda: n3p.Parker(vehicle={}),
        lambda: n3p.Parker(vehicle={"length": NAN}),
        lambda: n3p.Parker(method="a-star"),
        lambda: n3p.Parker(models="knn.bin"),
        lambda: n3p.Parker(models=["missing.bin"]),
        lambda: n3p.Parker(models=[__file__]),
        lambda: n3p.Parker(models=[3]),
        lambda: n3p.Parker(margin=-1),
        lambda: n3p.Parker(margin=NAN),
        lambda: n3p.Parker(margin=5),
        lambda: n3p.Parker(allow_contact=INF),
        lambda: n3p.Parker(effort="none"),
        lambda: n3p.Parker(max_expansions=-1),
        lambda: n3p.Vehicle(length=NAN),
        lambda: n3p.Vehicle(length=-1),
        lambda: n3p.Vehicle(max_steer=35.0),
        lambda: n3p.generate("sideways", "easy"),
        lambda: n3p.generate("reverse", "hard"),
        lambda: n3p.generate("reverse", 3),
        lambda: n3p.generate("reverse", "easy", -1),
        lambda: n3p.generate("reverse", "easy", 10**9),
        lambda: n3p.generate("reverse", "easy", 1, -1),
        lambda: n3p.generate("reverse", "easy", 1, 2**64),
        lambda: n3p.generate("reverse", "easy", first=-1),
        lambda: n3p.generate("reverse", "easy", vehicle=n3p.Vehicle(length=30.0)),
        lambda: n3p.load_scene(3),
        lambda: n3p.load_scene(None),
        lambda: n3p.load_scene("missing.json"),
        lambda: n3p.load_scene(__file__),
        lambda: n3p.Scene.from_dict([]),
        lambda: n3p.Scene.from_json("{"),
        lambda: n3p.Scene.from_json(""),
    ],
)
def test_bad_values_are_bad_input(make):
    with pytest.raises(n3p.BadInput) as caught:
        make()
    assert str(caught.value)


@pytest.mark.parametrize(
    "call",
    [
        lambda parker: parker.plan(),
        lambda parker: parker.plan(START, GOAL, gaol=GOAL),
        lambda parker: n3p.Parker(margin="wide"),
        lambda parker: n3p.Parker(max_expansions=1.5),
        lambda parker: n3p.Vehicle(length="long"),
        lambda parker: n3p.Vehicle(4.0),
        lambda parker: n3p.generate(),
        lambda parker: n3p.Parker.plan(3, START, GOAL),
        lambda parker: n3p.Plan(),
        lambda parker: setattr(parker, "method", "ha"),
    ],
)
def test_calls_that_are_none_are_python_s_own_errors(parker, call):
    with pytest.raises((TypeError, AttributeError)):
        call(parker)


@pytest.mark.parametrize("requests", [None, 3, "scene.json", {}, Odd()], ids=str)
def test_no_batch(parker, requests):
    with pytest.raises(n3p.BadInput, match="list of scenes"):
        parker.plan_batch(requests)


def test_an_exception_of_the_caller_passes_through(parker):
    def scenes():
        yield n3p.generate("reverse", "easy")[0]
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        parker.plan_batch(scenes())


def test_arrays_that_are_huge_are_planned_or_refused(parker):
    rng = np.random.default_rng(1)
    far = rng.uniform(20, 60, (200_000, 2))
    assert parker.plan(START, GOAL, polygons=POLYGONS, points=far).length > 0
    with pytest.raises(n3p.BadInput):
        parker.plan(START, GOAL, points=np.zeros((200_000, 2)) + GOAL[:2])
    cells = rng.random((400, 400)) < 0.3
    assert parker.plan(START, GOAL, polygons=POLYGONS, grid=(cells, 0.1, (30, 30))).length > 0


def test_plans_outlive_their_parker_and_arrays_their_plan():
    poses = n3p.Parker().plan(START, GOAL, polygons=POLYGONS).poses
    gc.collect()
    assert poses[-1].tolist() == list(GOAL)


def test_a_thousand_threads_share_one_parker(parker):
    scenes = n3p.generate("parallel", "complex", 10, seed=9)
    expected = [plan.to_json() for plan in parker.plan_batch(scenes)]
    plans, errors = [None] * 1000, []
    shared = np.array(POLYGONS[0])
    gate = threading.Barrier(1000)

    def work(i):
        try:
            gate.wait()
            plans[i] = parker.plan_scene(scenes[i % 10]).to_json()
            parker.plan(START, GOAL, polygons=[shared])
            with pytest.raises(n3p.BadInput):
                parker.plan(START, None, polygons=[shared])
        except BaseException as error:  # whatever it is, the test must hear of it
            errors.append(error)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(1000)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert plans == [expected[i % 10] for i in range(1000)]


def test_other_threads_run_while_a_batch_is_planned(parker):
    scenes = n3p.generate("forward", "extreme", 300, seed=4)
    ticks, done = 0, threading.Event()

    def plan():
        parker.plan_batch(scenes)
        done.set()

    thread = threading.Thread(target=plan)
    thread.start()
    while not done.wait(0.001):
        ticks += 1
    thread.join()
    assert ticks > 10
