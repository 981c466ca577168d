"""What a logger does to its columns: two of them exchanged, clocks that run fast, inputs in another unit.

Verifies: both are named, alone and beside a cause; a swap also where the noise of the channels is not declared and one
of them is in another unit as well; a clock of all channels that is fast against the inputs, to 3 standard deviations;
inputs with the other sign, one or two of them, in another unit, or in each other's columns.
Columns that are in their places and clocks that run right are not named.
Truth is exact: a heated rod, its middle and its end are first-order lags, one behind the other, and a fast clock reads
the exact solution at other times.
"""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm

import subzero.diagnosis as sd
from tests.marks import LONG

STEP = 0.1
NOISE = {"rod": 0.05, "middle": 0.03, "end": 0.02}


def rod(p, u, t):
    """Three first-order lags, exact for two powers that are held."""
    a, b, c = p["a"], 1.0 / 1.5, 1.0 / 2.0
    A = np.zeros((5, 5))
    A[0, [0, 3]], A[1, [0, 1, 4]], A[2, [1, 2]] = (-a, p["gain"]), (b, -b, 1.0), (c, -c)
    step, state, shown = expm(A * (t[1] - t[0])), np.zeros(3), []
    for powers in np.column_stack([u["power"], u["second"]]):
        shown.append(state)
        state = step[:3, :3] @ state + step[:3, 3:] @ powers
    return dict(zip(NOISE, np.array(shown).T, strict=True))


def model(*, noise=True):
    return sd.Model(
        rod,
        channels={name: sd.Sensor(noise=level if noise else None, unit="K") for name, level in NOISE.items()},
        inputs=["power", "second"],
        parameters=[sd.Number("a", 1.0, tolerance=0.02), sd.Number("gain", 1.0, tolerance=0.02)],
        causes=[
            sd.Cause("loss", "the rod loses heat", changes={"a": 0.3}),
            sd.Cause("heater", "the heater is weak", changes={"gain": 0.3}),
        ],
        unknown=[sd.Unknown("command:power", size=0.02, time=1.0)],
    )


def record(seed=0, *, late=(), fast=0.0, own=False, samples=300, levels=(0.0, 2.0), **numbers):
    """Return a record of a rod; the clocks of some channels are fast by a share, with times of their own or not."""
    rng = np.random.default_rng(seed)
    power, second = (
        np.repeat(rng.choice(each, samples // 20), 20) for each in ([-4.0, 0.0, 4.0, 8.0], levels)
    )
    time, parts = STEP * np.arange(samples), 10
    fine = STEP / parts * np.arange(samples * parts)
    shown = rod(
        {"a": 1.0, "gain": 1.0, **numbers},
        {"power": np.repeat(power, parts), "second": np.repeat(second, parts)},
        fine,
    )
    columns = {
        name: np.interp(time / (1.0 + fast) if name in late else time, fine, values)
        + NOISE[name] * rng.standard_normal(samples)
        for name, values in shown.items()
    }
    times = {name: time.copy() for name in late} if own else {}
    return sd.Record(time, {**columns, "power": power, "second": second}, times=times)


def swapped(given, a, b):
    columns = dict(given.columns)
    columns[a], columns[b] = columns[b], columns[a]
    return sd.Record(given.time, columns)


@pytest.mark.parametrize("noise", [True, LONG(False)])
def test_two_columns_that_are_exchanged_are_named(noise):
    verdict = sd.diagnose(swapped(record(), "rod", "middle"), model(noise=noise))
    assert verdict.verdict == "data_error"
    assert [each.id for each in verdict.named] == ["swapped:rod/middle"]
    assert verdict.named[0].sentence == "rod and middle have each other's readings"


@pytest.mark.long
def test_exchanged_columns_beside_a_cause():
    verdict = sd.diagnose(swapped(record(a=1.4), "middle", "end"), model())
    assert {each.id for each in verdict.named} == {"swapped:middle/end", "loss"}


@pytest.mark.long
def test_exchanged_columns_of_which_one_is_in_another_unit():
    given = record(1)
    columns = {**given.columns, "rod": given.columns["rod"] * 10.0}
    verdict = sd.diagnose(swapped(sd.Record(given.time, columns), "rod", "end"), model())
    assert {each.id for each in verdict.named} == {"swapped:rod/end", "unit:rod"}


@pytest.mark.long
def test_a_clock_of_all_channels_that_runs_fast_against_the_inputs():
    verdict = sd.diagnose(record(3, late=tuple(NOISE), fast=0.02), model())
    assert [each.id for each in verdict.named] == ["rate:clock"]
    (rate,) = verdict.named[0].estimates
    assert rate.value == pytest.approx(0.02 / 1.02, abs=3.0 * rate.sd)
    assert rate.sd < 0.001


@pytest.mark.parametrize("seed", [4, LONG(5)])
def test_columns_in_their_places_and_right_clocks_are_not_named(seed):
    verdict = sd.diagnose(record(seed, late=("middle",), own=True), model())
    assert verdict.verdict == "nothing_wrong"


@pytest.mark.long
@pytest.mark.parametrize("name, factor", [("power", -1.0), ("second", 1000.0), ("power", 1.0 / 60.0)])
@pytest.mark.parametrize("noise", [True, False])
def test_an_input_with_the_other_sign_or_in_another_unit(name, factor, noise):
    given = record(6)
    columns = {**given.columns, name: factor * given.columns[name]}
    verdict = sd.diagnose(sd.Record(given.time, columns), model(noise=noise))
    assert [each.id for each in verdict.named] == [f"input:{name}"]
    assert verdict.named[0].estimates[0].value == pytest.approx(factor)


def planes(p, u, t):
    """Return the exact solution of x' = s + s²/5 − x for the sum and the difference s of two inputs that are held."""
    keep, shown = np.exp(-(t[1] - t[0])), {"pitch": [], "roll": []}
    sides = {
        "pitch": p["gain"] * (u["port"] + u["starboard"]),
        "roll": p["gain"] * (u["port"] - u["starboard"]),
    }
    for name, values in shown.items():
        x = 0.0
        for s in sides[name]:
            values.append(x)
            x = (s + 0.2 * s**2) + (x - (s + 0.2 * s**2)) * keep
    return {name: np.array(values) for name, values in shown.items()}


@pytest.mark.long
def test_two_inputs_with_the_other_sign_of_which_one_alone_brings_nothing_nearer():
    rng = np.random.default_rng(8)
    port, starboard = (np.repeat(rng.choice([-1.0, 0.0, 1.5], 10), 20) for _ in range(2))
    time = STEP * np.arange(200)
    shown = planes({"gain": 1.0}, {"port": port, "starboard": starboard}, time)
    columns = {name: values + 0.02 * rng.standard_normal(200) for name, values in shown.items()}
    made = sd.Model(
        planes,
        channels={name: sd.Sensor(noise=0.02) for name in columns},
        inputs=["port", "starboard"],
        parameters=[sd.Number("gain", 1.0, tolerance=0.05)],
        causes=[sd.Cause("gain", "the gain is another", changes={"gain": 0.3})],
    )
    verdict = sd.diagnose(sd.Record(time, {**columns, "port": -port, "starboard": -starboard}), made)
    assert [each.id for each in verdict.named] == ["input:port/starboard"]
    assert verdict.named[0].sentence == "the inputs port and starboard have both the other sign"


@pytest.mark.long
def test_inputs_in_each_others_columns_beside_a_cause():
    verdict = sd.diagnose(swapped(record(7, a=1.4), "power", "second"), model())
    assert {each.id for each in verdict.named} == {"exchanged:power/second", "loss"}
    assert verdict.named[0].sentence == "the inputs power and second have each other's columns"


@pytest.mark.long
@pytest.mark.parametrize("held", [0.0, 2.0])
def test_an_input_that_never_moves_may_hold_the_column_of_one_that_does(held):
    verdict = sd.diagnose(swapped(record(7, levels=(held,)), "power", "second"), model())
    assert [each.id for each in verdict.named] == ["exchanged:power/second"]


@pytest.mark.long
def test_in_an_input_that_is_trusted_no_error_is_considered():
    given = record(6)
    columns = {**given.columns, "power": -given.columns["power"]}
    trusting = dataclasses.replace(model(), trusted_inputs=["power"])
    verdict = sd.diagnose(sd.Record(given.time, columns), trusting)
    assert not any("input:" in each or "exchanged:" in each for each in verdict.explanations)
    with pytest.raises(sd.ModelError, match="trusted_inputs names the input 'pwer', which is not there"):
        dataclasses.replace(model(), trusted_inputs=["pwer"])


@pytest.mark.long
def test_several_threads_change_nothing():
    made = swapped(record(gain=1.5), "rod", "middle")
    assert str(sd.diagnose(made, dataclasses.replace(model(), parallel=True))) == str(
        sd.diagnose(made, model())
    )


def test_an_error_of_another_channel_has_its_name_also_where_that_is_one_letter():
    from subzero.identification.explanation import Term

    there = Term("delay:a", "a is late or early against the inputs", "delay", "a").about("b")
    assert (there.id, there.sentence) == ("delay:b", "b is late or early against the inputs")
