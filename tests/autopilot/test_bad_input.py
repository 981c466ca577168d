"""What a user gets wrong around an autopilot is told: what it is, where, and what is allowed.

Verifies: designs that are improper or unstable, an autopilot that is none, files with autopilots, sample times and
durations; what a run has by then is kept. Tolerance: none, messages.
"""

import control
import numpy as np
import pytest

import subzero
from subzero import autopilot
from subzero.autopilot import Wanted
from subzero.autopilot.robustness import check_stable
from subzero.cli import MISTAKE, main
from subzero.cli_autopilot import STOPPED

GOOD = """
class Mine:
    name = "mine"

    def __init__(self, sample_time):
        self.sample_time = sample_time

    def reset(self):
        pass

    def update(self, reading, wanted):
        return {answer}


def make(tuning, sample_time, cable):
    return Mine(sample_time)
"""


@pytest.fixture(scope="module")
def fig6():
    return subzero.load_scenario("fig6")


@pytest.fixture(scope="module")
def tuning(fig6):
    return autopilot.tune(subzero.Model.of(fig6))


def forward(_):
    return Wanted(1.0, 0.0)


def system(A=((-1.0,),), B=((1.0,),), D=((0.0,),), dt=0):
    return control.ss(A, B, [[1.0]], D, dt, states=["a"], name="sys")


@pytest.mark.parametrize(
    "part,words",
    [
        (control.tf([1.0], [1.0, 1.0]), "the model is a TransferFunction. Allowed: a continuous control.StateSpace"),
        (system(D=[[1.0]]), "'sys' feeds its input through: it is not strictly proper. Allowed"),
        (system(dt=0.1), "'sys' is sampled every 0.1 s. Allowed: a continuous"),
        (system(A=[[np.nan]]), "'sys' has a number that is not finite"),
        (system(B=[[1.0, 1.0]], D=[[0.0, 0.0]]), "'sys' has 2 inputs. Allowed: .* with one input"),
    ],
)  # fmt: skip
def test_a_model_that_the_recipe_does_not_hold_for_is_refused(part, words):
    with pytest.raises(subzero.UserError, match=words):
        autopilot.design_gains(part, tracked="a", largest={"a": 1.0, "integral": 1.0}, largest_command=1.0)


def test_gains_that_make_the_sampled_hull_unstable_are_refused(fig6):
    """A designer who asks for a heading within 0.01 degrees gets gains beyond what servo and sampling bear."""
    sharp = autopilot.with_weights("heading", largest={"yaw_rate": 1.0, "heading": 2e-4, "integral": 2e-4})
    wild = autopilot.tune(subzero.Model.of(fig6), weights=sharp)
    with pytest.raises(subzero.UserError, match=r"heading loop is unstable at .* m/s .* Allowed: a shorter"):
        autopilot.make("pid", fig6, tuning=wild)


def test_a_sample_time_that_the_gains_do_not_bear_is_refused_and_a_short_one_is_not(tuning):
    check_stable(tuning, 0.1)
    with pytest.raises(subzero.UserError, match=r"loop is unstable at .* with a sample time of 2 s"):
        check_stable(tuning, 2.0)


@pytest.mark.parametrize("sample_time", [0.0, -0.1, float("nan"), float("inf")])
def test_a_sample_time_of_nothing_is_refused(fig6, tuning, sample_time):
    with pytest.raises(subzero.UserError, match="Allowed: a time above 0 s"):
        autopilot.make("pid", fig6, tuning=tuning, sample_time=sample_time)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf")])
def test_a_duration_of_nothing_is_refused(fig6, tuning, duration):
    with pytest.raises(subzero.UserError, match="Allowed: a time above 0 s"):
        autopilot.fly(fig6, autopilot.make("pid", fig6, tuning=tuning), forward, duration=duration)


def test_what_is_no_autopilot_is_told_what_it_lacks(fig6):
    with pytest.raises(subzero.UserError, match="object has no name, sample_time, reset, update"):
        autopilot.fly(fig6, object(), forward)


def test_a_goal_that_is_no_number_ends_the_run_and_is_told(fig6, tuning):
    pilot = autopilot.make("pid", fig6, tuning=tuning)
    run = autopilot.fly(
        fig6, pilot, lambda t: Wanted(1.0 if t < 1.0 else float("nan"), 0.0), tethered=False, duration=5.0
    )
    assert run.attrs["outcome"] == "stopped"
    assert "a speed that is not a number" in run.attrs["outcome_message"]
    assert float(run["time"][-1]) == pytest.approx(1.0)


def test_loops_that_there_are_not_and_weights_that_are_none_are_refused(fig6):
    model = subzero.Model.of(fig6)
    with pytest.raises(subzero.UserError, match=r"no loop 'headin'\. Did you mean 'heading'"):
        autopilot.tune(model, weights={"headin": autopilot.WEIGHTS["heading"]})
    with pytest.raises(subzero.UserError, match="Allowed: those of `with_weights`"):
        autopilot.tune(model, weights={"heading": {"heading": 0.1}})
    with pytest.raises(subzero.UserError, match="Allowed: those of `with_weights`"):
        autopilot.tune(model, weights={"heading": autopilot.WEIGHTS["pitch"]})


def test_a_speed_of_the_schedule_that_the_hull_cannot_reach_is_told(fig6):
    with pytest.raises(autopilot.NoTrimError, match="propeller would need"):
        autopilot.tune(subzero.Model.of(fig6), speeds=(1.0, 9.0))


def written(folder, text):
    path = folder / "mine.py"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_an_autopilot_from_a_file_flies(fig6, tuning, tmp_path):
    path = written(tmp_path, GOOD.format(answer="(25.0, 0.0, 0.0, 0.0)"))
    pilot = autopilot.make(path, fig6, tuning=tuning, sample_time=0.2)
    run = autopilot.fly(fig6, pilot, forward, tethered=False, duration=2.0)
    assert pilot.sample_time == 0.2
    assert run.attrs["outcome"] == "completed"
    assert np.all(run["propeller_command"] == 25.0)


@pytest.mark.parametrize(
    "text,words",
    [
        (None, "no autopilot file"),
        ("a = 1\n", "has no function 'make'. Allowed: def make"),
        ("make = 3\n", "has no function 'make'"),
        ("def make(:\n", "cannot be run: SyntaxError"),
        ("raise ValueError('no gains')\n", "cannot be run: ValueError: no gains"),
    ],
)
def test_a_file_without_an_autopilot_is_told(fig6, tuning, tmp_path, text, words):
    path = str(tmp_path / "none.py") if text is None else written(tmp_path, text)
    with pytest.raises(subzero.UserError, match=words):
        autopilot.make(path, fig6, tuning=tuning)


def test_the_command_line_flies_a_file_and_tells_of_its_nonsense(tmp_path, capsys, monkeypatch):
    """A file that answers NaN: exit code of a stopped run, the files of what there is, the reason."""
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, GOOD.format(answer="(25.0, float('nan') if reading.time > 20 else 0, 0, 0)"))
    assert main(["autopilot", "heading_step", "--autopilot", path]) == STOPPED
    assert "Autopilot 'mine': At t = 20.1 s the command is (25.0, nan, 0, 0)" in capsys.readouterr().err
    assert (tmp_path / "heading_step" / "tethered.nc").exists()
    assert main(["autopilot", "heading_step", "--autopilot", "missing.py", "--out", "none"]) == MISTAKE
    assert "There is no autopilot file 'missing.py'" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_a_sample_time_that_is_no_number_of_cable_steps_is_refused_by_the_flight(fig6, tuning):
    odd = autopilot.make("pid", fig6, tuning=tuning, sample_time=0.15)
    with pytest.raises(
        subzero.UserError, match=r"sample time of 0.15 s does not fit. Allowed: a whole number"
    ):
        autopilot.fly(fig6, odd, forward)
