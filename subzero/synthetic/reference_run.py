"""The truth of a setting by the other cable formulation, lumped masses and springs, and the readings of its sensors.

Another cable (`cable.lumped`), another way to couple it (`reference_coupling`), finer steps, and sensors written
independently of `hypothesis.configuration`. Only the hull is the same; without the cable it is the hull alone in finer
steps.

    y' = (x − y)/lag,   shown = (1 + scale) y + bias,   at t − clock offset

Deliberately left out: a motion that is prescribed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

import scenarios
from cable.lumped import Course, Rope, begin, rope_off_drum, winch_rows
from cable.task import START_LENGTH
from scenarios.steps import fitting_step
from subzero.channels import BY_NAME
from subzero.diagnosis.hypothesis.configuration import Sensing, Setting
from subzero.engine.environment import drum_of
from subzero.engine.initial_conditions import go_on_with, prepare, rows_of_changes
from subzero.engine.recording import Run, new_recording, record_row
from subzero.engine.run_state import Live, Setup
from subzero.errors import UserError
from subzero.model import Model
from subzero.simulation.run import run_trial
from subzero.synthetic.reference_coupling import FINE, Led, follow_rope

STATE = {
    "north": 0,
    "east": 1,
    "depth": 2,
    "sway_speed": 8,
    "heave_speed": 9,
    "roll_rate": 10,
    "pitch_rate": 11,
    "yaw_rate": 12,
    "propeller_speed": 13,
}
"""Channel → its place in the state of the hull."""
SHORT = 0.01
"""A lag of less than this share of a step leaves nothing of the step before. [-]"""


def seen(setting: Setting, truth: Truth, times: np.ndarray, channels: Iterable[str]) -> dict[str, np.ndarray]:
    """Return channel → the readings of its sensor at times (n,), in the display unit; NaN after the end of the
    truth.
    """
    grid = truth.run.times
    out = {}
    for name in channels:
        shown = _sensor(setting.sensing.get(name, Sensing()), grid, _true(name, setting, truth))
        out[name] = np.interp(times - setting.clock_offset, grid, shown, right=np.nan)
    return out


def _true(name: str, setting: Setting, truth: Truth) -> np.ndarray:
    """Return the true values of a channel at the times of the run (n,), in its display unit."""
    r, scale = truth.run.recording, BY_NAME[name].scale
    if name in STATE:
        return scale * r.state[:, STATE[name]]
    if name in ("roll_angle", "pitch"):
        return scale * r.attitude[:, ("roll_angle", "pitch").index(name)]
    if name == "heading":
        continuous = np.unwrap(r.attitude[:, 2])
        whole = np.round((setting.trial.start.heading - continuous[0]) / (2.0 * np.pi))
        heading: np.ndarray = scale * (continuous + 2.0 * np.pi * whole)
        return heading
    others: dict[str, Callable[[], np.ndarray]] = {
        "surge_speed": lambda: r.state[:, 7] - _water(setting, truth)[:, 0],
        "speed_over_ground": lambda: np.sqrt(np.sum(r.state[:, 7:10] ** 2, axis=1)),
        "cable_tension": lambda: np.sqrt(np.sum(truth.pull**2, axis=1)),
        "cable_length": lambda: truth.length,
        "rudder_angle": lambda: scale * r.fins[:, 0],
        "battery_voltage": lambda: r.voltage,
    }
    return others[name]()


def _water(setting: Setting, truth: Truth) -> np.ndarray:
    """Return the velocity of the water at the hull, body axes (n, 3). [m/s]"""
    r, times = truth.run.recording, truth.run.times
    changes = [0.0, *(time - 1e-6 for time, _ in setting.later)]
    models = [setting.model, *(model for _, model in setting.later)]
    waters = [model.water() for model in models]
    rows = np.searchsorted(changes, times, side="right") - 1
    north_east_down = [
        waters[max(row, 0)].at(place, time)
        for row, place, time in zip(rows, r.state[:, :3], times, strict=True)
    ]
    body: np.ndarray = np.einsum("nji,nj->ni", r.rotation, np.array(north_east_down))
    return body


def _sensor(sensor: Sensing, grid: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return what a sensor shows of a truth (n,) on an even grid: Heun's method in tenths of a step for the lag; for a
    lag far shorter than a step, what was true that much earlier.
    """
    shown, short = truth.copy(), SHORT * (grid[1] - grid[0])
    if 0.0 < sensor.lag < short:
        shown = np.interp(grid - sensor.lag, grid, truth)
    elif sensor.lag > 0.0:
        parts = int(np.ceil(10.0 * max(1.0, (grid[1] - grid[0]) / sensor.lag)))
        h = (grid[1] - grid[0]) / parts / sensor.lag
        y = truth[0]
        for k in range(1, truth.size):
            slope = (truth[k] - truth[k - 1]) / parts
            for part in range(parts):
                x = truth[k - 1] + slope * part
                y += 0.5 * h * (x - y + x + slope - (y + h * (x - y)))
            shown[k] = y
    return (1.0 + sensor.scale) * shown + sensor.bias


FASTEST = 2.0
"""Space for cable is allocated for this speed. [m/s]"""


class NoTruthError(UserError):
    """The other formulation finds no run of this setting; the message says why."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The truth: the run of the hull, and of the cable the pull in earth axes (n, 3), drum tension, length (n,)."""

    run: Run
    pull: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray


def simulate_reference(
    setting: Setting,
    times: np.ndarray,
    channels: Iterable[str],
    *,
    cable_step: float = 0.025,
    segment_length: float = 0.25,
    hull_step: float = 0.01,
) -> dict[str, np.ndarray]:
    """Return the readings of the sensors of a setting, without noise, by the other formulation.

    Args:
        setting: of the trial.
        times: when the sensors are read (n,). [s]
        channels: names of `subzero.channels`; `surge_speed` is that through the water.
        cable_step: time step of the cable. [s]
        segment_length: of the cable. [m]
        hull_step: time step of the hull. [s]

    Returns:
        channel → values (n,) in its display unit, NaN after the end of the trial.

    Raises:
        NoTruthError: there is no run of this setting.
    """
    last = float(np.max(times)) + max(-setting.clock_offset, 0.0)
    steps = int(np.ceil(min(last, setting.trial.duration) / cable_step - 1e-6))
    trial = replace(
        setting.trial,
        cable_step=cable_step,
        segment_length=segment_length,
        hull_step=fitting_step(cable_step, hull_step),
        grading=0.0,
        far_grading=0.0,
        every=0.0,
        duration=max(steps, 1) * cable_step,
    )
    fine = replace(setting, trial=trial, later=_within(setting, trial))
    return seen(fine, truth_of(fine), times, channels)


def truth_of(setting: Setting) -> Truth:
    """Return the run of a setting in its own steps.

    Raises:
        NoTruthError: the run cannot go on to its end.
    """
    trial, model = setting.trial, setting.model
    if trial.motion is not None:
        raise NoTruthError(f"'{trial.name}' has a prescribed motion; the other formulation knows none.")
    times = trial.times()
    if not setting.tethered:
        return _alone(setting, times.size)
    changes = rows_of_changes(trial, True, times, setting.later)
    setup, live = prepare(trial, model, True, run_in=0.0)
    rope = _rope(setting, setup, live, times)
    led = _led(times.size, rope.spring.shape[1])
    recording = new_recording(times.size, live.line.length.size, entries=live.state.size)
    row = 1
    record_row(setup, live, recording, 0, 0.0, 0)
    led.history[0, :3], led.history[0, 4] = live.now.force, live.now.length
    while row < times.size:
        if row - 1 in changes:
            setup = go_on_with(changes.pop(row - 1), setup, live, trial, True, float(times[row - 1]))
            rope.ends.stretch = setup.fixed.cable.compliance
        last = min([times.size, *(change + 1 for change in changes)])
        row, ending = follow_rope(setup, live, rope, led, recording, times, row, last, trial.segment_length)
        if ending != FINE:
            raise NoTruthError(
                f"Hull and lumped cable of '{trial.name}' found no common force beyond t = {times[row - 1]:g} s."
            )
    run = Run(times=times, recording=recording, completed=True, message="")
    history = led.history
    return Truth(run=run, pull=history[:, :3], drum_tension=history[:, 3], length=history[:, 4])


def _within(setting: Setting, trial: scenarios.Trial) -> tuple[tuple[float, Model], ...]:
    """Return the changes of a setting that come before the end of a trial."""
    return tuple((time, model) for time, model in setting.later if time < trial.duration - 1e-9)


def _alone(setting: Setting, rows: int) -> Truth:
    """Return the run of the hull alone."""
    run = run_trial(setting.trial, setting.model, False, later=setting.later)
    if not run.completed:
        raise NoTruthError(run.message)
    return Truth(run=run, pull=np.zeros((rows, 3)), drum_tension=np.zeros(rows), length=np.zeros(rows))


def _rope(setting: Setting, setup: Setup, live: Live, times: np.ndarray) -> Rope:
    """Return the lumped cable, straight behind the hull, as the tight coupling lays its own."""
    wet, model = max(setting.trial.start.wet_length, START_LENGTH), setting.model
    ahead, ends = live.now.hull.rotation[:, 0].copy(), np.array([times[0], times[-1]])
    tow = wet * ahead + np.outer([0.0, FASTEST * times[-1]], ahead)
    velocity = np.outer(np.full(2, live.state[7]), ahead)
    setpoint, rate = winch_rows(drum_of(model), ends, wet)
    still = np.zeros((2, 3))
    course = Course(ends, np.c_[tow, still, setpoint], np.c_[velocity, still, rate])
    fastest = model.water().fastest
    rope = rope_off_drum(
        course, setting.trial.segment_length, model.cable, drum_of(model), fastest, wet, ahead
    )
    leg = np.r_[0.0, course.values[0], course.rates[0]]
    begin(rope, leg, setup.fixed.cable, setup.water)
    live.now.force[:], live.now.length = rope.ends.tow_force, wet
    return rope


def _led(rows: int, springs: int) -> Led:
    """Return the work space of a run."""
    return Led(
        ends=np.zeros((2, 6)),
        legs=np.zeros((2, 15)),
        matrix=np.eye(3),
        states=np.zeros(springs),
        history=np.zeros((rows, 5)),
    )
