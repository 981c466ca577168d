"""Effects are hidden in records of the other cable formulation; the diagnosis is asked for their names only.

Verifies: the whole diagnosis. Configuration: fig6, six channels at 10 Hz, coloured noise, outliers, gaps, and every
parameter drawn from its tolerance. Cases are drawn from a seed (benchmarks/diagnosis); chosen are those that the
trial can tell at all, D ≥ 25, whatever comes out: of each kind a few, and every id of the catalogue with both signs.
All of it is slow; what the default tests hide and find is in `test_verdicts` and `test_change_points`.
"""

import dataclasses
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2]))

import subzero
from benchmarks.diagnosis import draws, manoeuvres
from benchmarks.diagnosis.cases import Case, cases
from benchmarks.diagnosis.sharing import share
from benchmarks.diagnosis.trial_of import briefly, posed
from subzero.diagnosis import SPECS, catalogue

SEED = 7
CLEAR = 25.0
IDS = sorted(catalogue(manoeuvres.CHANNELS))


def drawn(kind, number, marks=(), **changes):
    """Return a case of a kind on fig6."""
    found = next(one for one in cases(SEED) if (one.kind, one.number) == (kind, number))
    return pytest.param(
        dataclasses.replace(found, manoeuvre="fig6", **changes), id=f"{kind}_{number}", marks=marks
    )


def slow(kind, *numbers):
    """Return more cases of a kind, for the long form."""
    return [drawn(kind, number, marks=pytest.mark.slow) for number in numbers]


JERKS_TAUT = pytest.mark.xfail(
    strict=True,
    reason="a drum of 3 to 5 kg more is caught up with by jerks of 100 N: the record has no one truth, for runs of the "
    "other formulation still change by 180 to 400 in squared noise levels where their steps are halved for the third "
    "time (those of the diagnosis change by 20)",
)
BEYOND = {("drum_inertia", 1): [JERKS_TAUT]}


def both_signs():
    """Return a case for every id and sign that its bounds have room for."""
    for name in IDS:
        for sign in (1, -1):
            if any(draws.room(parameter, sign) > 0.0 for parameter in manoeuvres.effects()[name].parameters):
                case = Case(seed=SEED, index=900 + IDS.index(name), kind="single", number=0, manoeuvre="rich",
                            causes=(name,), sign=sign)  # fmt: skip
                marks = BEYOND.get((name, sign), [])
                yield pytest.param(case, id=f"{name}_{'plus' if sign > 0 else 'minus'}", marks=marks)


@pytest.fixture(scope="module")
def reported(request):
    """Return the results of the cases that this session asks for, by two processes side by side."""
    here = [item for item in request.session.items if item.path == request.path]
    asked = {item.callspec.params["case"] for item in here if hasattr(item, "callspec")}
    if any(item.name == "test_hidden_effects_are_named" for item in here):
        asked |= {one.values[0] for one in (*SINGLES, *LONG)}
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), share, (1,)) as pool:
        yield {
            case: pool.submit(briefly, case)
            for case in sorted(asked, key=lambda one: (one.kind, one.number, one.index))
        }
        pool.shutdown(cancel_futures=True)


def names(result):
    return {cause["id"] for cause in result["causes"]}


def words(result):
    """Return truth and answer in a line, for the message of a failure."""
    first = [f"{name} {p:.2f}" for name, p in list(result["probabilities"].items())[:4]]
    truth = result["truth"] or result["strange"] or "nothing"
    return f"{truth}, D {result['D']}: {result['verdict']}, {', '.join(first)}"


SINGLES = slow("single", 18)
LONG = slow("single", 5, 9, 12)
MORE = slow("single", 8, 11, 13, 16, 20, 25)


@pytest.mark.parametrize("case", SINGLES + LONG + MORE)
def test_a_hidden_effect_gets_no_wrong_name(reported, case):
    """And what is true is never ruled out."""
    result = reported[case].result()
    assert min(result["D"].values()) >= CLEAR
    assert names(result) <= set(result["truth"]), words(result)
    assert result["probabilities"][case.causes[0]] > 0.01, words(result)


@pytest.mark.slow
def test_hidden_effects_are_named(reported):
    """All but one: tolerances that are wider than declared explain a record now and then, and that is said, too."""
    results = [reported[one.values[0]].result() for one in (*SINGLES, *LONG)]
    missed = [words(one) for one in results if names(one) != set(one["truth"])]
    assert len(missed) <= 1, missed


@pytest.mark.parametrize("case", slow("healthy", 0, 1, 2))
def test_a_healthy_record_gets_no_name(reported, case):
    result = reported[case].result()
    assert not names(result), words(result)


@pytest.mark.parametrize("case", slow("pair", 6))
def test_two_hidden_effects_are_named(reported, case):
    result = reported[case].result()
    assert min(result["D"].values()) >= CLEAR
    assert names(result) == set(result["truth"]), words(result)


@pytest.mark.parametrize("case", slow("sudden", 0, 4))
def test_what_begins_in_mid_trial_is_named_with_its_time(reported, case):
    result = reported[case].result()
    assert min(result["D"].values()) >= CLEAR
    (cause,) = result["causes"] or ({"id": words(result), "start": 0.0},)
    assert cause["id"] == case.causes[0]
    assert cause["start"] == pytest.approx(result["starts"][cause["id"]], abs=1.0), (
        "a second, for drawn sizes"
    )


@pytest.mark.parametrize("case", slow("outside", 0, 3))
def test_what_is_outside_the_catalogue_is_flagged(reported, case):
    result = reported[case].result()
    assert result["verdict"] == "outside_catalogue", words(result)


@pytest.mark.parametrize("case", slow("twin", 0))
def test_twins_are_told_as_a_set(reported, case):
    """No name, and the truth among those that are left."""
    result = reported[case].result()
    assert max(result["D"].values()) < 4.0
    assert not names(result), words(result)
    assert any(set(one.split(" + ")) & set(result["truth"]) for one in result["probabilities"]), words(result)


@pytest.mark.slow
@pytest.mark.parametrize("case", [drawn("healthy", 3, how="wide")])
def test_tolerances_declared_half_as_wide_make_no_false_name(reported, case):
    result = reported[case].result()
    assert not names(result), words(result)


@pytest.mark.slow
@pytest.mark.parametrize("case", list(both_signs()))
def test_every_effect_is_found_with_both_signs(reported, case):
    """On the rich manoeuvre: no wrong name, and the right one first where D says that it can be told."""
    result = reported[case].result()
    assert names(result) <= set(case.causes), words(result)
    if min(result["D"].values()) >= 16.0:
        assert next(iter(result["probabilities"])) == case.causes[0], words(result)


@pytest.mark.slow
def test_a_swell_has_its_history_beside_noise_of_its_own():
    """Beside the noise behind "nothing is wrong", which took most of it, three quarters of it were told, and the truth
    lay two bands off.
    """
    case = next(one for one in cases(75) if one.index == 149)
    made, *_ = posed(case)
    verdict = subzero.diagnose(made.logged, seed=case.index)
    reported, force = verdict.unknown, made.strange.force
    true = np.interp(reported.time, force.time, np.array(force.wrench)[:, 0])
    assert (verdict.verdict, reported.axis) == ("outside_catalogue", "X"), verdict
    assert np.sqrt(np.mean((reported.force - true) ** 2)) < 1.5 * np.sqrt(np.mean(reported.band**2))
    assert reported.force @ true == pytest.approx(true @ true, rel=0.15)
    speed, level = (
        verdict.gain.held_out["surge_speed"],
        verdict.misfit[made.logged.name]["surge_speed"].noise_sd,
    )
    assert speed.after < 0.9 * speed.before
    assert level < 1.4 * SPECS["surge_speed"].noise, "twice the sensor's, with the swell in it"
