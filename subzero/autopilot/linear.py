"""Linear models about a steady motion, and the subsystems that autopilots are designed on.

    δx' = A δx + B δu,   A = ∂f/∂x, B = ∂f/∂u at (x₀, u₀)               by central differences

with f of `hull_state_space`, and with a cable the motion of its own (`cable_modes`): straight behind the vehicle,
paying out at its speed from a drum on the shore, and frozen at one length. The actuators have their lags and no
limits, dead bands or play: at a command inside a dead band the true derivative would be zero. Where the hull is
(north, east) changes nothing and is left out; on a cable the bearing from the drum takes its place.

A cable pulls the heading back to the line from the drum. Only the whole picture, cable and all, may be turned about the
drum, which is the pole at 0 that is left: it stands for the bearing, which moves on over a length S of way, not for
the heading. Accuracy of this model: 10 % of gain and 10° of phase from 0.3 to 4 rad/s, while the cable grows by less
than two fifths of its length in a period (docs/autopilot.md). For anything else than a straight way there is
`linearise_along`.

`modes` gives its poles in words: how fast, how damped, in seconds and in the vehicle's own time L/U.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.autopilot.cable_modes import BENDS, CableModes
from subzero.errors import UserError, chosen
from subzero.model import Model
from subzero.steady_motion.hull_state_space import (
    STATE_NAMES,
    VELOCITY,
    ideal,
    inputs_of,
    rate,
    states_of,
    to_vehicle,
)
from subzero.steady_motion.steady_pull import SteadyPull
from subzero.steady_motion.trim_point import Trim
from vehicle import rotation
from vehicle.rigid_body import skew

if TYPE_CHECKING:
    import control

STEP = 1e-5
"""Half of a central difference, in SI units, rad and rev/s: truncation 1e-10, rounding 1e-11."""

STEEPEST = 1e-3
"""A cable that its weight hangs at more than this to the way is another one: its normal drag is linear. [rad]"""

KEPT = STATE_NAMES[2:]
"""States of the linear model of a hull: all but north and east."""


class Subsystem(NamedTuple):
    """A part of the motion that hardly feels the rest: its states, its input, how the cable's states begin in it."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    cable: str = ""


SUBSYSTEMS = {
    "surge": Subsystem(("surge_speed", "propeller_speed"), ("propeller_command",)),
    "yaw_sway": Subsystem(
        ("sway_speed", "yaw_rate", "heading", "rudder_angle"), ("rudder_command",), "cable_bearing"
    ),
    "pitch_heave": Subsystem(
        ("heave_speed", "pitch_rate", "pitch", "depth", "stern_planes_angle"),
        ("stern_planes_command",),
        "cable_dip",
    ),
    "roll": Subsystem(("roll_rate", "roll", "stern_planes_difference"), ("stern_planes_difference_command",)),
}
"""The four loops, by name; both planes together pitch, unlike they roll (`hull_state_space.MIXED`)."""


def linearise(model: Model, steady: Trim, *, cross_flow: float = 0.0) -> control.StateSpace:
    """Return the linear model about a steady motion, deviations from `steady.state` and `steady.command`.

    Args:
        model: vehicle and cable that were trimmed; a uniform current is left out, as it is of `trim`.
        steady: from `trim`. For a run in which the cable grows from S₁ to S₂, its middle length approximates best.
        cross_flow: how fast the water typically moves across the cable, the amplitude W of `cable_modes`; 0 for the
            smallest motions, a tenth of a degree. For a heading that swings by ε half of U ε is right. [m/s]

    Returns:
        14 states (`STATES` without north and east) and one for each channel of the vehicle, ``front_port_state``, with
        a cable those of `cable_states` behind them; all are outputs too. 4 inputs, and one for each channel,
        ``front_port_command``. All by name, in SI units, rad and rev/s (`UNITS`). A thruster whose thrust grows with
        the square of its command and that stands still has no gain.

    Raises:
        UserError: a cable that does not lie straight, or that a winch turns or a vessel carries on: what to do.
    """
    import control

    if not (np.isfinite(cross_flow) and cross_flow >= 0.0):
        raise UserError(f"linearise: the cross_flow is {cross_flow!r}. Allowed: a speed of at least 0 m/s.")
    states, inputs = ([each.name for each in of(model.vehicle)] for of in (states_of, inputs_of))
    names = states[2:]
    if steady.wet_length > 0.0:
        _check_straight(model, steady)
        names += cable_states()
        f, at = _tethered_rate(model, steady, cross_flow), np.zeros(2 + len(names))
        at[: len(states)], at[len(states)] = steady.state, steady.wet_length
    else:
        f, at = _hull_rate(model, steady), steady.state
    A = _slopes(lambda x: f(x, steady.command_angles), at)[2:, 2:]
    B = _slopes(lambda u: f(at, u), steady.command_angles)[2:]
    D = np.zeros((len(names), len(inputs)))
    labels = {"states": names, "outputs": names, "inputs": inputs}
    return control.ss(A, B, np.eye(len(names)), D, name="hull", **labels)


def cable_states() -> list[str]:
    """Return the names of the cable's states: its length [m]; bearing and dip of the tow point as seen from the drum,
    against the way [rad]; bends of the cable in both directions [rad] and their rates [rad/s].
    """
    bends = [f"_{kind}_{k + 1}" for kind in ("bend", "bend_rate") for k in range(BENDS)]
    return ["cable_length", *(way + end for way in ("cable_bearing", "cable_dip") for end in ("", *bends))]


def _check_straight(model: Model, steady: Trim) -> None:
    """Raise an error for a cable that does not lie straight behind the vehicle, or a drum that does not turn
    freely.
    """
    cable = model.cable
    angle = (abs(cable.weight_in_water) / max(cable.normal_drag, 1e-12)) ** 0.5 / max(steady.speed, 1e-12)
    wrong = (
        (steady.turn_rate != 0.0, "the vehicle turns, and the cable with it"),
        (model.winch is not None, "a winch turns the drum"),
        (model.vessel is not None, "a vessel carries the drum"),
        (angle > STEEPEST, f"the cable's weight hangs it at {angle:.2g} rad to the way"),
    )
    for is_wrong, words in wrong:
        if is_wrong:
            raise UserError(
                f"linearise: {words}. Allowed: a cable that lies straight behind, pulled off a free drum on the shore."
                " Use linearise_along, or wet_length=0 for the hull alone."
            )


Rate = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _hull_rate(model: Model, steady: Trim) -> Rate:
    """Return f(x, u) of the hull alone."""
    hull = ideal(model.vehicle).numbers()
    return lambda x, u: rate(x, u, hull, steady.wrench)


def _tethered_rate(model: Model, steady: Trim, cross_flow: float) -> Rate:
    """Return f(x, u) of the hull on its cable: x goes on with `cable_states`.

    The tow point moves with V = R(ν + ω × r_c) and is accelerated by R(ν' + ω' × r_c + ω × (ν + ω × r_c)), both split
    along the way and to its two sides; what of the cable's force goes with ν' is mass that the hull takes along.
    """
    hull = ideal(model.vehicle).numbers()
    pull = SteadyPull.of(model, steady.wet_length)
    way = _way(model, steady)
    extra = steady.wrench - pull.wrench(steady.state[VELOCITY])
    lever = np.hstack([np.eye(3), -skew(pull.tow_point)])
    speed = float(np.linalg.norm(lever @ steady.state[VELOCITY]))
    side = CableModes.of(model, speed, steady.wet_length, cross_flow=cross_flow)
    mass = np.diag([pull.mass, -side.H[1], -side.H[1]])
    drag, length = pull.drag / steady.wet_length, steady.state.size

    def f(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        nu, z = x[VELOCITY], x[length + 1 :].reshape(2, -1)
        turned = way @ _rotation(x[:length])
        V, a = turned @ lever @ nu, turned @ np.cross(nu[3:], lever @ nu)
        ahead = -(drag * x[length] * V[0] ** 2 + pull.friction)
        F = np.array([ahead, *(z @ side.G + side.H[0] * V[1:])]) - mass @ a
        rates = rate(x[:length], u, hull, lever.T @ turned.T @ F + extra)
        heavier = hull.mass_matrix + lever.T @ turned.T @ mass @ turned @ lever
        rates[VELOCITY] = np.linalg.solve(heavier, hull.mass_matrix @ rates[VELOCITY])
        a += turned @ lever @ rates[VELOCITY]
        bends = z @ side.A.T + np.column_stack([V[1:], a[1:]]) @ side.B.T
        return np.concatenate([rates, V[:1], bends.ravel()])

    return f


def _way(model: Model, steady: Trim) -> np.ndarray:
    """Return the axes (3, 3), as rows in earth axes: along the way of the tow point, level to starboard, and down."""
    r = model.vehicle.tow_point.position()
    V = _rotation(steady.state) @ (steady.state[6:9] + np.cross(steady.state[9:12], r))
    ahead = V / np.linalg.norm(V)
    starboard = np.cross([0.0, 0.0, 1.0], ahead)
    starboard /= np.linalg.norm(starboard)
    return np.vstack([ahead, starboard, np.cross(ahead, starboard)])


def _rotation(x: np.ndarray) -> np.ndarray:
    """Return R_nb (3, 3) of a state (16 and more,)."""
    R = np.empty((3, 3))
    rotation(to_vehicle(x)[3:7], R)
    return R


def _slopes(f: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Return ∂f/∂x at a point, column by column."""
    columns = [(f(at + step) - f(at - step)) / (2.0 * STEP) for step in STEP * np.eye(at.size)]
    return np.column_stack(columns)


def subsystem(linear: control.StateSpace, name: str) -> control.StateSpace:
    """Return a part of a linear model by name: its own states and input, everything else held at the trim.

    The sideways motions of the cable go with yaw and pitch; its length is held (it is the integral of the speed, which
    a speed loop has anyway).

    Args:
        linear: from `linearise`.
        name: one of `SUBSYSTEMS`: "surge", "yaw_sway", "pitch_heave", "roll".

    Raises:
        UserError: there is no such subsystem.
    """
    import control

    part = chosen(SUBSYSTEMS, name, "subsystem")
    labels = tuple(linear.state_labels)
    own = (*part.states, *(label for label in labels if part.cable and label.startswith(part.cable)))
    to_x = _rows(labels, "stern_plane_port_angle", ("stern_planes_angle", "stern_planes_difference"))
    to_u = _rows(tuple(linear.input_labels), "stern_plane_port_command", SUBSYSTEM_COMMANDS)
    rows = np.array([to_x[state] for state in own])
    states = np.column_stack([_spread(row) for row in rows])
    inputs = np.column_stack([_spread(to_u[each]) for each in part.inputs])
    A, B = rows @ np.asarray(linear.A) @ states, rows @ np.asarray(linear.B) @ inputs
    names = {"states": list(own), "outputs": list(own), "inputs": list(part.inputs)}
    return control.ss(A, B, np.eye(len(rows)), np.zeros(B.shape), name=name, **names)


SUBSYSTEM_COMMANDS = ("stern_planes_command", "stern_planes_difference_command")


def _rows(names: tuple[str, ...], port: str, mixed: tuple[str, str]) -> dict[str, np.ndarray]:
    """Return each signal as a row over `names`, and the planes together and unlike (`hull_state_space.MIXED`)."""
    rows = dict(zip(names, np.eye(len(names)), strict=True))
    starboard = rows[port.replace("port", "starboard")]
    rows[mixed[0]], rows[mixed[1]] = 0.5 * (starboard + rows[port]), 0.5 * (starboard - rows[port])
    return rows


def _spread(row: np.ndarray) -> np.ndarray:
    """Return the change of the signals when the one that `row` reads moves by one and its opposite does not move."""
    return row / float(row @ row)


class Mode(NamedTuple):
    """One pole, or a pair.

    Attributes:
        pole: λ; of a pair the one above the real axis. [1/s]
        scaled: λ L/U; −1 decays to 37 % while the hull moves on by its own length.
        time_constant: −1/Re λ, infinite for an integrator, negative for a growing mode. [s]
        damping: ζ = −Re λ/|λ|; 1 for a real pole that decays, −1 for one that grows, 0 for an integrator.
        period: of the oscillation, infinite without one. [s]
    """

    pole: complex
    scaled: complex
    time_constant: float
    damping: float
    period: float


INTEGRATOR = 1e-6
"""A pole nearer to zero than this times U/L is an integrator: differences are not more accurate."""


def modes(system: control.StateSpace, steady: Trim) -> list[Mode]:
    """Return the modes of a continuous linear model, slowest first.

    Args:
        system: from `linearise` or `subsystem`.
        steady: the motion it belongs to, for L/U.
    """
    scale = steady.time_scale
    poles = [complex(pole) for pole in np.linalg.eigvals(np.asarray(system.A))]
    kept = [pole for pole in poles if pole.imag >= -1e-12 * abs(pole)]
    return [_mode(pole, scale) for pole in sorted(kept, key=abs)]


def _mode(pole: complex, scale: float) -> Mode:
    """Describe a pole."""
    if abs(pole) * scale < INTEGRATOR:
        return Mode(pole, pole * scale, inf, 0.0, inf)
    time_constant = -1.0 / pole.real if pole.real else inf
    period = 2.0 * pi / abs(pole.imag) if pole.imag else inf
    return Mode(pole, pole * scale, time_constant, -pole.real / abs(pole), period)
