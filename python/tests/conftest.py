"""What the tests share."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from cluster_helpers import program

import n3p
from n3p.cluster.seeds import Trainings
from n3p.cluster.work import Collection

ROOT = Path(__file__).resolve().parents[2]

START = (-9.0, 6.0, 0.0)
GOAL = (0.0, -1.4, np.pi / 2)
POLYGONS = [
    [(-4.1, -2.6), (-1.6, -2.6), (-1.6, 2.4), (-4.1, 2.4)],
    [(1.6, -2.6), (4.1, -2.6), (4.1, 2.4), (1.6, 2.4)],
]


@pytest.fixture(scope="session")
def parker():
    return n3p.Parker()


@pytest.fixture(scope="session")
def n3p_plan():
    """The program n3p-plan of this revision, which the variable `N3P_PLAN` names."""
    if "N3P_PLAN" not in os.environ:
        pytest.skip("N3P_PLAN does not name the program n3p-plan")
    return os.environ["N3P_PLAN"]


# Work on many machines, by programs that are not what they seem.

FAKE_COLLECT = Path(__file__).with_name("fake_collect.py")


@pytest.fixture
def bin_dir(tmp_path):
    """A folder with a fake n3p-collect."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program(folder / "n3p-collect", f"#!{sys.executable}\n{FAKE_COLLECT.read_text()}")
    (folder / "version").write_text("n3p-collect 1.0 (abc)")
    return folder


@pytest.fixture
def collection(tmp_path, bin_dir):
    """A collection by the fake n3p-collect."""
    (tmp_path / "c.toml").write_text("seed = 1\n")
    return Collection(tmp_path / "c.toml", tmp_path / "out", str(bin_dir))


FAKE_TRAIN = """\
import json, sys
from pathlib import Path
words = sys.argv[1:]
if words == ["--version"]:
    print("n3p-train 1.0 (abc)")
    sys.exit()
after = dict(zip(words, words[1:]))
assert Path(after["--data"], "rows").read_text() == "rows"
out = Path(after["--out"])
out.write_text(after["--seed"])
log = {"losses": [1, 2], "seconds": True, "quality": {"error": int(after["--seed"]) / 2}}
out.with_suffix(".training.json").write_text(json.dumps(log))
"""


@pytest.fixture
def trainings(tmp_path, bin_dir):
    """Makes four trainings by a fake n3p-train."""
    program(bin_dir / "n3p-train", f"#!{sys.executable}\n{FAKE_TRAIN}")
    data = tmp_path / "data"
    data.mkdir()
    (data / "rows").write_text("rows")

    def make(in_place=False):
        command = ["mlp", "--type", "reverse", f"--data={data}"]
        sweep = [("epochs", ["5", "6"])]
        return Trainings(command, [1, 2], tmp_path / "models", str(bin_dir), sweep, in_place)

    return make
