"""Scenes: from files, dicts, arrays and the generator; and rows."""

import copy
import hashlib
import json
import pickle

import numpy as np
import pytest
from conftest import GOAL, POLYGONS, ROOT, START

import n3p

REVERSE = ROOT / "examples/scenes/reverse.json"


def test_a_scene_is_its_dict_and_its_file():
    scene = n3p.load_scene(REVERSE)
    assert scene == n3p.load_scene(str(REVERSE)) == n3p.Scene.from_json(REVERSE.read_text())
    assert dict(scene) == scene.to_dict() and n3p.Scene.from_dict(dict(scene)) == scene
    assert scene == scene.to_dict() and scene != dict(scene, start=[0, 0, 0]) and scene != 3
    assert (
        scene["start"] == scene.start.tolist()
        and "goal" in scene
        and len(scene) == len(list(scene))
    )
    assert scene.to_json() + "\n" == REVERSE.read_text()
    assert [o.tolist() for o in scene.obstacles] == scene["obstacles"]
    assert list(scene) == list(scene.keys()) == list(scene.to_dict())
    assert {"start", "goal"} <= scene.keys() and 3 not in scene
    for key in ("gaol", 3, "\ud800"):
        with pytest.raises(KeyError):
            scene[key]
    scene["start"].append(0.0)
    assert scene["start"] == scene.start.tolist()


def test_copies_are_equal():
    for scene in (n3p.load_scene(REVERSE), n3p.generate("reverse", "complex")[0]):
        for same in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
            assert same == scene and hash(same) == hash(scene) and same.level == scene.level


def test_zeros_of_either_sign_are_the_same():
    scenes = [n3p.Scene((zero, zero, zero), GOAL) for zero in (0.0, -0.0)]
    assert scenes[0] == scenes[1] and len(set(scenes)) == 1


def test_dicts_may_hold_arrays():
    scene = n3p.load_scene(REVERSE)
    arrays = dict(
        scene,
        start=scene.start,
        goal=np.array(scene.goal),
        obstacles=scene.obstacles,
        bounds=tuple(np.float64(b) for b in scene["bounds"]),
    )
    assert n3p.Scene.from_dict(arrays) == scene


def test_a_scene_of_arguments_plans_the_same(parker):
    lot = dict(
        polygons=POLYGONS, polylines=[[(-15, 9.5), (15, 9.5), (15, 12)]], points=[(12.0, 8.0)]
    )
    scene = parker.scene(START, GOAL, name="bay", **lot)
    assert scene.name == "bay" and scene.points.shape == (1, 2) and len(scene.obstacles) == 2
    assert scene["polylines"] == [[[-15, 9.5], [15, 9.5], [15, 12]]]
    assert parker.plan_scene(scene).to_json() == parker.plan(START, GOAL, **lot).to_json()
    assert n3p.Scene(START, GOAL, name="bay", **lot) == scene


# Of the files of `cargo run --example export_scenes -- DIR 3 5`, in the order of their names.
EXPORTED = "28d84569d624bbd65571570947998f884b9b8dd654b576f5bccbe722e35f8fd8"


def test_generated_scenes_are_those_of_rust():
    scenes = [
        scene
        for kind in ("forward", "parallel", "reverse")
        for level in ("easy", "complex", "extreme")
        for scene in n3p.generate(kind, level, 3, seed=5)
    ]
    scenes.sort(key=lambda scene: scene.name)
    text = "".join(scene.to_json() + "\n" for scene in scenes)
    assert hashlib.sha256(text.encode()).hexdigest() == EXPORTED
    assert {scene.level for scene in scenes} == {"easy", "complex", "extreme"}


def test_the_generator_counts_on_and_takes_other_cars():
    three = n3p.generate("forward", "easy", 3, seed=2)
    assert n3p.generate("forward", "easy", 1, seed=2, first=2) == three[2:]
    assert n3p.generate("forward", "easy", 0) == []
    small = n3p.Vehicle(length=4.0, width=1.7, wheelbase=2.5, rear_overhang=0.7)
    assert n3p.generate("forward", "easy", vehicle=small)[0].vehicle == small
    assert n3p.generate("forward", "easy", vehicle=small.to_dict())[0].vehicle == small


def test_vehicles_are_values():
    vehicle = n3p.Vehicle(width=1.8)
    assert vehicle == n3p.Vehicle(**vehicle.to_dict()) == pickle.loads(pickle.dumps(vehicle))
    assert vehicle != n3p.Vehicle() and eval(repr(vehicle), vars(n3p)) == vehicle
    assert n3p.Vehicle().turning_radius == pytest.approx(4.057, abs=1e-3)
    assert n3p.Parker(vehicle=vehicle).vehicle == vehicle
    assert len({vehicle, n3p.Vehicle(width=1.8), n3p.Vehicle()}) == 2


def test_rows_are_columns():
    scenes = n3p.generate("reverse", "easy", 4) + [n3p.load_scene(REVERSE)]
    rows = n3p.evaluate(scenes, ["n3p", "ha-rs", "sha"])
    assert list(rows)[:5] == ["scene", "type", "level", "method", "ok"] and len(rows) == 20
    assert {column.shape for column in rows.values()} == {(15,)}
    assert rows["method"].tolist() == ["n3p", "ha-rs", "sha"] * 5
    fine = rows["method"] != "sha"
    assert rows["ok"][fine].all() and not rows["ok"][~fine].any()
    assert (
        np.isnan(rows["length_m"][~fine]).all()
        and (rows["reason"][~fine] == "not applicable").all()
    )
    assert rows["cost_over_best"][fine].min() == 1.0 and (rows["plan_time_s"] > 0).all()
    assert rows["level"].tolist()[-1] == "" and (rows["checked"][fine] == "certified").all()
    for threads in (2, 7):
        again = n3p.evaluate(scenes, ["n3p", "ha-rs", "sha"], threads=threads)
        for name in set(rows) - {"plan_time_s"}:
            np.testing.assert_array_equal(again[name], rows[name])
    empty = n3p.evaluate([])
    assert {column.shape for column in empty.values()} == {(0,)}


def test_scenes_of_several_vehicles_make_one_table():
    small = n3p.Vehicle(length=3.6, width=1.6, wheelbase=2.4, rear_overhang=0.6, max_steer=0.7)
    scenes = n3p.generate("forward", "easy", 1) + [
        n3p.Scene(START, GOAL, polygons=POLYGONS, vehicle=small, name="small")
    ]
    assert n3p.evaluate(scenes, ["n3p", "ha-rs"])["ok"].all()
    assert n3p.evaluate(scenes[:1], ["mlp-n3p", "knn-n3p"])["ok"].all()


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_rows_go_into_tables(library):
    pytest.importorskip(library)
    rows = n3p.evaluate(n3p.generate("reverse", "easy", 2), ["n3p", "ha-rs"])
    if library == "pandas":
        import pandas

        assert pandas.DataFrame(rows).equals(rows.to_pandas())
        assert rows.to_pandas().groupby("method").ok.sum().to_dict() == {"ha-rs": 2, "n3p": 2}
    elif library == "polars":
        import polars

        assert polars.DataFrame(rows).equals(rows.to_polars())
        assert rows.to_polars()["scene"].dtype == polars.String and rows.to_polars().height == 4
    else:
        import pyarrow

        assert pyarrow.table(rows) == rows.to_arrow()
        assert rows.to_arrow().num_rows == 4


@pytest.mark.parametrize(
    "scenes, options, told",
    [
        (None, {}, "list of scenes"),
        ("reverse.json", {}, "list of scenes"),
        ([3], {}, "expected a Scene"),
        ([REVERSE, REVERSE], {}, "occurs twice"),
        ([REVERSE], {"methods": "n3p"}, "list of names"),
        ([REVERSE], {"methods": ["a-star"]}, "unknown method"),
        ([REVERSE], {"methods": ["n3p", "n3p"]}, "twice"),
        ([REVERSE], {"methods": [None]}, "expected text"),
        ([REVERSE], {"threads": 0}, "threads"),
        ([REVERSE], {"margin": 2.0}, "margin"),
        ([REVERSE], {"effort": "none"}, "effort"),
    ],
)
def test_what_cannot_be_evaluated_is_said(scenes, options, told):
    with pytest.raises(n3p.BadInput, match=told):
        n3p.evaluate(scenes, **options)


def test_maps_become_scenes():
    fixtures = ROOT / "tests/fixtures/maps"
    lot = n3p.load_map(fixtures / "lot.geojson")
    assert lot.vehicle.length == 4.69 and len(lot["obstacles"]) == 1
    cloud = n3p.load_map(
        fixtures / "cloud.csv", start=(0, 0, 0), goal=(5, 0, 0), heights=(0.5, 2.0)
    )
    assert cloud["points"] == [[1.5, 2.25], [-3.125, 4.0]]
    floor = n3p.load_map(
        ROOT / "examples/maps/shop-floor.yaml",
        start=(0, 12, 0),
        goals=[(12.3, 0.2, 1.5708)],
        vehicle=json.loads((ROOT / "examples/maps/tugger.json").read_text()),
    )
    assert floor["drivable_area"]["outer"][0] == [-2.0, -1.0]
    for wrong in (
        lambda: n3p.load_map(fixtures / "lot.yaml"),
        lambda: n3p.load_map(fixtures / "none.yaml"),
        lambda: n3p.load_map(fixtures / "lot.yaml", unknown="maybe"),
        lambda: n3p.load_map(fixtures / "lot.yaml", start=(0, 0, 0), goal=(1, 0)),
    ):
        with pytest.raises(n3p.BadInput):
            wrong()
