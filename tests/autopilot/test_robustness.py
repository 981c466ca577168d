"""Margins are where the loop really becomes unstable, and every loop has enough of them.

Verifies: `autopilot.loop_margins` against the eigenvalues of the closed sampled loop, with the gain just inside and
just outside the margin, and with samples of delay on either side of the delay margin. Tolerance: 2 % of the gain, from
4000 frequencies over five decades; one sample.
"""

import control
import numpy as np
import pytest

import subzero
from subzero import autopilot
from subzero.autopilot.stability_margins import sampled_loop


@pytest.fixture(scope="module")
def tuning():
    return autopilot.tune(subzero.Model.of(subzero.load_scenario("fig6")), speeds=(0.6, 1.0, 1.4))


@pytest.fixture(scope="module")
def estimates(tuning):
    return autopilot.estimates(tuning, 0.1)


def closed_radius(loop, factor):
    """Return the largest size of a pole of the loop closed with its gain times a factor."""
    closed = np.asarray(loop.A) - factor * np.asarray(loop.B) @ np.asarray(loop.C)
    return np.max(np.abs(np.linalg.eigvals(closed)[np.abs(np.linalg.eigvals(closed) - 1.0) > 1e-9]))


@pytest.mark.long
@pytest.mark.parametrize("name", ["speed", "heading", "pitch", "roll", "lqr"])
@pytest.mark.parametrize("wet_length", [0.0, 20.0])
def test_the_gain_margin_is_where_the_loop_becomes_unstable(tuning, estimates, name, wet_length):
    chosen = {"speed": 1.0, "wet_length": wet_length, "estimates": estimates if name == "lqr" else None}
    loop = sampled_loop(tuning, "heading" if name == "lqr" else name, **chosen)
    margin = autopilot.margins(loop).gain
    assert closed_radius(loop, 1.0) < 1.0
    assert closed_radius(loop, 0.98 * margin) < 1.0
    assert closed_radius(loop, 1.02 * margin) > 1.0


def test_the_delay_margin_is_where_the_loop_becomes_unstable(tuning):
    """Two samples more than fit into the margin of the heading make it unstable, two fewer do not."""
    loop = sampled_loop(tuning, "heading", speed=1.4)
    samples = autopilot.margins(loop).delay / 0.1
    for extra, stable in ((int(samples), True), (int(samples) + 1, False)):
        late = control.ss(control.tf([1.0], [1.0, *[0.0] * extra], 0.1))
        whole = loop * late
        assert (closed_radius(whole, 1.0) < 1.0) == stable


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.6, 1.0, 1.4])
def test_every_loop_has_forty_degrees_and_a_factor_of_three(tuning, estimates, speed):
    for name in ("speed", "heading", "pitch", "roll", "lqr"):
        for wet_length in (0.0, 20.0):
            found = autopilot.loop_margins(
                tuning, "heading" if name == "lqr" else name, speed=speed, wet_length=wet_length,
                estimates=estimates if name == "lqr" else None,
            )  # fmt: skip
            assert found.gain > 3.0, name
            assert np.degrees(found.phase) > 40.0, name


def test_an_unknown_loop_is_told(tuning):
    with pytest.raises(subzero.UserError, match="Did you mean 'heading'"):
        autopilot.loop_margins(tuning, "headin", speed=1.0)
