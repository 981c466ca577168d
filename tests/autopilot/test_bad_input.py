"""What a user gets wrong around an autopilot is told: what it is, where, and what is allowed.

Verifies: designs that are improper or unstable, an autopilot that is none, files with autopilots, sample times;
what a run has by then is kept. Tolerance: none, messages.
"""

import re
from dataclasses import replace

import control
import numpy as np
import pytest

import subzero
from subzero import autopilot
from subzero.autopilot import Wanted
from subzero.autopilot.helm import FinHelm
from subzero.autopilot.manoeuvres import VerticalZigZag, ZigZag
from subzero.autopilot.stability_margins import check_stable
from subzero.cli.app import MISTAKE, main
from subzero.cli.autopilot import STOPPED

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


def test_what_is_no_autopilot_is_told_what_it_lacks(fig6):
    with pytest.raises(subzero.UserError, match="object has no name, sample_time, reset, update"):
        autopilot.fly(fig6, object(), forward)


def test_a_goal_that_is_no_number_ends_the_run_and_is_told(fig6, tuning):
    pilot = autopilot.make("pid", fig6, tuning=tuning)
    with pytest.warns(autopilot.AutopilotWarning, match="a speed that is not a number"):
        run = autopilot.fly(
            replace(fig6, duration=5.0),
            pilot,
            lambda t: Wanted(1.0 if t < 1.0 else float("nan"), 0.0),
            tethered=False,
        )
    assert run.attrs["outcome"] == "stopped"
    assert "a speed that is not a number" in run.attrs["outcome_message"]
    assert float(run["time"][-1]) == pytest.approx(1.0)


class Own:
    """An autopilot that gives what it is told to, and breaks after a second."""

    name, sample_time = "own", 0.1

    def __init__(self, broken):
        self.broken = broken

    def reset(self):
        pass

    def update(self, reading, wanted):
        return self.broken() if reading.time > 0.95 else (25.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "command",
    [
        None,
        (25.0, np.nan, 0.0, 0.0),
        (25.0, 0.0),
        (25.0, 0.0, 0.0, 0.0, 0.0),
        "full",
        25.0,
        (10**400, 0, 0, 0),
    ],
)
def test_a_flight_whose_autopilot_has_no_command_warns_and_is_not_completed(fig6, command):
    with pytest.warns(
        autopilot.AutopilotWarning, match=r"ended at t = 1 s\. Autopilot 'own': At t = 1 s the command is"
    ):
        run = autopilot.fly(replace(fig6, duration=3.0), Own(lambda: command), forward, tethered=False)
    assert run.attrs["outcome"] == "stopped"
    assert "four finite numbers" in run.attrs["outcome_message"]
    assert float(run["time"][-1]) == pytest.approx(1.0)


def test_an_autopilot_that_raises_is_told_with_its_time_and_its_own_error(fig6):
    with pytest.raises(
        autopilot.AutopilotError, match="'own' broke at t = 1 s: ZeroDivisionError: division"
    ) as caught:
        autopilot.fly(replace(fig6, duration=3.0), Own(lambda: 1 / 0), forward, tethered=False)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


@pytest.mark.parametrize("channel", ["surge_speed", "heading", "yaw_rate", "pitch", "roll", "depth"])
@pytest.mark.parametrize("kind", ["pid", "lqr"])
def test_a_channel_that_no_sensor_measures_is_no_full_rudder(fig6, tuning, kind, channel):
    """min(limit, max(-limit, nan)) is the limit: the flight went on in circles, completed."""
    sensors = [sensor for sensor in autopilot.PERFECT if sensor.channel != channel]
    pilot = autopilot.make(kind, fig6, tuning=tuning)
    with pytest.warns(autopilot.AutopilotWarning, match="no sensor measures|not a number"):
        run = autopilot.fly(
            replace(fig6, duration=2.0),
            pilot,
            lambda t: Wanted(1.0, 0.0, 1.0),
            sensors=sensors,
            tethered=False,
        )
    assert run.attrs["outcome"] == "stopped"


@pytest.mark.parametrize("ahead", ["formula", "model"])
def test_a_cable_that_nobody_measures_is_not_left_out_unseen(fig6, tuning, ahead):
    sensors = [sensor for sensor in autopilot.PERFECT if sensor.channel != "cable_length"]
    pilot = autopilot.make("pid", fig6, tuning=tuning, feed_forward=ahead)
    with pytest.warns(autopilot.AutopilotWarning, match="no sensor measures the cable's length"):
        autopilot.fly(replace(fig6, duration=2.0), pilot, forward, sensors=sensors)


@pytest.mark.parametrize("program, channel", [(ZigZag, "heading"), (VerticalZigZag, "pitch")])
def test_a_zigzag_that_does_not_see_its_angle_is_told(fig6, program, channel):
    sensors = [sensor for sensor in autopilot.PERFECT if sensor.channel != channel]
    pilot = program(helm=FinHelm((25.0, 0.0, 0.0, 0.0)), size=0.2)
    with pytest.warns(
        autopilot.AutopilotWarning, match=f"the {channel} is not a number: no sensor measures it"
    ):
        run = autopilot.fly(replace(fig6, duration=20.0), pilot, forward, sensors=sensors, tethered=False)
    assert float(run["time"][-1]) == pytest.approx(12.0)


class NoNumber:
    """What raises an error of its own when it is asked for its number."""

    def __float__(self):
        raise RuntimeError("no number")


@pytest.mark.parametrize(
    "goal",
    [None, (1.0,), ("fast", 0.0), Wanted(1.0, np.inf), Wanted(10**400, 0.0), 3.0, Wanted(1.0, NoNumber())],
)
def test_a_goal_that_is_none_is_refused(fig6, goal):
    with pytest.raises(subzero.UserError, match=r"what is wanted at t = 0 s is .* Allowed: a Wanted"):
        autopilot.fly(replace(fig6, duration=1.0), Own(lambda: None), lambda t: goal, tethered=False)


def test_a_flight_lasts_as_long_as_it_is_asked_to(fig6):
    run = autopilot.fly(
        replace(fig6, duration=1.25), Own(lambda: (25.0, 0.0, 0.0, 0.0)), forward, tethered=False
    )
    assert float(run["time"][-1]) == pytest.approx(1.3)


@pytest.mark.parametrize("step, speed", [("heading_step", 9.0), ("speed_step", 1.85), ("depth_step", 2.5)])
def test_a_speed_that_the_hull_does_not_reach_is_refused_with_the_one_it_does(fig6, tuning, step, speed):
    with pytest.raises(
        autopilot.NoTrimError, match=r"propeller would need .* it holds|the hull holds [0-9.]+ m/s"
    ) as caught:
        autopilot.step(step, fig6, speed=speed, pilot=autopilot.Pilot(tuning=tuning))
    most = float(re.search(r"holds ([0-9.]+) m/s at most", str(caught.value)).group(1))
    model = subzero.Model.of(fig6)
    autopilot.trim(model, speed=most)
    with pytest.raises(autopilot.NoTrimError):
        autopilot.trim(model, speed=1.01 * most)


def test_the_command_line_refuses_a_speed_out_of_reach(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["autopilot", "heading_step", "--speed", "9"]) == MISTAKE
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert re.search(r"Straight ahead the hull holds 1\.\d+ m/s at most\.$", said)
    assert list(tmp_path.iterdir()) == []


def test_the_command_line_tells_of_an_autopilot_that_breaks(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, GOOD.format(answer="1 / 0"))
    assert main(["autopilot", "heading_step", "--autopilot", path]) == MISTAKE
    assert (
        capsys.readouterr().err == "Autopilot 'mine' broke at t = 0 s: ZeroDivisionError: division by zero\n"
    )
    (tmp_path / "mine.py").write_text("def make(tuning, sample_time, cable):\n    return gains\n")
    assert main(["autopilot", "heading_step", "--autopilot", path]) == MISTAKE
    assert "its function 'make' broke: NameError: name 'gains' is not defined" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["mine.py"]


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
    run = autopilot.fly(replace(fig6, duration=2.0), pilot, forward, tethered=False)
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


@pytest.mark.long
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
