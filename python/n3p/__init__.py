"""N3P: automated parking with a learned preparatory pose.

Make a `Parker`, and ask it for plans::

    import n3p

    parker = n3p.Parker()
    plan = parker.plan(
        start=(-9.0, 6.0, 0.0),
        goal=(0.0, -1.4, 1.5708),
        polygons=[
            [(-4.1, -2.6), (-1.6, -2.6), (-1.6, 2.4), (-4.1, 2.4)],
            [(1.6, -2.6), (4.1, -2.6), (4.1, 2.4), (1.6, 2.4)],
        ],
    )
    plan.poses  # numpy float64 (N, 3): x, y, heading

Metres, radians, counter-clockwise; a pose is that of the rear-axle centre. The guide is
docs/python.md. Environments for reinforcement learning are in `n3p.gym`, which needs gymnasium.
"""

from n3p._n3p import (
    METHODS,
    Parker,
    Plan,
    Scene,
    Vehicle,
    __version__,
    evaluate,
    generate,
    load_map,
    load_scene,
)
from n3p.columns import Columns, Rows, Trajectory
from n3p.errors import BadInput, N3PError, NoPath

__all__ = [
    "METHODS",
    "BadInput",
    "Columns",
    "N3PError",
    "NoPath",
    "Parker",
    "Plan",
    "Rows",
    "Scene",
    "Trajectory",
    "Vehicle",
    "__version__",
    "evaluate",
    "generate",
    "load_map",
    "load_scene",
]
