"""The linear models of a vehicle on its cable do what the coupled simulation does when it is disturbed a little.

Verifies: `autopilot.linearise_along` (the cable grows) and `autopilot.linearise` (frozen at the length in the middle of
the run) against half the difference of two runs of `subzero.simulate` that are disturbed by as much either way. The
disturbance is a hundredth of a degree, or a hundredth of a revolution a second: what is quadratic is then 0.5 %.
Tolerance: 5 % of the largest deviation over 12 s along the run; 25 % frozen; of the answer to a sine 10 % and 10
degrees, where the cable grows by less than two fifths of its length in a period.
"""

import dataclasses
from functools import cache

import control
import numpy as np
import pytest

import subzero
from scenarios.trial import Commands
from subzero import autopilot

SETTLED, STEP = 3.0, 0.1
"""So long a run is left alone, for its propeller to speed up [s]; step of the cable [s]."""
SMALL = np.array([1e-2, *np.radians([1e-2, 1e-2, 1e-2])])
LOOPS = {
    "surge": (np.array([1.0, 0.0, 0.0, 0.0]), "surge_speed"),
    "yaw_sway": (np.array([0.0, 1.0, 0.0, 0.0]), "heading"),
    "pitch_heave": (np.array([0.0, 0.0, 1.0, 1.0]), "pitch"),
}
SEEN = {
    "surge": ("surge_speed",),
    "yaw_sway": ("heading", "yaw_rate"),
    "pitch_heave": ("pitch", "pitch_rate"),
}


@cache
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


def trial(speed, wet_length, command, deviation, sign):
    """Return a run that begins at a speed with cable behind, its command disturbed at every cable step (n, 4)."""
    fig6 = subzero.load_scenario("fig6")
    commands = Commands(time=STEP * np.arange(len(deviation)), values=command + sign * deviation)
    start = dataclasses.replace(fig6.start, surge_speed=speed, wet_length=wet_length, heading=0.0)
    return dataclasses.replace(fig6, start=start, commands=commands, duration=STEP * len(deviation))


def simulated(speed, wet_length, command, deviation):
    """Return half the difference of two runs by channel, in SI units and rad."""
    ends = [
        subzero.simulate(trial(speed, wet_length, command, deviation, sign), model=model())
        for sign in (1.0, -1.0)
    ]

    def channel(name):
        scale = np.radians(1.0) if ends[0][name].attrs["units"].startswith("degree") else 1.0
        either = [one[name].values * scale for one in ends]
        if name == "heading":
            either = [np.unwrap(one) for one in either]
            either[1] += 2.0 * np.pi * np.round((either[0][0] - either[1][0]) / (2.0 * np.pi))
        return 0.5 * (either[0] - either[1])

    return channel


def pulse(loop):
    """Return a pulse of 2 s on a loop's input, after the run has settled, and 10 s more (n, 4)."""
    deviation = np.zeros((round((SETTLED + 12.0) / STEP), 4))
    deviation[round(SETTLED / STEP) : round((SETTLED + 2.0) / STEP)] = LOOPS[loop][0] * SMALL
    return deviation


def error(found, expected):
    return np.max(np.abs(found - expected)) / np.max(np.abs(expected))


def cases(*quick, slow):
    """Return cable lengths and speeds, those that take long marked."""
    return [*quick, *(pytest.param(*one, marks=pytest.mark.slow) for one in slow)]


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(
    "wet_length,speed",
    cases(
        (10.0, 1.5),
        (20.0, 1.0),
        slow=[(10.0, 0.5), (10.0, 1.0), (20.0, 0.5), (20.0, 1.5), (40.0, 0.5), (40.0, 1.0), (40.0, 1.5)],
    ),
)
def test_a_pulse_moves_the_linear_model_along_a_run_like_the_run(loop, wet_length, speed):
    command = autopilot.trim(
        model(), speed=speed, wet_length=min(wet_length, 20.0)
    ).command  # 40 m: slower than 1.5
    deviation = pulse(loop)
    expected = simulated(speed, wet_length, command, deviation)
    along = autopilot.linearise_along(trial(speed, wet_length, command, deviation, 0.0), model=model())
    found = along.respond(deviation)
    for name in SEEN[loop]:
        assert error(found[name].values, expected(name)) < 0.05, name


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(
    "wet_length,speed",
    cases(
        (10.0, 1.5),
        (20.0, 1.0),
        slow=[(10.0, 0.5), (10.0, 1.0), (20.0, 0.5), (20.0, 1.5), (40.0, 0.5), (40.0, 1.0), (40.0, 1.5)],
    ),
)
def test_a_pulse_moves_the_linear_model_of_the_middle_length_like_the_run(loop, wet_length, speed):
    """The run that the model was wrong for: after 2 s of rudder the cable pulls the heading back."""
    command = autopilot.trim(
        model(), speed=speed, wet_length=min(wet_length, 20.0)
    ).command  # 40 m: slower than 1.5
    deviation = pulse(loop)
    expected = simulated(speed, wet_length, command, deviation)
    run = subzero.simulate(trial(speed, wet_length, command, deviation, 0.0), model=model())
    there = run.sel(time=SETTLED + 6.0, method="nearest")
    middle = autopilot.trim(
        model(), speed=float(there["surge_speed"]), wet_length=float(there["cable_length"])
    )
    part = autopilot.subsystem(autopilot.linearise(model(), middle), loop)
    held = np.append(deviation @ LOOPS[loop][0] / np.sum(LOOPS[loop][0]), 0.0)
    response = control.forced_response(control.c2d(part, STEP), STEP * np.arange(held.size), held)
    for name in SEEN[loop]:
        found = response.states[part.state_labels.index(name)]
        assert error(found, expected(name)) < 0.25, name


def answer(speed, wet_length, loop, frequency):
    """Return the answer to a sine as a complex gain, while the cable grows through `wet_length` in its middle.

    A sine whose amplitude changes evenly, and a slow change, are fitted to 1.1 periods; the command is held over a
    step, which is taken out.
    """
    half, lead = 1.1 * np.pi / frequency, 12.0
    lead = min(lead, (wet_length - 1.0) / speed - half)
    start = wet_length - speed * (lead + half)
    time = STEP * np.arange(int((lead + 2.0 * half) / STEP) + 1)
    phase = frequency * (time - lead - half)
    sine = np.cos(phase) * np.clip((time - SETTLED / 2.0) / 3.0, 0.0, 1.0)
    command = autopilot.trim(model(), speed=speed, wet_length=wet_length).command
    deviation = np.outer(sine[:-1], LOOPS[loop][0] * SMALL)
    seen = simulated(speed, start, command, deviation)(LOOPS[loop][1]) / np.max(LOOPS[loop][0] * SMALL)
    late = time >= lead
    tau, c, s = (time[late] - lead - half) / half, np.cos(phase[late]), np.sin(phase[late])
    basis = np.stack([c, s, tau * c, tau * s, np.ones_like(tau), tau, tau**2], axis=1)
    fitted = np.linalg.lstsq(basis, seen[late], rcond=None)[0]
    held = np.exp(-0.5j * frequency * STEP) * np.sinc(0.5 * frequency * STEP / np.pi)
    return (fitted[0] - 1j * fitted[1]) / held


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(
    "speed,wet_length,frequency",
    cases(
        (0.5, 40.0, 0.3), (1.0, 20.0, 0.8), (1.0, 20.0, 4.0),
        slow=[
            (0.5, 20.0, 0.4), (0.5, 40.0, 1.0), (0.6, 10.0, 0.95), (1.0, 20.0, 2.0), (1.0, 40.0, 0.4), (1.0, 40.0, 1.0),
            (1.4, 30.0, 0.75), (1.4, 30.0, 3.0),
        ],
    ),
)  # fmt: skip
def test_a_sine_moves_the_linear_model_like_the_run(loop, speed, wet_length, frequency):
    assert 2.0 * np.pi * speed / frequency < 0.4 * wet_length
    part = autopilot.subsystem(
        autopilot.linearise(model(), autopilot.trim(model(), speed=speed, wet_length=wet_length)), loop
    )
    row = part.state_labels.index(LOOPS[loop][1])
    ratio = np.squeeze(part(1j * frequency))[row] / answer(speed, wet_length, loop, frequency)
    assert abs(ratio) == pytest.approx(1.0, abs=0.1)
    assert abs(np.degrees(np.angle(ratio))) < 10.0
