"""What a user types first works at once, and what a prompt shows is short, with names, units and degrees."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import cable
import subzero
from subzero.autopilot import design_gains, linearise, margins, subsystem
from subzero.steady_motion.trim import trim


@pytest.fixture(scope="module")
def run():
    return subzero.simulate(subzero.load_scenario("fig6").with_changes({"run.duration_s": 2.0}))


def test_a_list_of_a_trial_takes_a_list_of_values():
    """It was refused as no finite number."""
    trial = subzero.load_scenario("fig6")
    for values in ([0.0, 5.0, -5.0], (0, 5, -5), np.array([0.0, 5.0, -5.0])):
        changed = trial.with_changes({"commands.rudder_deg": values, "start.heading_deg": 10.0})
        np.testing.assert_allclose(np.degrees(changed.commands.values[:, 1]), [0.0, 5.0, -5.0])
        assert "commands.rudder_deg[1] = 5.0" in changed.text


@pytest.mark.parametrize("values", [[0.0, 5.0], [], [0.0, "x", 1.0], [[0.0, 1.0, 2.0]] * 3])
def test_a_list_of_another_length_or_of_no_numbers_is_refused(values):
    with pytest.raises(subzero.UserError, match=r"commands\.rudder_deg"):
        subzero.load_scenario("fig6").with_changes({"commands.rudder_deg": values})


def test_one_run_is_drawn_as_it_is(run):
    """It was a KeyError."""
    figures, named = subzero.draw(run), subzero.draw({"tethered": run})
    assert figures.keys() == named.keys()
    plt.close("all")


@pytest.mark.parametrize("pitch", [-90.0, 90.0])
def test_a_start_may_look_straight_up_or_down(pitch):
    trial = subzero.load_scenario("fig6").with_changes(
        {"run.duration_s": 0.5, "start.pitch_deg": pitch, "start.depth_m": 20.0}
    )
    run = subzero.simulate(trial)
    assert run.attrs["outcome"] == "completed"
    assert float(run["pitch"][0]) == pytest.approx(pitch, abs=1e-4)


def test_values_that_a_prompt_shows_are_short_and_say_degrees_and_units():
    model = subzero.Model.of(subzero.load_scenario("fig6"))
    steady = trim(model, speed=1.0)
    linear = linearise(model, steady)
    heading = design_gains(
        subsystem(linear, "yaw_sway"),
        tracked="heading",
        largest={"heading": 0.1, "integral": 0.5},
        largest_command=0.2,
    )
    found = {
        "degree": repr(steady),
        "rev/s": repr(steady),
        "tracking": repr(heading),
        "rad/s": repr(margins(heading.loop)),
        "N north": repr(cable.hold(((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)), 6.0)),
    }
    assert "roll 0 degree" in repr(steady)
    for words, text in found.items():
        assert words in text
        assert text.count("\n") < 12
        assert "array(" not in text
