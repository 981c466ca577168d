"""An input that is 0 in a healthy model, and acts as nobody knows: a term that competes with causes and data errors.

Verifies: a hidden force on one of two carts is named, on the right one, with its history, to 3 standard deviations at
95 % of the knots; beside a cause, and in the second of two records; a cause and an error in the data are named as what
they are; a healthy record names nothing. What noise takes is a closed form.
Truth is exact: steps of the linear equations with a force that is linear between its knots; the model integrates by
Runge-Kutta.
"""

import itertools
import json

import numpy as np
import pytest
from scipy.linalg import expm

import subzero.diagnosis as sd
from tests.marks import LONG

NOISE, STEP, SAMPLES = 0.01, 0.1, 300
PUSHES = ("left", "right")


def carts(p, u, t):
    """Two carts on springs, and a spring between them: Runge-Kutta, one set of parameters or many."""
    h, shown = t[1] - t[0], []

    def slope(state, forces):
        x, v = state[:2], state[2:]
        return np.concatenate([v, forces - p["k"] * x - p["c"] * v - p["s"] * (x - x[::-1])])

    drive = p["gain"] * u["drive"]
    pushes = np.array([u.get(name, 0.0) + 0.0 * drive for name in PUSHES])
    state = np.zeros((4, *pushes.shape[2:]))
    for i in range(len(t)):
        shown.append(state[:2])
        begin, end = (
            pushes[:, j] + np.array([drive[i], 0.0 * drive[i]]) for j in (i, min(i + 1, len(t) - 1))
        )
        a1 = slope(state, begin)
        a2 = slope(state + h / 2 * a1, (begin + end) / 2)
        a3 = slope(state + h / 2 * a2, (begin + end) / 2)
        a4 = slope(state + h * a3, end)
        state = state + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return dict(zip(("a", "b"), np.swapaxes(shown, 0, 1), strict=True))


def model(**more):
    given = {
        "channels": {name: sd.Sensor(noise=NOISE, unit="m") for name in "ab"},
        "inputs": ["drive"],
        "parameters": [
            sd.Number("k", 4.0, tolerance=0.04),
            sd.Number("c", 0.3, tolerance=0.01),
            sd.Number("s", 2.0, tolerance=0.02),
            sd.Number("gain", 1.0, tolerance=0.01),
        ],
        "causes": [
            sd.Cause("stiffness", "the springs have another stiffness", changes={"k": 0.8}),
            sd.Cause("damping", "the carts have another damping", changes={"c": 0.2}),
            sd.Cause("drive", "the drive has another gain", changes={"gain": 0.2}),
        ],
        "unknown": [
            sd.Unknown(
                name, size=0.3, time=2.0, usual=False, sentence=f"something pushes the {name} cart", unit="N"
            )
            for name in PUSHES
        ],
        "batch": True,
    }
    return sd.Model(carts, **{**given, **more})


def hidden(seed, size=0.3):
    """Return a force at knots every 2 s."""
    return size * np.random.default_rng([seed, 1]).standard_normal(16)


def record(seed, *, k=4.0, c=0.3, s=2.0, gain=1.0, **pushes):
    """Return a record of the carts, pushed by forces with some values at knots every 2 s."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(SAMPLES)
    drive = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // 10), 10)
    knots = np.linspace(time[0], time[-1], 16)
    forces = np.array([np.interp(time, knots, pushes.get(name, np.zeros(16))) for name in PUSHES])
    A = np.zeros((9, 9))  # carts, drive, pushes, and their slopes
    A[0, 2] = A[1, 3] = 1.0
    A[2, :6], A[3, :7] = [-k - s, s, -c, 0.0, gain, 1.0], [s, -k - s, 0.0, -c, 0.0, 0.0, 1.0]
    A[5, 7] = A[6, 8] = 1.0
    step, state, shown = expm(A * STEP), np.zeros(4), []
    slopes = np.diff(forces, append=forces[:, -1:]) / STEP
    for i in range(SAMPLES):
        shown.append(state[:2])
        state = (step @ np.concatenate([state, [drive[i]], forces[:, i], slopes[:, i]]))[:4]
    a, b = np.array(shown).T + NOISE * rng.standard_normal((2, SAMPLES))
    return sd.Record(time, {"a": a, "b": b, "drive": drive})


def changed(old, **columns):
    """Return a record with other columns."""
    return sd.Record(old.time, {**old.columns, **columns})


def away(history, true):
    """Return how far a history is from the true one at its knots where it acts, in its standard deviations (n,)."""
    sd = np.array(history.sd)
    true = np.interp(history.time, np.linspace(0.0, 29.9, true.size), true)
    return ((np.array(history.value) - true) / np.where(sd > 0.0, sd, np.inf))[sd > 0.0]


def ids(terms):
    """Return ids, whether inputs act throughout or for a time."""
    return [each.id.partition("@")[0] if each.history else each.id for each in terms]


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name, size", [("left", 0.3), ("right", 0.3), ("left", 0.05)])
def test_a_hidden_force_is_named_on_the_right_cart_with_its_history(seed, name, size):
    true = hidden(seed, size)
    verdict = sd.diagnose(record(seed, **{name: true}), model())
    assert verdict.verdict == "unknown_input"
    assert verdict.causes == verdict.data_errors == ()
    (found,) = verdict.unknown_inputs
    assert found.id.partition("@")[0] == f"unknown:{name}"  # throughout, or for most of the record
    assert found.sentence.endswith(f"something pushes the {name} cart")
    (history,) = found.history
    assert np.mean(np.abs(away(history, true)) < 3.0) >= 0.95
    assert found.gain.holds
    assert found.gain.what == "every second part of the record by a fit of the others"


@pytest.mark.long
def test_three_standard_deviations_hold_at_nineteen_of_twenty_knots():
    found = []
    for seed in range(10, 14):
        (named,) = sd.diagnose(record(seed, left=hidden(seed)), model()).named
        found.append(away(named.history[0], hidden(seed)))
    assert np.mean(np.abs(np.concatenate(found)) < 3.0) >= 0.95
    assert 0.6 < np.std(np.concatenate(found)) < 1.5


def test_an_input_that_does_not_act_changes_nothing_of_a_healthy_verdict():
    without = sd.diagnose(record(0), model(unknown=[])).explanations
    verdict = sd.diagnose(record(0), model())
    assert verdict.verdict == "nothing_wrong"
    assert verdict.named == verdict.suspected == ()
    assert verdict.explanations["nothing is wrong"] == pytest.approx(without["nothing is wrong"], abs=0.02)


@pytest.mark.parametrize(
    "numbers, cause", [LONG({"k": 4.6}, "stiffness"), ({"c": 0.5}, "damping"), LONG({"gain": 1.2}, "drive")]
)
def test_a_cause_is_named_as_the_cause(numbers, cause):
    verdict = sd.diagnose(record(0, **numbers), model())
    assert ids(verdict.named) == [cause]


def test_a_search_that_is_ended_before_all_was_tried_next_to_its_best_explanation_names_no_cause(monkeypatch):
    monkeypatch.setattr("subzero.identification.search.MOST_FITS", 2)
    verdict = sd.diagnose(record(0, k=4.6), model())
    assert not verdict.complete
    assert verdict.named == ()
    (stiffness,) = verdict.suspected
    assert stiffness.id == "stiffness"
    assert stiffness.against == ("the search was ended before all that is next to it was tried",)


@pytest.mark.parametrize("factor, named", [(1.0 / 0.3048, ["unit:b"]), LONG(-1.0, [])])
def test_a_search_that_is_ended_names_a_known_unit_and_no_sign(monkeypatch, factor, named):
    """A model that is wrong may go the other way, but does not measure in feet."""
    monkeypatch.setattr("subzero.identification.search.MOST_FITS", 2)
    given = record(0)
    verdict = sd.diagnose(changed(given, b=factor * given.columns["b"]), model())
    assert not verdict.complete
    assert ids(verdict.named) == named
    assert ids(verdict.named + verdict.suspected) == ["unit:b"]


@pytest.mark.long
def test_a_search_whose_time_is_over_before_that_names_no_cause(monkeypatch):
    """A clock that goes by one at each look; after some fits the time is over, and none is kept."""
    monkeypatch.setattr("subzero.identification.search.FOR_UNKNOWN", 0.0)
    monkeypatch.setattr("subzero.identification.search.process_time", map(float, itertools.count()).__next__)
    monkeypatch.setattr("subzero.identification.api.process_time", lambda: 0.0)
    verdict = sd.diagnose(record(4, k=4.6, left=hidden(4, 0.05)), model(), seconds=2.5)
    assert not verdict.complete
    assert verdict.named == ()
    (stiffness,) = verdict.suspected
    assert stiffness.id == "stiffness"
    assert stiffness.against == ("the search was ended before all that is next to it was tried",)


@pytest.mark.long
@pytest.mark.parametrize(
    "error, wrong",
    [
        ("offset:a", lambda a, b: {"a": a + 0.1}),
        ("drift:a", lambda a, b: {"a": a + 0.1 * np.linspace(-0.5, 0.5, SAMPLES)}),
        ("unit:b", lambda a, b: {"b": b / 0.3048}),
    ],
)
def test_an_error_in_the_data_is_no_force(error, wrong):
    seen = record(5)
    verdict = sd.diagnose(changed(seen, **wrong(seen.columns["a"], seen.columns["b"])), model())
    assert ids(verdict.named) == [error]


@pytest.mark.long
@pytest.mark.parametrize("late", [5, 33])
def test_two_channels_that_are_late_together_have_one_late_clock(late):
    """By 0.5 s, which is usual, and by 3.3 s, a whole period of the carts."""
    given = record(5)
    shown = {name: np.append(np.full(late, np.nan), given.columns[name][:-late]) for name in "ab"}
    (found,) = sd.diagnose(changed(given, **shown), model()).named
    assert found.id == "delay:clock"
    (delay,) = found.estimates
    assert delay.value == pytest.approx(STEP * late, abs=max(3.0 * delay.sd, 0.01))


@pytest.mark.long
def test_a_force_is_found_beside_a_cause_a_unit_and_another_force():
    seen = record(6, left=hidden(6))
    assert ids(sd.diagnose(record(4, k=4.6, left=hidden(4)), model()).named) == ["stiffness", "unknown:left"]
    verdict = sd.diagnose(changed(seen, b=seen.columns["b"] / 0.3048), model())
    assert ids(verdict.named) == ["unit:b", "unknown:left"]
    verdict = sd.diagnose(record(3, left=hidden(3), right=hidden(4)), model())
    assert ids(verdict.named) == ["unknown:left", "unknown:right"]


@pytest.mark.long
def test_a_force_so_large_that_the_readings_look_wrong_is_found():
    verdict = sd.diagnose(record(2, right=hidden(2, 3.0)), model())
    assert ids(verdict.named) == ["unknown:right"]
    assert verdict.nearness.near  # a force that is named may be large


@pytest.mark.long
def test_of_two_records_one_is_pushed():
    verdict = sd.diagnose([record(7, k=4.6), record(8, k=4.6, right=hidden(8))], model())
    assert ids(verdict.causes) == ["stiffness"]
    (found,) = verdict.unknown_inputs
    *quiet, pushed = found.history
    assert pushed.record == verdict.curves[-1].record
    far = np.abs(away(pushed, hidden(8))) > 3.0
    assert far.sum() <= 1  # of 16 knots: one is expected in every 23rd record
    assert all(np.abs(each.value).max() < 0.1 for each in quiet)


@pytest.mark.long
def test_a_force_is_named_where_another_record_is_held_out():
    verdict = sd.diagnose(record(4, left=hidden(4)), model(), held_out=record(9))
    assert ids(verdict.named) == ["unknown:left"]


@pytest.mark.long
def test_of_one_reading_and_two_like_forces_it_is_said_that_one_of_them_acts():
    def lag(p, u, t):
        return {"x": p["x0"] + (t[1] - t[0]) * np.cumsum(u["here"] + u["there"], axis=0)}

    rng = np.random.default_rng(0)
    time = STEP * np.arange(200)
    push = np.interp(time, 1.99 * np.array([0.0, 3.0, 4.0, 5.0, 10.0]), [0.0, 0.0, 1.0, 0.0, 0.0])  # at knots
    same = [sd.Unknown(name, size=0.5, time=2.0, usual=False) for name in ("here", "there")]
    model = sd.Model(
        lag,
        {"x": sd.Sensor(noise=NOISE, unit="m")},
        parameters=[sd.Start("x0", 0.0, tolerance=0.01)],
        unknown=same,
    )
    x = STEP * np.cumsum(push) + NOISE * rng.standard_normal(200)
    verdict = sd.diagnose(sd.Record(time, {"x": x}), model)
    assert verdict.verdict == "unknown_input"
    (found,) = verdict.named
    assert found.probability > 0.95
    sentences = [each.partition("something")[2] for each in found.sentence.split(", or ")]
    assert {each.split()[2] for each in sentences} == {"here", "there"}
    assert "that this or another unknown input acts" in str(verdict)
    places = [
        sum(p for name, p in verdict.explanations.items() if name.startswith(f"unknown:{place}"))
        for place in ("here", "there")
    ]
    assert max(places) < 0.7


@pytest.mark.long
def test_a_usual_input_is_none_that_is_named():
    usual = [sd.Unknown(name, size=0.01, time=2.0) for name in PUSHES]
    verdict = sd.diagnose(record(0, left=hidden(0)), model(unknown=usual))
    assert verdict.named == ()
    assert verdict.verdict == "nothing_near"


@pytest.mark.long
def test_the_history_is_in_text_json_and_picture():
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    verdict = sd.diagnose(record(0, left=hidden(0)), model())
    assert str(verdict).startswith("Something acts that no cause of the list explains.")
    assert "the record: largest at 15.95 s, -0.8" in str(verdict)
    (found,) = json.loads(verdict.to_json())["named"]
    (history,) = found["history"]
    assert history["unit"] == "N"
    assert len(history["time"]) == len(history["value"]) == len(history["sd"]) == 16
    figure = verdict.plot()
    assert len(figure.axes) == 6  # two channels and a history, two each
    plt.close(figure)


@pytest.mark.parametrize("acts", [(3,), (2, 3, 4)])
def test_the_best_span_of_a_push_is_that_of_the_highest_density(acts):
    """By brute force: the density of the record for every span of knots, with the covariance that this one gives it."""
    from scipy.stats import multivariate_normal

    from subzero.identification.candidates import best_span
    from subzero.identification.explanation import unknown_terms
    from subzero.identification.fit import linearised, usual_levels
    from subzero.identification.problem import Problem

    time = STEP * np.arange(61)
    knots, rng = np.arange(7.0), np.random.default_rng(3)
    heights = [{2: 2.0, 3: -1.5, 4: 2.0}[k] if len(acts) > 1 else 2.0 for k in acts]
    y = sum(h * np.interp(time, knots, np.eye(7)[k]) for k, h in zip(acts, heights, strict=True))
    y += 0.1 * rng.standard_normal(61)
    push = sd.Unknown("push", size=1.0, time=1.0, usual=False)
    model = sd.Model(
        lambda p, u, t: {"y": p["rate"] * t + u["push"]},
        {"y": sd.Sensor(noise=0.1, resolution=0.0, trusted=True)},
        parameters=[sd.Number("rate", 0.0, tolerance=0.05)],
        unknown=[push],
    )
    problem = Problem(model, [sd.Record(time, {"y": y})])
    (term,), usual = unknown_terms(model), usual_levels(problem, ())
    entries = problem.entries((term,))
    found = best_span(problem, linearised(problem, (term,), entries, np.zeros(8), usual), term)
    noise = usual.noise["y"]
    C = noise.white**2 * np.eye(61) + noise.slow**2 * np.exp(
        -np.abs(np.subtract.outer(time, time)) / noise.time
    )
    C += 0.05**2 * np.outer(time, time)
    spans, log, share = [], [], []
    for count in (6, 3, 1):
        knots = np.linspace(0.0, 6.0, count + 1)
        own = np.array([np.interp(time, knots, row) for row in np.eye(count + 1)])
        some = [(i, j) for i in range(count + 1) for j in range(i, count + 1)]
        spans += [(knots[i], knots[j], count) for i, j in some]
        log += [
            multivariate_normal.logpdf(y, np.zeros(61), C + own[i : j + 1].T @ own[i : j + 1])
            for i, j in some
        ]
        share += [1.0 / (3 * len(some))] * len(some)
    best = int(np.argmax(np.array(log) + np.log(share)))
    assert (found.begins, found.ends, found.intervals) == spans[best] == (acts[0], acts[-1], 6)
    odds = term.odds * np.sum(np.array(share) * np.exp(np.array(log) - log[best]))
    # Coarse knots are not all among the fine ones, from which their columns are made.
    assert found.odds == pytest.approx(odds, rel=0.02)
    assert found.sentence.startswith(f"from {acts[0] - 1} to {acts[-1] + 1} s, ")  # where it is not 0


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_push_of_some_seconds_is_named_with_its_time(seed):
    true = np.zeros(16)
    true[7] = 0.12
    verdict = sd.diagnose(record(seed, left=true), model())
    (found,) = verdict.named
    assert found.id == "unknown:left@0"
    assert found.sentence.endswith(" s, something pushes the left cart")
    (history,) = found.history
    assert 3 <= len(history.value) <= 5  # of 16 knots
    assert history.time[0] < 14.0 < history.time[-1]
    at = int(np.argmax(history.value))
    assert history.time[at] == pytest.approx(7 * 29.9 / 15)
    assert abs(history.value[at] - 0.12) < 3.0 * history.sd[at]
    assert history.value[0] == history.value[-1] == 0.0


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_a_push_in_one_of_two_records_is_said_of_that_one(seed):
    true = np.zeros(16)
    true[5:7] = 0.2
    records = [record(seed), record(seed + 10, right=true)]
    verdict = sd.diagnose(records, model())
    (found,) = verdict.named
    assert found.id == "unknown:right@1"
    (history,) = found.history
    assert history.record == verdict.curves[-1].record
    at = [int(np.argmin(np.abs(np.linspace(0.0, 29.9, 16) - time))) for time in history.time]
    assert {5, 6} <= set(at)
    assert np.abs(np.array(history.value) - true[at]).max() < 4.0 * max(history.sd)


@pytest.mark.parametrize("samples", [12, 40])
def test_a_force_that_is_slower_than_a_short_record_is_judged_all_the_same(samples):
    time = np.arange(samples) * 1.0
    y = 0.05 * np.random.default_rng(0).standard_normal(samples) + 3.0 * np.linspace(0.3, 1.0, samples)
    model = sd.Model(
        lambda p, u, t: {"y": u["push"] + 0.0 * t},
        {"y": sd.Sensor(noise=0.05, trusted=True)},
        unknown=[sd.Unknown("push", size=2.0, time=500.0, usual=False)],
    )
    (found,) = sd.diagnose(sd.Record(time, {"y": y}), model).named
    assert found.id == "unknown:push"
    assert (found.gain is None) == (samples == 12)  # too few are left to fit
    (history,) = found.history
    assert np.abs((np.array(history.value) - [0.9, 3.0]) / history.sd).max() < 3.0


def said(*explanations):
    """Return what is said of explanations with their probabilities, the rest to 1 unseen: term, p, alternatives.

    Terms are named by kind and target; a unit by its factor, too.
    """
    from types import SimpleNamespace

    from subzero.identification.explanation import Term
    from subzero.identification.named_terms import said_of

    def term(name):
        kind, target, *factor = name.split(":")
        id = f"{kind}:{target}"
        return Term(id, id, kind, target.partition("@")[0], factor=float(factor[0]) if factor else 1.0)

    ranked = [SimpleNamespace(terms=tuple(map(term, names))) for names, _ in explanations]
    found = said_of(ranked, np.array([p for _, p in explanations]))
    return [(each.term.id, each.probability, [term.id for term in each.alternatives]) for each in found]


def test_where_a_drift_or_a_force_explains_a_record_it_is_said_that_one_of_them_does():
    drift, push = ["drift:x"], ["unknown:push@0"]
    (found,) = said((drift, 0.6), (push, 0.35), ([], 0.03))
    # The 0.02 that remains is of what is not seen, and may be added to any of them.
    assert found == ("drift:x", pytest.approx(0.95 / 0.98), ["drift:x", "unknown:push@0"])
    (found,) = said((drift, 0.92), (push, 0.05), ([], 0.01))
    assert found == ("drift:x", pytest.approx(0.92 / 0.98), ["drift:x"])
    # Throughout or for a time, the same input acts.
    (found,) = said((push, 0.6), (["unknown:push"], 0.38))
    assert found == ("unknown:push@0", pytest.approx(1.0), ["unknown:push@0"])


def test_a_cause_that_begins_at_some_time_bears_out_that_cause_but_not_the_other_way_round():
    always, later = ["cause:drag"], ["cause:drag@12"]
    (found,) = said((always, 0.7), (later, 0.25), ([], 0.05))
    assert found == ("cause:drag", pytest.approx(0.95), ["cause:drag"])
    (found,) = said((later, 0.7), (always, 0.25), ([], 0.05))
    assert found == ("cause:drag@12", pytest.approx(0.7), ["cause:drag@12"])


def test_units_of_a_channel_that_are_not_distinguished_are_said_together():
    (found,) = said((["unit:depth:10.0"], 0.7), (["unit:depth:10.06"], 0.28), (["unit:depth:9.0"], 0.02))
    assert found == ("unit:depth", pytest.approx(0.98), ["unit:depth", "unit:depth"])
    (found,) = said((["unit:depth:10.0"], 0.95), (["unit:depth:10.06"], 0.05))
    assert found == ("unit:depth", pytest.approx(0.95), ["unit:depth"])


def test_of_two_things_that_change_each_has_its_own_probability():
    both, one = ["drift:x", "unknown:push"], ["drift:x"]
    assert said((both, 0.6), (one, 0.4)) == [
        ("drift:x", pytest.approx(1.0), ["drift:x"]),
        ("unknown:push", pytest.approx(0.6), ["unknown:push"]),
    ]
