"""An angle that turns more than once: a turntable, ψ' = g u, whose compass shows 0 to 360°.

Verifies: readings are followed beyond half a turn, so that a gain within its tolerance, by which the table ends most of
a turn elsewhere, is no cause, and one beyond it is named with its size; a function that returns 0 to 360° itself is as
good as one that goes on counting, also between its samples; readings that jump by a turn are in degrees, whatever noise
they have. Truth is exact. Tolerance: 3 standard deviations.
"""

import numpy as np
import pytest

import subzero.diagnosis as sd

STEP, NOISE = 0.1, 1.0


def turntable(p, u, t):
    return {"heading": p["gain"] * STEP * (np.cumsum(u["rate"]) - u["rate"])}


def wrapped(p, u, t):
    return {"heading": turntable(p, u, t)["heading"] % 360.0}


def model(simulate=turntable, noise=NOISE):
    return sd.Model(
        simulate,
        channels={"heading": sd.Sensor(noise=noise, unit="deg", angle=True)},
        inputs=["rate"],
        parameters=[sd.Number("gain", 1.0, tolerance=0.1, low=0.0)],
        causes=[sd.Cause("drive", "the drive has another gain", changes={"gain": 1.5})],
    )


def record(gain, *, seed=0, between=0.0, samples=300):
    """Return a record, of which the compass may be read between the samples of the input. [s]"""
    rng = np.random.default_rng(seed)
    time, rate = STEP * np.arange(samples), np.repeat(rng.choice([20.0, 40.0, 60.0], samples // 20), 20)
    heading = turntable({"gain": gain}, {"rate": rate}, time)["heading"]
    own = time[:-1] + between
    seen = np.interp(own, time, heading) + NOISE * rng.standard_normal(own.size)
    return sd.Record(time, {"rate": rate, "heading": seen % 360.0}, {"heading": own})


@pytest.mark.parametrize("simulate", [turntable, wrapped])
@pytest.mark.parametrize("noise", [NOISE, None])
def test_a_gain_within_its_tolerance_is_no_cause_though_it_turns_elsewhere(simulate, noise):
    away = 0.2 * turntable({"gain": 1.0}, record(1.0).columns, None)["heading"][-1]
    assert away > 180.0
    verdict = sd.diagnose(record(1.2), model(simulate, noise))
    assert verdict.verdict == "nothing_wrong"


@pytest.mark.parametrize("gain", [3.0, 4.0])
def test_a_gain_beyond_its_tolerance_is_named_with_its_size(gain):
    verdict = sd.diagnose(record(gain), model())
    assert [each.id for each in verdict.named] == ["drive"]
    (found,) = verdict.named[0].estimates
    assert found.value == pytest.approx(gain, abs=3.0 * found.sd)


def test_a_function_that_returns_less_than_a_turn_is_read_between_its_samples():
    assert sd.diagnose(record(1.0, between=0.04), model(wrapped)).verdict == "nothing_wrong"


def test_readings_that_jump_by_a_turn_are_degrees():
    from subzero.identification.problem import Problem

    problem = Problem(model(noise=None), [record(1.0)])
    assert problem.may_read("heading", -1.0)
    assert not problem.may_read("heading", 0.1)
    assert not problem.may_read("heading", np.pi / 180.0)
