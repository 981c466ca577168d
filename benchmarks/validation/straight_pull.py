"""The vehicle goes straight ahead at u(t), and the drum turns with friction C_f and inertia I_d:

    T(0) = (½ρπdC_t u|u| + m u′) S + I_d u′/R_d² + C_f/R_d

The momentum of the wet cable, mSu, grows by m S u′ + m u², and m u² comes in with the cable that the drum lets go: what
is left is m S u′. At constant speed the discrete equations have this solution exactly, at every step; while the vehicle
accelerates, the error is one of the time step alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import cable

from .row import Row, Setting, order_row

TABLE_1 = cable.CableProperties()
SOURCE = "(7), (11), (37)"
DRUMS = {
    "free drum": cable.DrumProperties(),
    "friction": cable.DrumProperties(friction_torque=0.01),
    "inertia": cable.DrumProperties(inertia=0.002),
    "inertia and friction": cable.DrumProperties(inertia=0.002, friction_torque=0.01),
}
TIMES = 30.0
"""How long the vehicle would take to speed up. A run ends at 0.8 of it: a frictionless drum with inertia overruns as
soon as the vehicle does not pull it on. [s]"""


def exact(speed: np.ndarray, rate: np.ndarray, run: cable.History, drum: cable.DrumProperties) -> np.ndarray:
    """Return T(0) for speeds u [m/s] and accelerations u′ [m/s²]. [N]."""
    load = TABLE_1.tangential_drag * speed * np.abs(speed) + TABLE_1.mass_per_length * rate
    return load * run.length + (drum.inertia * rate / drum.radius + drum.friction_torque) / drum.radius


def constant(speed: float, step: float, name: str) -> Row:
    """Pull 100 segments off a drum at a constant speed."""
    drum = DRUMS[name]
    run = cable.pull_out(
        lambda _: (speed, 0.0, 0.0),
        30.0 / speed,
        cable=TABLE_1,
        drum=drum,
        scheme=cable.MovingEnd(time_step=step, segment_length=0.3),
    )
    setting = Setting(f"constant {speed:g} m/s, {step:g} s, {name}", SOURCE, 1e-6)
    reference = exact(np.full(run.time.size, speed), np.zeros(run.time.size), run, drum)
    return setting.worst(run.tow_tension[1:], reference[1:], what="T(0), worst of all steps")


def speed_up(t: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Return u, 0.6 to 1.4 m/s with three continuous derivatives, and u′."""
    x = np.clip(np.asarray(t) / TIMES, 0.0, 1.0)
    slope = 140.0 * x**3 * (1.0 - x) ** 3
    return 0.6 + 0.8 * x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3), 0.8 * slope / TIMES


def accelerating(step: float, name: str) -> Row:
    """Pull cable off a drum while speeding up, in segments of 0.3 m."""
    drum = DRUMS[name]
    run = cable.pull_out(
        lambda t: (float(speed_up(t)[0]), 0.0, 0.0),
        0.8 * TIMES,
        drum=drum,
        scheme=cable.MovingEnd(time_step=step, segment_length=0.3),
    )
    setting = Setting(f"0.6 to 1.37 m/s, {step:g} s, {name}", SOURCE, 1e-4)
    reference = exact(*speed_up(run.time), run, drum)
    return setting.worst(run.tow_tension[1:], reference[1:], reference.max(), what="T(0), worst of all steps")


def rounded_friction(speed: float) -> Row:
    """Show what the rounding of friction near rest costs: ½(U_c/U)², U_c = 1 mm/s."""
    row = constant(speed, 0.1, "friction")
    return replace(row, name=f"{row.name}; friction rounded at rest, ½(U_c/U)²", gate=np.inf)


def rows(quick: bool) -> list[Row]:
    """Compare the tow tension at constant and at growing speed, with every kind of drum."""
    speeds = ((1.0, 0.1),) if quick else ((1.0, 1.0), (1.0, 0.1), (2.5, 0.033))
    found = [constant(*pull, name) for pull in speeds for name in ("free drum", "inertia and friction")]
    if not quick:
        found += [constant(0.3, 0.1, "free drum"), rounded_friction(0.3)]
    steps = (0.4, 0.2, 0.1) if quick else (0.8, 0.4, 0.2, 0.1, 0.05)
    for name in DRUMS:
        refined = [accelerating(step, name) for step in steps]
        found.append(refined[steps.index(0.1)])
        found.append(order_row(f"speeding up, {name}", steps, [row.error for row in refined], "Δt", SOURCE))
    return found
