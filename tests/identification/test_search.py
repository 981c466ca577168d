"""Where a search begins: what the linear problem at the nominal model does not show.

Verifies: a limit that does nothing near its nominal value is found; so is a step of a sensor that all other numbers can
nearly make up for, or that is large; and the other sign of readings. Truth is the model with other numbers. Tolerance:
3 standard deviations of the verdict.
"""

import dataclasses

import numpy as np
import pytest

import subzero.diagnosis as sd
from tests.identification.oscillator import model, record
from tests.marks import LONG


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_a_limit_that_does_nothing_near_its_nominal_value_is_found(seed):
    """An actuator whose rate is limited far below what is asked of it: near no limit, nothing changes at all."""

    def limited(p, u, t):
        rate, y, shown = 1.0 / max(p["inverse_rate"], 1e-6), 0.0, []
        for value in p["gain"] * u["u"]:
            y += np.clip(value - y, -0.1 * rate, 0.1 * rate)
            shown.append(y)
        return {"y": np.array(shown)}

    model = sd.Model(
        limited,
        {"y": sd.Sensor(noise=0.05, resolution=0.0)},
        inputs=["u"],
        parameters=[
            sd.Number("inverse_rate", 0.0, tolerance=0.01, low=0.0),
            sd.Number("gain", 1.0, tolerance=0.02),
        ],
        causes=[
            sd.Cause("slow", "the actuator is slow", changes={"inverse_rate": 1.0}),
            sd.Cause("gain", "the gain is another", changes={"gain": 0.2}),
        ],
    )
    time, rng = 0.1 * np.arange(300), np.random.default_rng(seed)
    u = {"u": np.sin(2.0 * np.pi * time / 4.0)}  # no faster than 1.6 a second
    y = limited({"inverse_rate": 2.0, "gain": 1.0}, u, time)["y"] + 0.05 * rng.standard_normal(300)
    (found,) = sd.diagnose(sd.Record(time, {"y": y, **u}), model).named
    assert found.id == "slow"
    (size,) = found.estimates
    assert abs(size.value - 2.0) < 3.0 * size.sd


@pytest.mark.parametrize("seed", [0, 3])
def test_another_sign_is_named_though_the_nominal_model_is_nearer_to_the_wrong_readings(seed):
    """A weight that is not trimmed tilts a vehicle to one side of 0, the wrong readings to the other."""

    def tilt(p, u, t):
        keep, slow, shown = np.exp(-(t[1] - t[0]) / p["lag"]), np.exp(-t / 8.0), []
        by_plane = np.zeros_like(p["plane"])
        for command, rest in zip(u["plane"], slow, strict=True):
            shown.append(p["trim"] * (1.0 - rest) + by_plane)
            by_plane = p["plane"] * command + (by_plane - p["plane"] * command) * keep
        return {"tilt": np.array(shown)}

    model = sd.Model(
        tilt,
        {"tilt": sd.Sensor(noise=0.1, unit="deg")},
        inputs=["plane"],
        parameters=[
            sd.Number("trim", 0.0, tolerance=2.0),
            sd.Number("plane", 1.0, tolerance=0.05),
            sd.Number("lag", 1.0, tolerance=0.05),
        ],
        causes=[sd.Cause("plane", "the plane lifts otherwise", changes={"plane": 0.3})],
        batch=True,
    )
    rng, time = np.random.default_rng(seed), 0.2 * np.arange(150)
    u = {"plane": np.repeat(rng.choice([-0.5, 0.0, 0.5], 15), 10)}
    true = tilt(
        {name: np.array([size]) for name, size in (("trim", 3.0), ("plane", 1.0), ("lag", 1.0))}, u, time
    )
    y = -true["tilt"][:, 0] + 0.1 * rng.standard_normal(150)
    (found,) = sd.diagnose(sd.Record(time, {"tilt": y, **u}), model).named
    assert found.id == "unit:tilt"
    assert found.estimates[0].value == -1.0


def test_a_step_may_be_far_larger_than_what_a_zero_is_off_by():
    """41 readings of a sensor whose zero is set to a sixth of its noise; from 24 s on it shows 30 levels too little."""
    rng, time, noise = np.random.default_rng(2), 1.0 * np.arange(41), 0.3
    model = sd.Model(
        lambda p, u, t: {"y": p["size"] * np.sin(t / 4.0)},
        {"y": sd.Sensor(noise=noise, zero=0.05, unit="deg/s")},
        parameters=[sd.Number("size", 5.0, tolerance=0.2)],
        causes=[sd.Cause("size", "it moves more or less", changes={"size": 1.0})],
    )
    y = 5.0 * np.sin(time / 4.0) + noise * rng.standard_normal(41) - 9.0 * (time >= 24.0)
    (found,) = sd.diagnose(sd.Record(time, {"y": y}), model).named
    assert found.id == "offset:y@0"
    (size,) = found.estimates
    assert abs(size.value + 9.0) < 3.0 * size.sd


@pytest.mark.parametrize("at", [8.0, 15.0, 21.0])
def test_a_step_is_found_that_other_numbers_bend_to_suit(at):
    """A rate that is off makes up for most of a step: what is left is a saw tooth of a quarter of it."""
    time, rng = 0.1 * np.arange(300), np.random.default_rng(4)
    model = sd.Model(
        lambda p, u, t: {"y": p["rate"] * t + p["curve"] * t**2 / 30.0},
        {"y": sd.Sensor(noise=0.05, resolution=0.0)},
        parameters=[sd.Number("rate", 0.0, tolerance=0.05), sd.Number("curve", 0.0, tolerance=0.05)],
        causes=[sd.Cause("rate", "the rate is another", changes={"rate": 0.3})],
    )
    y = 0.03 * time + 0.25 * (time >= at) + 0.05 * rng.standard_normal(300)
    (found,) = sd.diagnose(sd.Record(time, {"y": y}), model).named
    assert found.id == "offset:y@0"
    (size,) = found.estimates
    assert abs(size.value - 0.25) < 3.0 * size.sd
    assert f"from {at:.0f}" in found.sentence or f"from {at - 0.1:.1f}" in found.sentence


@pytest.mark.parametrize("drag", [0.2, LONG(0.3)])
def test_no_model_is_asked_for_a_number_beyond_its_bounds(drag):
    """A drag that vanishes from some time on: a model that refuses less than none is not asked for it."""

    def slowed(p, u, t):
        drag = p["drag"] + p["less"]["drag"] * (t >= p["less"]["since"])
        if min(drag) < 0.0:
            raise ValueError(f"a drag of {min(drag)}")
        v, shown = 0.0, []
        for force, each in zip(u["force"], drag, strict=True):
            shown.append(v)
            v += 0.1 * (force - each * v)
        return {"v": np.array(shown)}

    model = sd.Model(
        slowed,
        {"v": sd.Sensor(noise=0.02, resolution=0.0)},
        inputs=["force"],
        parameters=[sd.Number("drag", 0.3, tolerance=0.05, low=0.0)],
        causes=[sd.Cause("less", "the drag is another", changes={"drag": 0.3}, onset=True)],
    )
    time, rng = 0.1 * np.arange(300), np.random.default_rng(2)
    force = {"force": np.sign(np.sin(2.0 * np.pi * time / 9.0))}
    true = {"drag": drag, "less": {"drag": -drag, "since": 12.0}}
    v = slowed(true, force, time)["v"] + 0.02 * rng.standard_normal(300)
    (found,) = sd.diagnose(sd.Record(time, {"v": v, **force}), model).named
    assert found.id == "less@"


@pytest.mark.long
@pytest.mark.parametrize("seed, size", [(0, 30.0), (1, 300.0)])
def test_a_channel_that_another_unit_makes_small_is_not_explained_by_that(seed, size):
    """A wander that has nothing to do with the model: divided by a hundred, with a drift, it is near anything."""
    given, rng = record(seed), np.random.default_rng(seed)
    wander = size * given.time / 30.0 + size / 2000.0 * np.cumsum(rng.standard_normal(given.time.size))
    x = wander + 0.05 * rng.standard_normal(given.time.size)
    verdict = sd.diagnose(
        sd.Record(given.time, {"x": x, "force": given.columns["force"]}), model(unknown=False)
    )
    assert verdict.verdict == "nothing_near"
    assert "x is not explained, however small another unit makes it" in verdict.nearness.reasons


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 2])
def test_nothing_else_is_named_beside_an_input_that_explains_a_channel_alone(seed):
    """A wander that has nothing to do with the model: with any force the model follows it, and what else it then needs
    is an artefact, however probable.
    """
    given = record(seed)
    free = dataclasses.replace(
        model(unknown=False), unknown=[sd.Unknown("command:force", size=0.5, time=0.5, usual=False)]
    )
    verdict = sd.diagnose(
        sd.Record(given.time, {"x": wander(seed, given.time), "force": given.columns["force"]}), free
    )
    assert [each.id for each in verdict.named] == ["unknown:command:force"]
    suspected = {each.id: each for each in verdict.suspected}
    assert suspected["stiffness"].probability > 0.99
    assert "the model explains less than half of a channel" in suspected["stiffness"].against[0]


@pytest.mark.long
def test_units_that_leave_nothing_of_a_record_are_not_named():
    """The wander of another seed is near where it is divided until it is noise, and the force is a thousandth."""
    given = record(4)
    free = dataclasses.replace(
        model(unknown=False), unknown=[sd.Unknown("command:force", size=0.5, time=0.5, usual=False)]
    )
    verdict = sd.diagnose(
        sd.Record(given.time, {"x": wander(4, given.time), "force": given.columns["force"]}), free
    )
    assert not verdict.causes
    assert not verdict.data_errors


def wander(seed, time):
    """Return a smooth motion of random waves, with the noise of the sensor."""
    rng = np.random.default_rng(seed)
    waves = zip(rng.normal(0.0, 0.5, 4), rng.uniform(0.3, 1.5, 4), rng.uniform(0.0, 6.0, 4), strict=True)
    x = sum(size * np.sin(rate * time + phase) for size, rate, phase in waves)
    return x - x[0] + 0.01 * rng.standard_normal(time.size)


@pytest.mark.long
def test_a_known_unit_is_named_beside_an_input_that_acts_all_the_time():
    """Of a channel that the input does not move: what explains the other one does not make this one small."""
    model = sd.Model(
        lambda p, u, t: {"a": p["gain"] * u["u"], "b": 0.1 * np.cumsum(u["push"])},
        {name: sd.Sensor(noise=0.05, resolution=0.0) for name in "ab"},
        inputs=["u"],
        parameters=[sd.Number("gain", 1.0, tolerance=0.02)],
        unknown=[sd.Unknown("push", size=0.5, time=2.0, usual=False)],
    )
    time, rng = 0.1 * np.arange(300), np.random.default_rng(5)
    u, push = np.sin(time), 0.5 + 0.3 * np.sin(0.5 * time)
    columns = {"a": 100.0 * (u + 0.05 * rng.standard_normal(300)), "u": u}
    columns["b"] = 0.1 * np.cumsum(push) + 0.05 * rng.standard_normal(300)
    verdict = sd.diagnose(sd.Record(time, columns), model)
    assert {each.id for each in verdict.named} == {"unit:a", "unknown:push"}


@pytest.mark.parametrize("known", [True, False])
def test_a_unit_is_named_only_if_the_factor_is_seen_or_another_channel_agrees(known):
    """A depth in feet that grows with a weight that is hardly known: another factor serves with another weight.
    A speed shows the weight, and so the factor.
    """
    model = sd.Model(
        lambda p, u, t: {"depth": 0.5 * p["weight"] * t**2, "speed": p["weight"] * t},
        {"depth": sd.Sensor(noise=0.05, unit="m"), "speed": sd.Sensor(noise=0.05, unit="m/s")},
        parameters=[sd.Number("weight", 0.02, tolerance=0.02)],
    )
    time, rng = 0.25 * np.arange(40), np.random.default_rng(3)
    columns = {"depth": (0.5 * 0.05 * time**2 + 0.05 * rng.standard_normal(40)) / 0.3048}
    if known:
        columns["speed"] = 0.05 * time + 0.05 * rng.standard_normal(40)
    verdict = sd.diagnose(sd.Record(time, columns), model)
    assert [each.id for each in verdict.named] == ["unit:depth"] * known


def test_no_channel_bears_witness_to_a_unit_where_their_clock_was_moved_to_suit_the_model():
    from subzero.identification.candidates import declared
    from subzero.identification.fit import fit, starting_point
    from subzero.identification.nearness import witnesses
    from subzero.identification.problem import Problem

    time, rng = 0.1 * np.arange(200), np.random.default_rng(0)
    model = sd.Model(
        lambda p, u, t: {name: p["gain"] * np.sin(t + shift) for shift, name in enumerate("abc")},
        {name: sd.Sensor(noise=0.05, unit="m") for name in "abc"},
        parameters=[sd.Number("gain", 1.0, tolerance=0.02)],
    )
    true = model.simulate({"gain": 1.0}, {}, time)
    columns = {
        name: x / (0.3048 if name == "a" else 1.0) + 0.05 * rng.standard_normal(200)
        for name, x in true.items()
    }
    problem = Problem(model, [sd.Record(time, columns)])
    unit, clock = (
        next(each for each in declared(problem) if each.id == id and (each.factor > 3.0) == (id == "unit:a"))
        for id in ("unit:a", "delay:clock")
    )
    found = [
        witnesses(problem, fit(problem, starting_point(problem, terms, {})))
        for terms in ((unit,), (clock, unit))
    ]
    assert found == [{"a", "b", "c"}, set()]
