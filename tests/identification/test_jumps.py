"""Readings that jump: a motor, whose current follows each step of the voltage at once.

Verifies: outliers at jumps, which no rule for readings alone can see, are set aside and invent no cause or error in the
data; a true delay, which also shows at jumps alone, is still named; a channel without a declared noise is named with
its wrong unit, whether its readings are then smaller or larger; revolutions per minute are told from ten times; stuck
readings are named by their equality. Truth is exact: the motor is linear of the first order. Tolerance: none, 3
standard deviations for numbers.
"""

import numpy as np
import pytest

import subzero.diagnosis as sd
from subzero.errors import UserError
from tests.marks import LONG

STEP, NOISE = 0.1, {"speed": 0.2, "current": 0.05}
RESISTANCE, TORQUE, FRICTION = 2.0, 0.5, 0.02


def motor(p, u, t):
    """J ω' = K i − b ω,  i = (V − K ω)/R: exact for a voltage that is held."""
    decay = (p["torque"] ** 2 / p["resistance"] + FRICTION) / p["inertia"]
    keep, speed, shown = np.exp(-decay * (t[1] - t[0])), np.zeros_like(p["inertia"]), []
    for volt in u["volt"]:
        shown.append((speed, (volt - p["torque"] * speed) / p["resistance"]))
        steady = p["torque"] / p["resistance"] * volt / (p["inertia"] * decay)
        speed = steady + (speed - steady) * keep
    speeds, currents = np.moveaxis(np.array(shown), 1, 0)
    return {"speed": speeds, "current": currents}


def model(noise=True):
    return sd.Model(
        motor,
        channels={
            "speed": sd.Sensor(noise=NOISE["speed"] if noise else None, unit="rad/s"),
            "current": sd.Sensor(noise=NOISE["current"] if noise else None, unit="A"),
        },
        inputs=["volt"],
        parameters=[
            sd.Number("resistance", RESISTANCE, tolerance=0.04),
            sd.Number("torque", TORQUE, tolerance=0.01),
            sd.Number("inertia", 0.05, tolerance=0.002),
        ],
        causes=[
            sd.Cause("resistance", "the winding has another resistance", changes={"resistance": 0.6}),
            sd.Cause("inertia", "the load has another inertia", changes={"inertia": 0.02}),
        ],
        unknown=[sd.Unknown("command:volt", size=0.02, time=1.0)],
        batch=True,
    )


def record(*, seed=0, outliers=0, samples=300, delay=0.0, **factors):
    """Return a record of the nominal motor, with outliers at the first samples behind jumps of the voltage."""
    rng = np.random.default_rng(seed)
    volt = np.repeat(rng.choice([-12.0, -6.0, 6.0, 12.0], samples // 20), 20)
    time = STEP * np.arange(samples)
    numbers = {"resistance": RESISTANCE, "torque": TORQUE, "inertia": np.full(1, 0.05)}
    shown = motor(numbers, {"volt": volt[:, None]}, time)
    columns = {}
    for name, values in shown.items():
        late = np.interp(time - delay, time, values[:, 0]) if name == "current" else values[:, 0]
        columns[name] = (late + NOISE[name] * rng.standard_normal(samples)) * factors.get(name, 1.0)
    jumps = np.flatnonzero(np.diff(volt)) + 1
    columns["current"][rng.choice(jumps, outliers, replace=False)] += 20.0 * NOISE["current"]
    return sd.Record(time, {**columns, "volt": volt})


@pytest.mark.parametrize("seed", [0, LONG(1), LONG(2), LONG(3)])
def test_outliers_at_jumps_are_no_delay(seed):
    verdict = sd.diagnose(record(seed=seed, outliers=2), model())
    assert verdict.verdict == "nothing_wrong"
    assert any(
        note.startswith("Readings that are set aside") and "current 2" in note for note in verdict.notes
    )


@pytest.mark.parametrize("seed", [0, LONG(1), LONG(2)])
@pytest.mark.parametrize("late", [0.04, LONG(0.7)])
def test_a_delay_that_shows_at_jumps_alone_is_named(late, seed):
    """Also one of whole samples, where the slope of an interpolated simulation has a corner."""
    (named,) = sd.diagnose(record(delay=late, seed=seed), model()).named
    (delay,) = named.estimates
    assert named.id == "delay:current"
    assert delay.value == pytest.approx(late, abs=3.0 * delay.sd)


@pytest.mark.parametrize("factor", [LONG(0.001), 0.1, LONG(30.0 / np.pi), LONG(1000.0)])
@pytest.mark.parametrize("noise", [True, LONG(False)])
def test_a_wrong_unit_is_named_whether_the_noise_is_declared_or_not(noise, factor):
    verdict = sd.diagnose(record(speed=factor), model(noise))
    (named,) = verdict.named
    assert named.id == "unit:speed"
    assert named.estimates[0].value == pytest.approx(factor)
    assert not any("speed" in note and "aside" in note for note in verdict.notes)


def test_stuck_readings_are_named_where_the_middle_one_is_right():
    """Of equal readings in a row only the middle one is used: here it agrees with the simulation."""
    made = record()
    columns = dict(made.columns)
    columns["speed"] = np.where(abs(np.arange(300) - 150) <= 40, columns["speed"][150], columns["speed"])
    (named,) = sd.diagnose(sd.Record(made.time, columns), model()).named
    assert named.id == "stuck:speed@0"


def compass(p, u, t):
    """The heading is the sum of commanded rates, and of a drift that is off by default. [deg]"""
    rates = u["rate"] + p["drift"]["rate"]
    return {"heading": p["start"] + np.cumsum(rates, axis=0) * (t[1] - t[0])}


@pytest.mark.parametrize("factor, drift", [(1.0, 5.0), (np.pi / 180.0, 0.0)])
def test_a_compass_without_a_declared_noise_is_not_multiplied_until_it_agrees(factor, drift):
    """A thousand times a heading, wrapped, is within the noise of any simulation, if the noise goes with the unit."""
    made = sd.Model(
        compass,
        channels={"heading": sd.Sensor(unit="deg", angle=True)},
        inputs=["rate"],
        parameters=[sd.Start("start", 0.0, tolerance=5.0)],
        causes=[sd.Cause("drift", "it turns", rate=sd.Number(0.0, scale=10.0), off={"rate": 0.0})],
        unknown=[sd.Unknown("command:rate", size=0.1, time=5.0)],
        batch=True,
    )
    rng, time = np.random.default_rng(1), 0.2 * np.arange(300)
    rate = np.repeat(rng.choice([-10.0, 0.0, 10.0], 15), 20)
    heading = compass({"start": 2.0, "drift": {"rate": drift}}, {"rate": rate}, time)["heading"]
    shown = factor * ((heading + 0.5 * rng.standard_normal(300)) % 360.0)
    (named,) = sd.diagnose(sd.Record(time, {"heading": shown, "rate": rate}), made).named
    assert named.id == ("drift" if drift else "unit:heading")
    assert named.estimates[0].value == pytest.approx(drift or factor, rel=0.02)


def test_a_search_is_ended_by_its_time_and_says_so():
    verdict = sd.diagnose(record(speed=30.0 / np.pi), model(), seconds=1e-6)
    assert not verdict.complete
    assert any("ended" in note for note in verdict.notes)
    with pytest.raises(UserError, match="seconds is 0"):
        sd.diagnose(record(), model(), seconds=0)


def test_a_channel_that_always_holds_its_readings_is_not_stuck():
    """Twelve equal readings in a row are no surprise where all readings come in twelves."""
    made = record()
    columns = dict(made.columns)
    columns["speed"] = np.repeat(columns["speed"][6::12], 12)
    assert sd.diagnose(sd.Record(made.time, columns), model()).verdict == "nothing_wrong"


def test_a_sensor_that_stands_still_for_most_of_a_record_shows_its_noise_where_it_moves():
    made = record(seed=5)
    speed = made.columns["speed"].copy()
    speed[120:] = speed[120]
    verdict = sd.diagnose(sd.Record(made.time, {**made.columns, "speed": speed}), model(noise=False))
    assert [each.id for each in verdict.named] == ["stuck:speed@0"]
