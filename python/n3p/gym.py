"""The parking environment for Gymnasium: ``n3p/Parking-v0``.

Importing this module registers it::

    import gymnasium
    import n3p.gym

    env = gymnasium.make("n3p/Parking-v0", course="simple")
    envs = gymnasium.make_vec("n3p/Parking-v0", num_envs=64, course="eval", type="reverse")

What a policy sees and does, and what it is rewarded for, is described in docs/policies.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError
from gymnasium.spaces import Box, Dict
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from n3p._n3p import Environments
from n3p.errors import BadInput

__all__ = ["ParkingEnv", "ParkingVectorEnv", "ENDS"]

ENDS = ("", "parked", "out_of_bounds", "out_of_time")
"""How an episode may have ended, "" where it goes on: the values of ``info["end"]``."""

_ENDS = np.array(ENDS)


def _observation_space() -> Dict:
    ones = np.ones(4, np.float32)
    # No problem of a course has start and goal so far apart, nor does an episode lead so far away.
    farthest = np.concatenate([[np.float32(1000.0)], ones])
    return Dict(
        lidar=Box(0.0, 10.0, (120,), np.float32),
        target=Box(np.concatenate([[np.float32(0.0)], -ones]), farthest, (5,), np.float32),
        mask=Box(0.0, 1.0, (42,), np.float32),
    )


def _action_space() -> Box:
    return Box(-1.0, 1.0, (2,), np.float32)


class _Parking:
    """What one car and many have in common: environments in Rust, which may be closed and seeded."""

    np_random: np.random.Generator

    def _set_up(self, count: int, render_mode: None, **settings: Any) -> None:
        if render_mode is not None:
            raise BadInput(f"render_mode: is {render_mode!r}; expected None")
        self._environments: Environments | None = Environments(count, **settings)
        self._seeded = False

    def _open(self) -> Environments:
        if self._environments is None:
            raise ClosedEnvironmentError("the environment was closed; make another one")
        return self._environments

    def _own_seed(self, seed: int | None) -> int | None:
        """What the environments begin anew with, once Gymnasium has heard `seed`; None to go on."""
        begins = seed is not None or not self._seeded
        self._seeded = True
        # Drawn, not taken as it is: scenes of small seeds are those that are evaluated.
        return int(self.np_random.integers(2**63)) if begins else None

    def _close(self) -> None:
        self._environments = None


class ParkingEnv(_Parking, gymnasium.Env):
    """One car that parks.

    Observations are a dict of float32 arrays: ``lidar`` (120,) metres, ``target`` (5,) metres and
    cosines and sines, ``mask`` (42,) shares of a full step that are free. Actions are float32 (2,):
    steer and speed, each from -1 to 1.

    An episode terminates where the car is parked or has left the region around start and goal, and
    is truncated after `horizon` steps. Once a free Reeds-Shepp curve leads to the goal, the curve
    drives: ``info["scripted"]`` says that the next action will not be asked for, and
    ``info["driven"]`` what was driven in its stead.

    Parameters
    ----------
    course : {"eval", "simple"}
        Scenes of the generator that evaluates, of other seeds; or bare spots beside a lane.
    type, level : str or list of str, optional
        Parking types ("forward", "reverse", "parallel") and levels ("easy", "complex", "extreme");
        all of them where left out.
    scenes : list of Scene, dict or path, optional
        Your own scenes instead of a course, one after the other.
    vehicle : Vehicle or dict, optional
        The car of the course.
    horizon : int
        Steps after which an episode is truncated.
    reward_scale : float
        Factor of every reward.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        course: str = "eval",
        type: str | Iterable[str] | None = None,
        level: str | Iterable[str] | None = None,
        *,
        scenes: Iterable[Any] | None = None,
        vehicle: Any = None,
        horizon: int = 200,
        reward_scale: float = 0.1,
        render_mode: None = None,
    ) -> None:
        self._set_up(
            1,
            render_mode,
            course=course,
            type=type,
            level=level,
            scenes=scenes,
            vehicle=vehicle,
            horizon=horizon,
            reward_scale=reward_scale,
        )
        self.observation_space = _observation_space()
        self.action_space = _action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins the next episode; with a seed, the first of that seed."""
        super().reset(seed=seed)
        observation = _single(self._open().reset(self._own_seed(seed)))
        return observation, {"mask": observation["mask"], "scripted": False}

    def step(
        self, action: ArrayLike
    ) -> tuple[dict[str, NDArray[Any]], float, bool, bool, dict[str, Any]]:
        """Drives one step of half a second."""
        seen, (rewards, ends, scripted, driven), _ = self._open().step(
            np.asarray(action)[np.newaxis]
        )
        observation, end = _single(seen), int(ends[0])
        info = {"mask": observation["mask"], "scripted": bool(scripted[0]), "driven": driven[0]}
        if end:
            info["end"] = ENDS[end]
            info["is_success"] = end == 1
        return observation, float(rewards[0]), end in (1, 2), end == 3, info

    def close(self) -> None:
        """Ends it: it can do nothing more."""
        self._close()


class ParkingVectorEnv(_Parking, VectorEnv):
    """Many cars that park, each in its own scene, stepped in Rust by all cores.

    As `ParkingEnv`, with a first dimension more everywhere: actions are (num_envs, 2). An episode
    that has ended makes place for the next one as ``autoreset_mode`` says: in the next step, whose
    action is ignored, or in the same one; then ``infos["final_obs"]`` holds what was seen last.

    Parameters
    ----------
    num_envs : int
        How many.
    autoreset_mode : gymnasium.vector.AutoresetMode
        NEXT_STEP or SAME_STEP.
    course, type, level, scenes, vehicle, horizon, reward_scale
        As in `ParkingEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        course: str = "eval",
        type: str | Iterable[str] | None = None,
        level: str | Iterable[str] | None = None,
        *,
        scenes: Iterable[Any] | None = None,
        vehicle: Any = None,
        horizon: int = 200,
        reward_scale: float = 0.1,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: None = None,
    ) -> None:
        if autoreset_mode not in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
            raise BadInput(
                f"autoreset_mode: is {autoreset_mode!r}; expected AutoresetMode.NEXT_STEP or SAME_STEP"
            )
        self._set_up(
            num_envs,
            render_mode,
            course=course,
            type=type,
            level=level,
            scenes=scenes,
            vehicle=vehicle,
            horizon=horizon,
            reward_scale=reward_scale,
            autoreset="same_step" if autoreset_mode is AutoresetMode.SAME_STEP else "next_step",
        )
        self.metadata = {"render_modes": [], "autoreset_mode": autoreset_mode}
        self.num_envs = num_envs
        self.single_observation_space = _observation_space()
        self.single_action_space = _action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._all = np.ones(num_envs, np.bool_)

    def _infos(self, **values: Any) -> dict[str, Any]:
        """Infos that every environment has."""
        return {**values, **{f"_{name}": self._all.copy() for name in values}}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins the next episodes; with a seed, the first ones of that seed.

        ``options={"reset_mask": mask}``, bool (num_envs,), begins only those that are True.
        """
        super().reset(seed=seed)
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            mask = np.asarray(mask, np.bool_).ravel().tolist()
        observation = _dict(self._open().reset(self._own_seed(seed), mask))
        return observation, self._infos(
            mask=observation["mask"], scripted=np.zeros(self.num_envs, np.bool_)
        )

    def step(
        self, actions: ArrayLike
    ) -> tuple[dict[str, NDArray[Any]], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Drives one step of half a second everywhere."""
        seen, (rewards, ends, scripted, driven), lasts = self._open().step(actions)
        observation = _dict(seen)
        infos = self._infos(
            mask=observation["mask"], scripted=scripted, driven=driven, end=_ENDS[ends]
        )
        ended = ends > 0
        infos["is_success"], infos["_is_success"] = ends == 1, ended
        if lasts:
            final = np.full(self.num_envs, None, dtype=object)
            for index, last in lasts:
                final[index] = _single(last)
            infos["final_obs"], infos["_final_obs"] = final, ended.copy()
        return observation, rewards, (ends == 1) | (ends == 2), ends == 3, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Ends all: they can do nothing more."""
        self._close()


def _dict(seen: tuple[NDArray[Any], ...]) -> dict[str, NDArray[Any]]:
    lidar, target, mask = seen
    return {"lidar": lidar, "target": target, "mask": mask}


def _single(seen: tuple[NDArray[Any], ...]) -> dict[str, NDArray[Any]]:
    return {name: values[0] for name, values in _dict(seen).items()}


if "n3p/Parking-v0" not in gymnasium.registry:
    gymnasium.register(
        id="n3p/Parking-v0",
        entry_point="n3p.gym:ParkingEnv",
        vector_entry_point="n3p.gym:ParkingVectorEnv",
    )
