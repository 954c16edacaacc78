"""Plans into a bay, once from polygons and once from an occupancy grid.

    python examples/python/plan.py

Prints both plans, and draws the second in text. Needs nothing but n3p and numpy.
"""

import numpy as np

import n3p

# Metres and radians, counter-clockwise; a pose is that of the rear-axle centre.
START = (-9.0, 6.0, 0.0)
GOAL = (0.0, -1.4, np.pi / 2)
PARKED = [
    np.array([(-4.1, -2.6), (-1.6, -2.6), (-1.6, 2.4), (-4.1, 2.4)]),
    np.array([(1.6, -2.6), (4.1, -2.6), (4.1, 2.4), (1.6, 2.4)]),
]
KERB = np.array([(-15.0, 9.5), (15.0, 9.5)])


def tell(what, plan):
    print(f"{what}: {plan.length:.2f} m, {plan.direction_changes} direction changes ({plan.route})")
    for at in (0, len(plan) // 2, -1):
        x, y, heading = plan.poses[at]
        gear = "forward" if plan.gears[at] > 0 else "backward"
        print(
            f"  x {x:6.2f}  y {y:5.2f}  heading {heading:5.2f}  {gear}, steer {plan.steer[at]:5.2f}"
        )


def occupancy(resolution, origin, shape):
    """The same cars and kerb as the cells that they touch."""
    rows, columns = shape
    x = origin[0] + resolution * (np.arange(columns) + 0.5)
    y = origin[1] + resolution * (np.arange(rows) + 0.5)
    cells = np.zeros(shape, dtype=bool)
    for car in PARKED:
        (left, low), (right, top) = car.min(axis=0), car.max(axis=0)
        cells |= np.outer((low < y) & (y < top), (left < x) & (x < right))
    cells[np.abs(y - KERB[0, 1]) <= resolution / 2] = True
    return cells


def drawn(cells, plan, resolution, origin):
    """The grid as text, a row of it for two, the path over it."""
    text = np.where(cells, "#", " ")
    column = ((plan.poses[:, 0] - origin[0]) / resolution).astype(int)
    row = ((plan.poses[:, 1] - origin[1]) / resolution).astype(int)
    text[row, column] = np.where(plan.gears > 0, "f", "b")
    return "\n".join("".join(line) for line in text[::-2, ::1])


def main():
    parker = n3p.Parker()
    plan = parker.plan(START, GOAL, polygons=PARKED, polylines=[KERB])
    tell("among polygons", plan)
    driven = plan.trajectory(acceleration=0.8)
    print(f"  driven in {driven['time_s'][-1]:.1f} s, at up to {driven['speed_mps'].max():.1f} m/s")

    resolution, origin = 0.2, (-15.0, -4.0)
    cells = occupancy(resolution, origin, (70, 150))
    plan = parker.plan(START, GOAL, grid=(cells, resolution, origin))
    tell("among cells", plan)
    print(drawn(cells, plan, resolution, origin))

    try:
        parker.plan(START, (-2.8, 0.0, np.pi / 2), polygons=PARKED)
    except n3p.BadInput as error:
        print(f"where another car stands: {error}")


if __name__ == "__main__":
    main()
