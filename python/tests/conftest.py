"""What the tests share."""

import os
from pathlib import Path

import numpy as np
import pytest

import n3p

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
