"""Winches: the length or the tension at the drum is what was asked for, out and in again, and straight at any angle.

Verifies `cable.winch` with closed forms of a straight line: T(0) = T(S) + (½ρπdC_t u|u| + m u') S − w_c Δz.
"""

import numpy as np
import pytest

import cable

TABLE_1 = cable.CableProperties()
UMBILICAL = cable.CableProperties(mass_per_length=0.02)
PERIOD = 40.0


def to_and_fro(t):
    return (np.sin(2.0 * np.pi * t / PERIOD), 0.0, 0.0)


def test_a_winch_that_keeps_the_tension_keeps_it_while_paying_out_and_reeling_in():
    run = cable.pull_out(to_and_fro, PERIOD, drum=cable.ConstantTension(tension=0.6))
    assert run.outcome.completed, run.outcome.message
    np.testing.assert_allclose(run.drum_tension[1:], 0.6, rtol=1e-8)
    exact_length = PERIOD / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * run.time / PERIOD))
    # one micrometre is in the water from the start, and stays
    np.testing.assert_allclose(run.length, exact_length + 1e-6, atol=1e-7)


def test_the_tension_of_a_line_that_goes_out_and_comes_in_has_its_closed_form():
    """Second order: the error falls by four when the step is halved."""

    def error(step):
        run = cable.pull_out(
            to_and_fro,
            PERIOD,
            drum=cable.ConstantTension(tension=0.6),
            scheme=cable.MovingEnd(time_step=step),
        )
        w = 2.0 * np.pi / PERIOD
        u, acceleration = np.sin(w * run.time), w * np.cos(w * run.time)
        load = TABLE_1.tangential_drag * u * np.abs(u) + TABLE_1.mass_per_length * acceleration
        exact = 0.6 + load * run.length
        return np.abs(run.tow_tension - exact)[3:].max()

    errors = [error(step) for step in (0.4, 0.2, 0.1)]
    assert errors[-1] < 1e-4 * 0.6
    assert np.log2(errors[0] / errors[1]) > 1.8
    assert np.log2(errors[1] / errors[2]) > 1.8


def test_paying_out_and_reeling_in_again_returns_to_the_start():
    """Through a curve, with a winch that is always a fifth faster than the tow point: slack, and never a push."""
    run = cable.pull_out(
        lambda t: (np.sin(2 * np.pi * t / PERIOD), 0.3 * np.sin(4 * np.pi * t / PERIOD), 0.0),
        PERIOD,
        drum=cable.PayOutRate(rate=lambda t: 1.2 * np.sin(2 * np.pi * t / PERIOD)),
    )
    assert run.outcome.completed, run.outcome.message
    assert run.length[0] == pytest.approx(1e-6)
    assert run.length[-1] == pytest.approx(1e-6, abs=1e-9)
    assert run.length.max() == pytest.approx(1.2 * PERIOD / np.pi, rel=1e-6)
    assert len(run.shapes[-1]) == 2, "one segment is left"
    assert min(tension.min() for tension in run.tensions) >= 0.0


def test_a_brake_holds_the_length_and_takes_any_pull():
    """Straight out with a little to spare, then the winch stops and the vehicle circles on what it has."""

    def motion(t):
        angle = 0.2 * max(t - 10.0, 0.0)
        return (np.cos(angle), np.sin(angle), 0.0)

    run = cable.pull_out(motion, 30.0, drum=cable.PayOutRate(rate=lambda t: 1.05 if t < 20.0 else 0.0))
    assert run.outcome.completed, run.outcome.message
    after = run.time > 20.2
    assert np.ptp(run.length[after]) <= 1e-9
    assert (np.linalg.norm(run.tow_point, axis=1) <= run.length + 1e-6).all()


@pytest.mark.parametrize("down", [1.0, -1.0], ids=["down", "up"])
def test_an_umbilical_can_hang_straight_down_or_up(down):
    """No angle is singular: T(0) = T(S) + ½ρπdC_t U² S − w_c S when it hangs down from the drum, + w_c S upwards."""
    run = cable.pull_out(
        lambda t: (0.0, 0.0, 0.5 * down), 20.0, cable=UMBILICAL, drum=cable.ConstantTension(tension=5.0)
    )
    assert run.outcome.completed, run.outcome.message
    load = UMBILICAL.tangential_drag * 0.25 - down * UMBILICAL.weight_in_water
    np.testing.assert_allclose(run.tow_tension[1:], (5.0 + load * run.length)[1:], rtol=1e-8)
    assert down * run.tow_force[-1, 2] < 0.0, "the cable holds the vehicle back"


def test_a_current_across_a_hanging_umbilical_bends_it_downstream():
    run = cable.pull_out(
        lambda t: (0.0, 0.0, 0.5),
        40.0,
        cable=UMBILICAL,
        drum=cable.ConstantTension(tension=6.0),
        current=(0.0, 0.2, 0.0),
    )
    assert run.outcome.completed, run.outcome.message
    middle = run.shapes[-1][len(run.shapes[-1]) // 2]
    assert middle[1] > 0.1, "the current runs east"
    assert run.tow_force[-1, 1] > 0.0, "and takes the vehicle along"


def test_a_drum_cannot_pay_out_less_than_the_vehicle_takes():
    run = cable.pull_out(lambda t: (1.0, 0.0, 0.0), 5.0, drum=cable.PayOutRate(rate=0.8))
    assert not run.outcome.completed
    assert "too short beyond t = 0 s: the winch has paid out" in run.outcome.message


def test_a_winch_cannot_push_and_needs_numbers():
    with pytest.raises(ValueError, match=r"tension is -1\.0; it must be a finite number, more than 0"):
        cable.ConstantTension(tension=-1.0)
    with pytest.raises(ValueError, match="must be positive at all times; it falls to -1 N"):
        cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1.0, drum=cable.ConstantTension(tension=lambda t: -1.0))
    with pytest.raises(ValueError, match="rate is nan; it must be a finite number"):
        cable.PayOutRate(rate=float("nan"))
    with pytest.raises(ValueError, match="needs finite numbers"):
        cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1.0, drum=cable.PayOutRate(rate=lambda t: float("nan")))
    with pytest.raises(ValueError, match="does not know a winch"):
        cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1.0, drum=cable.Brake(), scheme="paper")
