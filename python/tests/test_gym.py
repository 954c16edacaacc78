"""The parking environment, alone and many at once."""

import warnings

import numpy as np
import pytest
from conftest import GOAL, POLYGONS, START

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.error import ClosedEnvironmentError  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

import n3p  # noqa: E402
from n3p.gym import ENDS, ParkingEnv, ParkingVectorEnv  # noqa: E402

ID = "n3p/Parking-v0"


def actions(seed, *shape):
    return np.random.default_rng(seed).uniform(-1, 1, (*shape, 2)).astype(np.float32)


def greedy(mask):
    """Full steps, as far as they are free, of the first entry that is freest."""
    entry = np.argmax(mask, axis=-1)
    steer = 1 - (entry % 21) / 10
    return np.stack([steer, np.where(entry < 21, 1.0, -1.0)], axis=-1).astype(np.float32)


@pytest.mark.parametrize("course", ["eval", "simple"])
def test_gymnasium_s_own_check_passes(course):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID, course=course).unwrapped)


def test_an_episode_is_what_its_seed_and_actions_make_it():
    def episode(env, seed):
        observation, info = env.reset(seed=seed)
        told = [observation["lidar"].copy()]
        for action in actions(seed, 60):
            observation, reward, terminated, truncated, info = env.step(action)
            assert env.observation_space.contains(observation)
            assert isinstance(reward, float) and np.array_equal(info["mask"], observation["mask"])
            told += [observation["target"], observation["mask"], reward]
            if terminated or truncated:
                assert info["end"] in ENDS[1:] and info["is_success"] == (info["end"] == "parked")
                break
        return np.concatenate([np.ravel(t) for t in told])

    env, other = gymnasium.make(ID), gymnasium.make(ID)
    for seed in range(8):
        np.testing.assert_array_equal(episode(env, seed), episode(other, seed))
    first, second = env.reset(seed=1)[0], env.reset()[0]
    assert not np.array_equal(first["lidar"], second["lidar"])
    np.testing.assert_array_equal(env.reset(seed=1)[0]["lidar"], first["lidar"])


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_many_are_each_as_they_are_alone(mode):
    count = 5
    envs = gymnasium.make_vec(ID, num_envs=count, autoreset_mode=mode)
    again = ParkingVectorEnv(count, autoreset_mode=mode)
    observation, infos = envs.reset(seed=4)
    assert envs.observation_space.contains(observation)
    again.reset(seed=4)
    ended_before = np.zeros(count, bool)
    episodes = 0
    for action in actions(4, 300, count):
        observation, rewards, terminated, truncated, infos = envs.step(action)
        same = again.step(action)
        np.testing.assert_array_equal(observation["mask"], same[0]["mask"])
        np.testing.assert_array_equal(rewards, same[1])
        assert envs.observation_space.contains(observation)
        assert rewards.dtype == np.float64 and terminated.dtype == truncated.dtype == np.bool_
        ended = terminated | truncated
        np.testing.assert_array_equal(infos["end"] != "", ended)
        np.testing.assert_array_equal(infos["_is_success"], ended)
        assert not infos["is_success"][~terminated].any()
        if mode is AutoresetMode.SAME_STEP:
            assert ("final_obs" in infos) == ended.any()
            for i in np.flatnonzero(ended):
                assert envs.single_observation_space.contains(infos["final_obs"][i])
        else:
            assert (rewards[ended_before] == 0).all() and not ended[ended_before].any()
        episodes += ended.sum()
        ended_before = ended
    assert episodes > 3


def test_a_curve_takes_over_and_parks():
    env = gymnasium.make(ID, scenes=[n3p.Scene(START, GOAL, polygons=POLYGONS)])
    env.reset(seed=0)
    action = np.array([0.0, 1.0], np.float32)
    scripted, total = False, 0.0
    for _ in range(50):
        _, reward, terminated, _, info = env.step(action)
        assert scripted or np.array_equal(info["driven"], action)
        scripted, total = info["scripted"], total + reward
        if terminated:
            break
    assert info["end"] == "parked" and total > 4.5


def test_steps_run_out():
    env = ParkingEnv(horizon=3)
    env.reset(seed=0)
    ends = [env.step(np.zeros(2, np.float32))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]
    with pytest.raises(n3p.N3PError, match="reset"):
        env.step(np.zeros(2, np.float32))


def test_types_levels_and_cars_are_heard():
    env = ParkingVectorEnv(9, "simple", "parallel", ["easy"], reward_scale=1.0)
    observation, _ = env.reset(seed=2)
    for action in actions(2, 20, 9):
        env.step(action)
    other = ParkingVectorEnv(9, "simple", "reverse", ["easy"]).reset(seed=2)[0]
    assert not np.array_equal(observation["lidar"], other["lidar"])
    small = n3p.Vehicle(length=4.0, width=1.7, wheelbase=2.5, rear_overhang=0.7)
    seen = ParkingEnv(vehicle=small).reset(seed=2)[0]
    assert not np.array_equal(seen["lidar"], ParkingEnv().reset(seed=2)[0]["lidar"])


def test_some_may_be_reset_alone():
    envs = ParkingVectorEnv(4)
    envs.reset(seed=1)
    before = envs.step(greedy(np.ones((4, 42))))[0]
    after = envs.reset(options={"reset_mask": np.array([True, False, False, True])})[0]
    same = [np.array_equal(before["lidar"][i], after["lidar"][i]) for i in range(4)]
    assert same == [False, True, True, False]
    with pytest.raises(n3p.BadInput, match="reset_mask"):
        envs.reset(options={"reset_mask": np.ones(3, bool)})


@pytest.mark.parametrize(
    "options",
    [
        {"course": "hard"},
        {"type": "sideways"},
        {"type": 3},
        {"type": []},
        {"level": "hard"},
        {"vehicle": 3},
        {"vehicle": n3p.Vehicle(length=30.0)},
        {"horizon": 0},
        {"horizon": -1},
        {"reward_scale": float("nan")},
        {"scenes": []},
        {"scenes": "reverse.json"},
        {"scenes": [None]},
        {"scenes": [n3p.Scene((0, 0, 0), (0, 0, 0), points=[(1, 0)])]},
        {"render_mode": "human"},
    ],
    ids=str,
)
def test_no_environment(options):
    with pytest.raises(n3p.BadInput):
        ParkingEnv(**options)
    with pytest.raises(n3p.BadInput):
        ParkingVectorEnv(2, **options)


@pytest.mark.parametrize("count", [0, -1, 10**9])
def test_no_number_of_environments(count):
    with pytest.raises(n3p.BadInput, match="num_envs"):
        ParkingVectorEnv(count)


@pytest.mark.parametrize(
    "wrong",
    [
        None,
        "left",
        3,
        [1, 2, 3],
        np.zeros((3, 2)),
        np.zeros(3),
        [np.nan, 0],
        [0, np.inf],
        ["a", "b"],
    ],
    ids=str,
)
def test_no_action(wrong):
    env = ParkingEnv()
    with pytest.raises(n3p.N3PError, match="reset"):
        env.step([0, 0])
    env.reset(seed=0)
    with pytest.raises(n3p.BadInput, match="actions"):
        env.step(wrong)
    env.step([0, 0])
    envs = ParkingVectorEnv(2)
    envs.reset(seed=0)
    with pytest.raises(n3p.BadInput, match="actions"):
        envs.step(wrong)


def test_closed_is_closed():
    for env in (ParkingEnv(), ParkingVectorEnv(2)):
        env.reset(seed=0)
        env.close()
        env.close()
        with pytest.raises(ClosedEnvironmentError):
            env.step(np.zeros((2, 2)))
        with pytest.raises(ClosedEnvironmentError):
            env.reset()
