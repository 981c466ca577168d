"""The truth by the other cable formulation agrees with the coupled run, far within the noise of any sensor.

Verifies: `subzero.synthetic.reference_run`. Configuration: fig6 as it is, and with a heavier cable, a drum that rubs, a
heavy drum, cable in the water at the start, a current, a change in mid-run, a missing force. Tolerance: a tenth of the
noise of a usual sensor (0.0015 m/s, 0.04 degrees, 0.0015 m), and 1e-3 of the largest tow force on fig6; wider where a
cable hangs slack, whose shape is nobody's (heavy and unheld, overrun by its drum, or in a cross current at rest).
"""

import dataclasses

import numpy as np
import pytest

import subzero
from subzero.diagnosis import NOISE, Setting
from subzero.external_force import MissingForce, Term
from subzero.simulation.run import run_trial
from subzero.synthetic.reference_run import NoTruthError, seen, simulate_reference, truth_of

FIG6 = subzero.load_scenario("fig6")
PLAIN = Setting(trial=FIG6, model=subzero.Model.of(FIG6))
TIMES = np.linspace(0.0, 30.0, 301)
CHANNELS = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
BENT = PLAIN.with_vehicle(rudder_servo__offset=0.03).with_cable(tangential_drag_coefficient=0.02).model
FORCE = MissingForce(
    time=(8.0, 15.0), wrench=((-0.2, 0.05, 0, 0, 0, 0),) * 2, terms=(Term("X", "wet_length*u2", -0.02),)
)
CASES = {
    "fig6": (PLAIN, 0.1),
    "rubbing drum": (PLAIN.with_drum(friction_torque=0.04), 0.1),
    "wet length": (PLAIN.with_start(wet_length=5.0), 0.1),
    "rubbing, heavy, wet, in a current": (
        PLAIN.with_drum(friction_torque=0.02, inertia=0.03)
        .with_model(current=(0.1, 0.1, 0.0))
        .with_start(wet_length=4.0),
        0.1,
    ),
    "missing force": (PLAIN.with_model(missing=FORCE), 0.1),
    "changed at 12 s": (dataclasses.replace(PLAIN, later=((12.0, BENT),)), 0.1),
    "untethered": (dataclasses.replace(PLAIN, tethered=False), 0.1),
    "heavy cable, unheld": (PLAIN.with_cable(mass_per_length=0.0065), 0.8),
    "heavy drum that overruns": (PLAIN.with_drum(inertia=0.04), 0.1),
    "slack in a current": (PLAIN.with_model(current=(0.15, -0.1, 0.0)), 0.8),
}


def by_tight_coupling(setting):
    trial = dataclasses.replace(setting.trial, cable_step=0.05, segment_length=0.25, hull_step=0.01)
    run = run_trial(trial, setting.model, setting.tethered, later=setting.later)
    assert run.completed, run.message
    return run


def shown(setting, run):
    class Truth:
        pull, length = run.recording.tow_force, run.recording.length

    Truth.run = run
    return seen(setting, Truth, TIMES, CHANNELS)


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_both_formulations_agree_far_within_the_noise(name):
    setting, share = CASES[name]
    other, tight = simulate_reference(setting, TIMES, CHANNELS), shown(setting, by_tight_coupling(setting))
    for channel in CHANNELS:
        gap = np.abs(other[channel] - tight[channel]).max()
        assert gap < share * NOISE[channel], f"{channel}: {gap:.2g} against a noise of {NOISE[channel]:g}"


def test_on_fig6_the_tow_force_agrees_to_a_thousandth():
    trial = dataclasses.replace(FIG6, cable_step=0.05, segment_length=0.25, hull_step=0.01)
    truth = truth_of(dataclasses.replace(PLAIN, trial=trial))
    tight = by_tight_coupling(PLAIN).recording.tow_force
    gap = np.linalg.norm(truth.pull - tight, axis=1).max()
    assert gap < 1e-3 * np.linalg.norm(tight, axis=1).max()


def test_the_sensors_are_those_of_the_diagnosis():
    from subzero.diagnosis.inference import respond

    setting = PLAIN.with_sensor("heading", scale=0.02, bias=1.5, lag=0.4).with_sensor("surge_speed", lag=0.05)
    setting = setting.with_sensor("roll_angle", lag=1e-9)  # a drawn tolerance may be that small
    setting = dataclasses.replace(setting, clock_offset=0.23)
    other, own = (ask(setting, TIMES, CHANNELS) for ask in (simulate_reference, respond))
    for channel in CHANNELS:
        gap = np.nanmax(np.abs(other[channel] - own[channel]))
        assert gap < 0.25 * NOISE[channel], f"{channel}: {gap:.2g}"


def test_a_prescribed_motion_has_no_other_truth():
    trial = subzero.load_scenario("fig4")
    with pytest.raises(NoTruthError, match="prescribed"):
        simulate_reference(Setting(trial=trial, model=subzero.Model.of(trial)), TIMES, CHANNELS)
