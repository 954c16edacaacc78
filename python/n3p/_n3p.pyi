from collections.abc import Iterable, Iterator, KeysView
from os import PathLike
from typing import Any, Literal, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from n3p.columns import Rows, Trajectory
from n3p.errors import N3PError

ParkingType = Literal["forward", "reverse", "parallel", "angled"]
Level = Literal["easy", "complex", "extreme"]
Effort = Literal["first", "usual", "most"]
StandstillSteering = Literal["anywhere", "at-changes", "never"]
Path = Union[str, PathLike[str]]
SceneLike = Union["Scene", dict[str, Any], Path]
VehicleLike = Union["Vehicle", dict[str, float]]
Grid = tuple[ArrayLike, float, ArrayLike]

__version__: str
METHODS: list[str]

class Vehicle:
    def __init__(
        self,
        *,
        length: float = 4.97,
        width: float = 1.86,
        wheelbase: float = 2.83,
        rear_overhang: float = 1.10,
        max_steer: float | None = None,
        forward_speed: float = 2.0,
        backward_speed: float = 1.0,
        steer_rate: float = 0.6,
    ) -> None: ...
    @property
    def length(self) -> float: ...
    @property
    def width(self) -> float: ...
    @property
    def wheelbase(self) -> float: ...
    @property
    def rear_overhang(self) -> float: ...
    @property
    def max_steer(self) -> float: ...
    @property
    def forward_speed(self) -> float: ...
    @property
    def backward_speed(self) -> float: ...
    @property
    def steer_rate(self) -> float: ...
    @property
    def turning_radius(self) -> float: ...
    def to_dict(self) -> dict[str, float]: ...

class Scene:
    def __init__(
        self,
        start: ArrayLike,
        goal: ArrayLike | None = None,
        *,
        polygons: Iterable[ArrayLike] | None = None,
        polylines: Iterable[ArrayLike] | None = None,
        points: ArrayLike | None = None,
        grid: Grid | None = None,
        bounds: ArrayLike | None = None,
        goals: ArrayLike | None = None,
        tolerance: tuple[float, float] | dict[str, float] | None = None,
        parking_type: ParkingType | None = None,
        low: dict[str, Any] | None = None,
        drivable_area: dict[str, Any] | None = None,
        contour: ArrayLike | None = None,
        margins: dict[str, float] | None = None,
        start_steer: float = 0.0,
        previous: Plan | dict[str, Any] | None = None,
        vehicle: VehicleLike | None = None,
        name: str = "",
    ) -> None: ...
    @staticmethod
    def from_dict(scene: dict[str, Any]) -> Scene: ...
    @staticmethod
    def from_json(text: str) -> Scene: ...
    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def level(self) -> Level | None: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def start(self) -> NDArray[np.float64]: ...
    @property
    def goal(self) -> NDArray[np.float64]: ...
    @property
    def goals(self) -> NDArray[np.float64]: ...
    @property
    def parking_type(self) -> ParkingType | None: ...
    @property
    def obstacles(self) -> list[NDArray[np.float64]]: ...
    @property
    def points(self) -> NDArray[np.float64]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def keys(self) -> KeysView[str]: ...
    def __getitem__(self, key: str) -> Any: ...
    def __contains__(self, key: object) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...

class Request(TypedDict, total=False):
    start: ArrayLike
    goal: ArrayLike
    polygons: Iterable[ArrayLike]
    polylines: Iterable[ArrayLike]
    points: ArrayLike
    grid: Grid
    bounds: ArrayLike
    goals: ArrayLike
    tolerance: tuple[float, float] | dict[str, float]
    parking_type: ParkingType
    low: dict[str, Any]
    drivable_area: dict[str, Any]
    contour: ArrayLike
    margins: dict[str, float]
    start_steer: float
    previous: Plan | dict[str, Any]

class Parker:
    def __init__(
        self,
        vehicle: VehicleLike | None = None,
        method: str = "n3p",
        models: Iterable[Path] | None = None,
        margin: float = 0.0,
        allow_contact: float = 0.0,
        effort: Effort = "usual",
        max_expansions: int = 200_000,
        standstill_steering: StandstillSteering = "anywhere",
        least_move: float | None = None,
        last_straight: float | None = None,
        cost: dict[str, float] | None = None,
    ) -> None: ...
    def plan(
        self,
        start: ArrayLike,
        goal: ArrayLike | None = None,
        *,
        polygons: Iterable[ArrayLike] | None = None,
        polylines: Iterable[ArrayLike] | None = None,
        points: ArrayLike | None = None,
        grid: Grid | None = None,
        bounds: ArrayLike | None = None,
        goals: ArrayLike | None = None,
        tolerance: tuple[float, float] | dict[str, float] | None = None,
        parking_type: ParkingType | None = None,
        low: dict[str, Any] | None = None,
        drivable_area: dict[str, Any] | None = None,
        contour: ArrayLike | None = None,
        margins: dict[str, float] | None = None,
        start_steer: float = 0.0,
        previous: Plan | dict[str, Any] | None = None,
    ) -> Plan: ...
    def plan_scene(self, scene: SceneLike) -> Plan: ...
    def plan_batch(self, requests: Iterable[SceneLike | Request]) -> list[Plan | N3PError]: ...
    def scene(self, start: ArrayLike, goal: ArrayLike | None = None, **arguments: Any) -> Scene: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def method(self) -> str: ...

class Plan:
    @property
    def poses(self) -> NDArray[np.float64]: ...
    @property
    def gears(self) -> NDArray[np.int8]: ...
    @property
    def steer(self) -> NDArray[np.float64]: ...
    @property
    def steer_from(self) -> NDArray[np.float64]: ...
    @property
    def steer_to(self) -> NDArray[np.float64]: ...
    @property
    def motions(self) -> NDArray[np.float64]: ...
    @property
    def segments(self) -> NDArray[np.float64]: ...
    @property
    def length(self) -> float: ...
    @property
    def direction_changes(self) -> int: ...
    @property
    def expansions(self) -> int: ...
    @property
    def route(self) -> str | None: ...
    @property
    def goal_index(self) -> int: ...
    @property
    def margin(self) -> float: ...
    @property
    def parking_type(self) -> ParkingType | None: ...
    @property
    def method(self) -> str: ...
    def trajectory(
        self,
        *,
        acceleration: float = 1.0,
        backward_acceleration: float | None = None,
        lateral_acceleration: float = 2.0,
        jerk: float = 2.0,
        steer_rate: float | None = None,
        stop_to_steer: bool = False,
    ) -> Trajectory: ...
    def to_json(self) -> str: ...
    def __len__(self) -> int: ...

Seen = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
Told = tuple[NDArray[np.float64], NDArray[np.int8], NDArray[np.bool_], NDArray[np.float32]]

class Environments:
    def __init__(
        self,
        count: int,
        *,
        course: str = "eval",
        type: str | Iterable[str] | None = None,
        level: str | Iterable[str] | None = None,
        scenes: Iterable[SceneLike] | None = None,
        vehicle: VehicleLike | None = None,
        horizon: int = 200,
        reward_scale: float = 0.1,
        autoreset: Literal["never", "next_step", "same_step"] = "never",
    ) -> None: ...
    def reset(self, seed: int | None = None, only: list[bool] | None = None) -> Seen: ...
    def step(self, actions: ArrayLike) -> tuple[Seen, Told, list[tuple[int, Seen]]]: ...

def load_map(
    path: Path,
    *,
    start: ArrayLike | None = None,
    goal: ArrayLike | None = None,
    goals: ArrayLike | None = None,
    vehicle: VehicleLike | None = None,
    unknown: Literal["free", "occupied"] = "free",
    heights: tuple[float, float] | None = None,
    borders: bool = False,
    metres: bool = False,
) -> Scene: ...
def load_scene(path: Path) -> Scene: ...
def generate(
    type: ParkingType,
    level: Level,
    count: int = 1,
    seed: int = 1,
    vehicle: VehicleLike | None = None,
    *,
    first: int = 0,
) -> list[Scene]: ...
def evaluate(
    scenes: Iterable[SceneLike],
    methods: Iterable[str] | None = None,
    *,
    models: Iterable[Path] | None = None,
    margin: float = 0.0,
    allow_contact: float = 0.0,
    effort: Effort = "usual",
    max_expansions: int = 200_000,
    standstill_steering: StandstillSteering = "anywhere",
    threads: int = 1,
) -> Rows: ...
