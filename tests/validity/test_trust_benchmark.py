"""The judge of `benchmarks.trust`: same trials from same seeds, errors as it says, verdicts that follow from them."""

import contextlib

import numpy as np
import pytest

import subzero
from benchmarks import trust
from benchmarks.trust import Verdict, force_errors, interval, judge, refined, residual_of
from benchmarks.trust_trials import draw, tags_of


def test_a_trial_is_drawn_from_its_seed_alone():
    one, again, other = draw(7), draw(7), draw(8)
    np.testing.assert_array_equal(one.commands.values, again.commands.values)
    assert (one.cable, one.drum, one.start, one.winch) == (again.cable, again.drum, again.start, again.winch)
    assert one.cable != other.cable


def test_sixty_trials_hold_everything_that_can_go_wrong():
    tags = {tag for seed in range(60) for tag in tags_of(draw(seed))}
    assert tags >= {
        "free drum, light", "free drum, heavy", "winch, pay_out_rate", "winch, constant_tension", "winch, brake",
        "drum with inertia", "drum with friction", "still water", "uniform current", "sheared current", "vessel",
        "stretch", "reversal", "stop",
    }  # fmt: skip


def test_the_refinement_has_a_quarter_of_all_steps_and_segments():
    trial = draw(7)
    fine = refined(trial)
    for name in ("hull_step", "cable_step", "segment_length"):
        assert getattr(fine, name) == 0.25 * getattr(trial, name)


@pytest.fixture(scope="module")
def run():
    return subzero.simulate("fig6")


def test_the_error_of_a_force_is_its_largest_difference_as_a_share_of_the_largest_force(run):
    assert force_errors(run, run)[:2] == (0.0, 0.0)
    larger = run.assign(
        {f"cable_force_{axis}": 1.1 * run[f"cable_force_{axis}"] for axis in ("forward", "starboard", "down")}
    )
    error, smooth, largest = force_errors(larger, run)
    assert error == pytest.approx(0.1, rel=1e-9)
    assert smooth == pytest.approx(0.1, rel=0.02)
    assert largest == pytest.approx(float(run["cable_tension"].max()), rel=1e-9)


def test_a_jolt_of_one_sample_counts_but_not_in_the_error_without_jolts(run):
    force = run["cable_force_forward"].values.copy()
    force[100] *= 3.0
    error, smooth, largest = force_errors(run.assign(cable_force_forward=("time", force)), run)
    assert error == pytest.approx(2.0 * abs(force[99]) / largest, rel=0.02)
    assert smooth == 0.0


def test_the_residual_is_the_largest_of_the_run(run):
    work = run["energy_propeller_work"].values
    bump = np.where(np.arange(work.size) == 50, 0.06 * work[-1], 0.0)
    assert residual_of(run.assign(energy_residual=("time", bump))) == pytest.approx(0.06, rel=1e-6)


@pytest.mark.parametrize(
    "force_error, residual, warnings, verdicts",
    [
        (0.05, 0.0, (), ("wrong", "silent")),
        (0.005, 0.06, (), ("wrong", "silent")),
        (0.05, 0.0, ("above_surface",), ("wrong", "silent")),
        (0.05, 0.0, ("tow_force",), ("wrong",)),
        (0.005, 0.0, ("slack",), ("right", "false")),
        (0.005, 0.0, ("above_surface",), ("right",)),
        (0.02, 0.0, ("slack",), ()),
    ],
)
def test_verdicts_follow_from_errors_and_warnings(force_error, residual, warnings, verdicts):
    numbers = {"force_error": force_error, "residual": residual, "warnings": warnings, "check": 0.02}
    verdict = Verdict(seed=0, tags=(), outcome="completed", **numbers)
    for name in ("wrong", "silent", "right", "false"):
        assert getattr(verdict, name) is (name in verdicts), name
    assert not verdict.unsettled
    assert not verdict.unchecked  # half the steps change the force by 2 %: the check would have told


@pytest.mark.parametrize(
    "change, warnings, verdicts",
    [
        (np.nan, ("ill_posed_drum",), ("right", "false")),
        (0.005, ("ill_posed_drum",), ("right", "false")),
        (0.02, ("ill_posed_drum",), ("unsettled",)),
        (0.02, (), ("right",)),
    ],
)
def test_a_reference_that_moves_itself_calls_no_warning_false(change, warnings, verdicts):
    numbers = {"force_error": 0.005, "residual": 0.0, "warnings": warnings, "reference_change": change}
    verdict = Verdict(seed=0, tags=(), outcome="completed", **numbers)
    assert {name for name in ("wrong", "right", "false", "unsettled") if getattr(verdict, name)} == set(
        verdicts
    )


def test_none_of_so_many_is_no_more_than_chance_allows():
    """The rule of three, exactly: 1 − 0.025^(1/n)."""
    assert interval(0, 100) == f"0.0 %, 95 %: 0.0 to {100.0 * (1.0 - 0.025**0.01):.1f} %"
    assert interval(0, 0) == "of none"


def test_verdicts_are_kept_as_they_come_and_a_trial_that_is_kept_is_not_run_again(tmp_path, monkeypatch):
    ran = []

    def judged(seed):
        if seed == 12:
            raise KeyboardInterrupt
        ran.append(seed)
        return Verdict(
            seed=seed, tags=("vessel",), outcome="completed", force_error=0.1 * seed, warnings=("slack",)
        )

    monkeypatch.setattr(trust, "judge", judged)
    keep = tmp_path / "trials.jsonl"
    with pytest.raises(KeyboardInterrupt):
        trust.judged_all(range(10, 14), 1, keep)
    verdicts = trust.judged_all([9, 10, 11], 1, keep)
    assert ran == [10, 11, 9]
    assert [(one.seed, one.force_error, one.tags, one.wrong) for one in verdicts] == [
        (seed, 0.1 * seed, ("vessel",), True) for seed in (9, 10, 11)
    ]


def test_a_trial_that_takes_longer_than_the_patience_is_given_up_with_what_it_had_warned_of(monkeypatch):
    run = subzero.simulate(subzero.load_scenario("fig6"))

    def simulated(trial, progress):
        if trial.rtol == 0.0:  # the reference
            progress(0.5)
        return run

    monkeypatch.setattr(subzero, "simulate", simulated)
    assert judge(7, patience=0.0).outcome == trust.TOO_LONG
    monkeypatch.undo()
    assert judge(7, patience=0.0).outcome == "no run: too long"


@pytest.mark.parametrize(
    "after, fraction, ends",
    [(1.0, 0.01, False), (3.0, 0.14, True), (3.0, 0.16, False), (10.1, 0.99, True)],
    ids=["a slow start", "it would take 21 s", "it would take 19 s", "the patience is over"],
)
def test_a_reference_that_would_take_twice_its_patience_is_given_up_early(after, fraction, ends, monkeypatch):
    clock = [5.0]
    monkeypatch.setattr(trust, "process_time", lambda: clock[0])
    tell = trust.impatient(10.0, foresees=True)
    clock[0] += after
    with pytest.raises(trust.TooLongError) if ends else contextlib.nullcontext():
        tell(fraction)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed, halvings",
    [
        (400015, 1), (400022, 3), (400051, 1), (400082, 1), (400100, 3),
        (500247, 3), (500250, 0), (500316, 2), (500351, 0), (500394, 3),
    ],
    ids=str,
)  # fmt: skip
def test_a_right_trial_that_was_once_warned_of_is_not(seed, halvings):
    """A drum held by its friction, or not and still the same with finer segments; a cable that comes taut again and
    again, or is slack a little; a jolt at the start, of little energy.
    """
    verdict = judge(seed)
    assert verdict.right
    assert not verdict.false
    assert verdict.halvings == halvings


@pytest.mark.slow
def test_where_the_reference_moves_itself_the_warning_is_not_called_false():
    """A drum without friction: four times as many segments agree within 0.9 %, eight times as many do not."""
    verdict = judge(500209)
    assert verdict.numerical
    assert verdict.force_error < 0.01 < verdict.reference_change
    assert verdict.unsettled


@pytest.mark.slow
def test_of_thirty_trials_none_is_wrong_without_a_word():
    """References may take ten seconds each: some of the others take half an hour."""
    verdicts = [judge(seed, patience=10.0, second_patience=60.0) for seed in range(30)]
    assert sum(one.judged for one in verdicts) >= 15
    assert [one.seed for one in verdicts if one.silent] == []
