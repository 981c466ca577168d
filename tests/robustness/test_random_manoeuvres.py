"""Random manoeuvres: whatever vehicle, winch and water do, a run ends converged or with a named, located reason.

Verifies: speeds of −1 … 3 m/s, turns of up to 60°/s, steep dives, stop-and-go; uniform and sheared currents; cables
lighter and heavier than water, with stretch; free drums with inertia and friction, brakes, winches for a rate or for a
tension; steps of 0.05 … 0.5 s, segments of 0.25 … 2 m. Hypothesis draws the cases, always the same ones.
Tolerance: at least 99 % of the cases converge; in none is there a number that is none, a cable that pushes, one that
ends elsewhere than at the tow point (1e-9 m), or one that is longer than its winch lets it be (1e-9 m).
"""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import cable

DURATION, KNOTS, FINE = 15.0, 7, 1501
CLOSED = 1e-9
"""How far the ends may be from where they should be: the length equations hold to a strain of 1e-12. [m]"""
FAST, ALL = 12, 600


def between(low, high):
    return st.floats(low, high, allow_nan=False)


@dataclass(frozen=True)
class Manoeuvre:
    """Speed [m/s], turning rate [rad/s] and pitch [rad] at `KNOTS` times, linear in between; `pause` stands still."""

    speed: tuple[float, ...]
    turn: tuple[float, ...]
    pitch: tuple[float, ...]
    pause: int

    def velocity(self) -> np.ndarray:
        """Return the velocity at `FINE` times (FINE, 3)."""
        knots, fine = np.linspace(0.0, DURATION, KNOTS), np.linspace(0.0, DURATION, FINE)
        speed = np.array(self.speed)
        speed[self.pause : self.pause + 2] = 0.0
        U, pitch = np.interp(fine, knots, speed), np.interp(fine, knots, self.pitch)
        rate = np.interp(fine, knots, self.turn)
        heading = np.concatenate([[0.0], np.cumsum(rate[:-1]) * (fine[1] - fine[0])])
        c = U * np.cos(pitch)
        return np.stack([c * np.cos(heading), c * np.sin(heading), -U * np.sin(pitch)], axis=1)


def row(low, high):
    return st.tuples(*[between(low, high)] * KNOTS)


manoeuvres = st.builds(
    Manoeuvre,
    speed=row(-1.0, 3.0),
    turn=row(*np.radians([-60.0, 60.0])),
    pitch=row(*np.radians([-70.0, 70.0])),
    pause=st.integers(0, 3 * KNOTS),
)
"""A pause beyond the last knot is none."""

cables = st.builds(
    cable.CableProperties,
    mass_per_length=st.sampled_from([0.0049, 0.0049, 0.0035, 0.0065, 0.02]),
    compliance=st.sampled_from([0.0, 0.0, 1e-3, 1e-2]),
)
waters = st.one_of(
    st.none(),
    st.tuples(between(-0.5, 0.5), between(-0.5, 0.5), between(-0.1, 0.1)),
    st.builds(
        lambda top, bottom: cable.Current.profile([-10.0, 10.0], [(*top, 0.0), (*bottom, 0.0)]),
        st.tuples(between(-0.5, 0.5), between(-0.5, 0.5)),
        st.tuples(between(-0.5, 0.5), between(-0.5, 0.5)),
    ),
)
drums = st.one_of(
    st.just(cable.DrumProperties()),
    st.builds(
        cable.DrumProperties,
        inertia=st.sampled_from([0.0, 1e-3]),
        friction_torque=st.sampled_from([0.0, 0.005, 0.05]),
    ),
    st.just(cable.Brake()),
    st.builds(cable.PayOutRate, rate=between(-0.5, 2.0)),
    st.builds(cable.ConstantTension, tension=between(0.05, 3.0)),
)


@dataclass(frozen=True)
class Case:
    """Everything that a run is made from."""

    manoeuvre: Manoeuvre
    cable: cable.CableProperties
    current: object
    drum: object
    wet_length: float
    step: float
    segment_length: float

    def run(self) -> cable.History:
        """Pull the cable out, on a leash where the winch does not follow."""
        velocity = self.manoeuvre.velocity()
        if isinstance(self.drum, cable.Brake | cable.PayOutRate):
            velocity = self.leashed(velocity)
        fine = np.linspace(0.0, DURATION, FINE)
        return cable.pull_out(
            lambda t: [float(np.interp(t, fine, velocity[:, i])) for i in range(3)],
            DURATION,
            cable=self.cable,
            current=self.current,
            start=self.wet_length,
            drum=self.drum,
            scheme=cable.MovingEnd(time_step=self.step, segment_length=self.segment_length),
        )

    def leashed(self, velocity: np.ndarray) -> np.ndarray:
        """Return velocities (FINE, 3) that keep the tow point within reach of the cable, 3 % inside from 1 s on.

        The first says which way the cable is laid at the start, and is nothing otherwise.
        """
        step = DURATION / (FINE - 1)
        fine = np.linspace(0.0, DURATION, FINE)
        rate = getattr(self.drum, "rate", 0.0)
        reach = (self.wet_length + np.minimum(rate, 0.95 * rate) * fine) * (
            1.0 - 0.03 * np.minimum(fine, 1.0)
        )
        out, place = np.zeros_like(velocity), self.wet_length * first(velocity)
        for k in range(FINE - 1):
            there = place + step * velocity[k]
            there *= min(1.0, reach[k + 1] / np.linalg.norm(there))
            out[k], place = (there - place) / step, there
        out[0] = 1e-6 * first(velocity)
        return out


def first(velocity):
    """Return the direction of the first motion, as `pull_out` lays the cable at the start."""
    speed = np.linalg.norm(velocity, axis=1)
    moving = np.flatnonzero(speed > 1e-9)
    return velocity[moving[0]] / speed[moving[0]] if moving.size else np.array([1.0, 0.0, 0.0])


cases = st.builds(
    Case,
    manoeuvre=manoeuvres,
    cable=cables,
    current=waters,
    drum=drums,
    wet_length=st.sampled_from([10.0, 20.0, 30.0]),
    step=st.sampled_from([0.05, 0.1, 0.25, 0.5]),
    segment_length=st.sampled_from([0.25, 0.5, 1.0, 2.0]),
)


def converged(case):
    """Run a case, check what must hold in any case, and say whether it reached its end."""
    run = case.run()
    assert np.isfinite(run.tow_force).all(), "a force that is no number"
    assert np.isfinite(run.length).all(), "a length that is no number"
    assert all(np.isfinite(shape).all() for shape in run.shapes), "a place that is no number"
    assert min(tension.min() for tension in run.tensions) >= 0.0, "a cable that pushes"
    assert run.closure_error.max() <= CLOSED, "a cable that does not end at the tow point"
    if isinstance(case.drum, cable.DrumProperties):
        assert (np.diff(run.length) >= -CLOSED).all(), "a free drum that takes cable up"
    if isinstance(case.drum, cable.Brake):
        np.testing.assert_allclose(run.length, case.wet_length, atol=CLOSED, rtol=0.0)
    if not run.outcome.completed:
        assert "could not be solved beyond t = " in run.outcome.message
        assert "at node " in run.outcome.message
    return run.outcome.completed


def share_converged(count):
    """Return how many of `count` cases converge."""
    outcomes = []

    @settings(
        max_examples=count,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(cases)
    def look(case):
        outcomes.append(converged(case))

    look()
    return np.mean(outcomes)


def test_random_manoeuvres_converge():
    assert share_converged(FAST) >= 0.99


@pytest.mark.slow
def test_many_random_manoeuvres_converge():
    assert share_converged(ALL) >= 0.99
