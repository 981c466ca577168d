"""Simulators that threads step together do what each does alone.

Verifies: `subzero.simulation.stepper.SteppingGroup` against `Simulator.hold`, to the last bit, for fewer and more
threads than simulators, over resets and beyond the rows that fit at first; that a step which an interrupt breaks off is
finished before the next one. Tolerance: none.
"""

import threading

import numpy as np
import pytest

import subzero
from subzero.simulation import stepper
from subzero.simulation.stepper import SteppingGroup

COUNT = 5
TURNS = np.random.default_rng(3).uniform(-0.3, 0.3, (40, COUNT))


def orders(turns):
    """Return commands (COUNT, 4), each with its own rudder."""
    return np.column_stack([np.full(COUNT, 25.0), turns, np.zeros((COUNT, 2))])


def simulators():
    made = [subzero.Simulator("fig6", sample_time=1.0) for _ in range(COUNT)]
    for each in made:
        each.hold(25.0, 0.0, 0.0, 0.0)
    return made


def seen(simulators):
    return np.array([each.observation for each in simulators])


@pytest.mark.long
@pytest.mark.parametrize("threads", [1, 2, 9])
def test_threads_give_the_numbers_of_one_after_another(threads):
    alone, together = simulators(), simulators()
    group = SteppingGroup(together, threads)
    for k, turns in enumerate(TURNS):
        if k == 20:
            alone[2].reset(), together[2].reset()
        stopped, shown = group.hold(orders(turns))
        assert not stopped.any()
        for each, order in zip(alone, orders(turns).tolist(), strict=True):
            each.hold(*order)
        np.testing.assert_array_equal(seen(together), seen(alone))
        np.testing.assert_array_equal(shown, seen(alone))
    group.close()


@pytest.mark.long
def test_a_step_that_is_broken_off_is_finished_before_the_next(monkeypatch):
    alone, together = simulators(), simulators()
    group, share = SteppingGroup(together, 2), stepper.share

    def interrupted(*how):
        if threading.current_thread() is not threading.main_thread():
            return share(*how)
        monkeypatch.setattr(stepper, "share", share)
        raise KeyboardInterrupt

    group.hold(orders(TURNS[0]))
    monkeypatch.setattr(stepper, "share", interrupted)
    with pytest.raises(KeyboardInterrupt):
        group.hold(orders(TURNS[1]))
    group.hold(orders(TURNS[2]))
    group.close()
    for turns in TURNS[:3]:
        for each, order in zip(alone, orders(turns).tolist(), strict=True):
            each.hold(*order)
    np.testing.assert_array_equal(seen(together), seen(alone))
