"""The Gymnasium environment passes Gymnasium's own checker, and can be won.

Verifies: "subzero/TetheredHeading-v0" with `gymnasium.utils.env_checker.check_env`; signs of action and reward with a
proportional controller, which has to earn more than a fixed rudder; that a program that imports Gymnasium only can make
it. Tolerance: none; 2 degrees for the heading.
"""

import subprocess
import sys
import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import subzero.gym_environment
from subzero.simulation import stepper


@pytest.fixture
def env():
    made = gymnasium.make("subzero/TetheredHeading-v0")
    yield made
    made.close()


def test_gymnasiums_own_checker_finds_nothing(env):
    check_env(env.unwrapped)


@pytest.mark.parametrize("tethered", [True, False], ids=["tethered", "untethered"])
def test_it_is_drawn_from_above_and_gymnasiums_checker_finds_nothing(tethered):
    made = gymnasium.make("subzero/TetheredHeading-v0", render_mode="rgb_array", tethered=tethered)
    check_env(made.unwrapped)
    made.reset(seed=3)
    first = made.render()
    for _ in range(30):
        made.step(np.ones(1, dtype=np.float32))
    last = made.render()
    assert first.dtype == np.uint8
    assert first.shape == last.shape
    assert first.shape[2] == 3
    assert (first != last).any()
    made.close()


def episode(env, policy, turn=0.3):
    seen, info = env.reset(seed=3, options={"turn": turn})
    total, over = 0.0, False
    while not over:
        seen, reward, ended, cut, info = env.step(policy(seen))
        total += reward
        over = ended or cut
    return total, info


def proportional(seen):
    return np.array([np.clip(2.0 * seen[0] - 0.5 * seen[2], -1.0, 1.0)], dtype=np.float32)


def test_steering_towards_the_heading_wins(env):
    total, info = episode(env, proportional)
    idle, _ = episode(env, lambda _: np.zeros(1, dtype=np.float32))
    wrong, _ = episode(env, lambda seen: -proportional(seen))
    assert abs(info["wanted_heading"] - info["heading"]) < np.radians(2.0)
    assert info["time"] == pytest.approx(30.0)
    assert wrong < idle < total < 0.0


def test_the_same_seed_draws_the_same_heading(env):
    drawn = [env.reset(seed=seed)[1]["wanted_heading"] for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1] != drawn[2]


@pytest.mark.long
@pytest.mark.parametrize("workers", [1, 2])
def test_many_at_once_are_those_of_one_after_another_to_the_last_bit(monkeypatch, workers):
    """Episodes of five steps, so that environments begin again on the way."""
    monkeypatch.setattr(subzero.gym_environment, "STEPS", 5)
    name = subzero.gym_environment.ENVIRONMENT
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (13, 3, 1)).astype(np.float32)
    reported = {}
    for mode, how in (("sync", {}), (None, {"workers": workers})):
        made = gymnasium.make_vec(name, num_envs=3, vectorization_mode=mode, propeller_rps=30.0, **how)
        reported[mode] = [(*made.reset(seed=7),), *(made.step(one) for one in actions)]
        made.close()
    assert isinstance(made.unwrapped, subzero.gym_environment.TetheredHeadings)
    assert any(one[3].all() for one in reported[None][1:])
    for mine, plain in zip(reported[None], reported["sync"], strict=True):
        for ours, theirs in zip(mine[:-1], plain[:-1], strict=True):
            assert ours.dtype == theirs.dtype
            np.testing.assert_array_equal(ours, theirs)
        assert mine[-1].keys() == plain[-1].keys()
        for key, ours in mine[-1].items():
            np.testing.assert_array_equal(ours, plain[-1][key])


@pytest.mark.long
@pytest.mark.parametrize("how, threads", [({}, 2), ({"sample_time": 1.0}, 2), ({"workers": 1}, 1)])
def test_each_processor_has_a_thread_if_nothing_else_is_asked_for(monkeypatch, how, threads):
    """On a machine of two processors."""
    used, meet, share = set(), threading.Barrier(threads), stepper.share

    def seen_to_share(*how):
        if threading.get_ident() not in used:
            used.add(threading.get_ident())
            meet.wait(timeout=60.0)  # until as many are here as there are threads
        return share(*how)

    monkeypatch.setattr(subzero.gym_environment.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(stepper, "share", seen_to_share)
    made = gymnasium.make_vec(subzero.gym_environment.ENVIRONMENT, num_envs=2, **how)
    made.reset(seed=1)
    made.step(np.zeros((2, 1), dtype=np.float32))
    made.close()
    assert len(used) == threads


def test_it_can_be_made_without_its_cable():
    env = gymnasium.make(subzero.gym_environment.ENVIRONMENT, tethered=False, sample_time=0.2)
    _, info = episode(env, proportional)
    assert info["time"] == pytest.approx(60.0)
    assert info["cable_length"] == 0.0


@pytest.mark.long
@pytest.mark.parametrize(
    "program",
    [
        "import gymnasium; env = gymnasium.make('subzero.gym_environment:subzero/TetheredHeading-v0')",
        "import gymnasium, subzero.gym_environment; env = gymnasium.make('subzero/TetheredHeading-v0')",
        "import subzero.gym_environment, gymnasium; env = gymnasium.make('subzero/TetheredHeading-v0')",
    ],
)
def test_a_program_of_its_own_can_make_it(program, tmp_path):
    """Elsewhere than in the checkout, with every warning an error."""
    code = f"{program}; env.reset(seed=1); print(env.step(env.action_space.sample())[4]['time'])"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.strip() == "0.1"
