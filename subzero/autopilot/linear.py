"""Linear models about a steady motion, and the subsystems that autopilots are designed on.

    δx' = A δx + B δu,   A = ∂f/∂x, B = ∂f/∂u at (x₀, u₀)               by central differences

with f of `states` plus the cable in steady motion (`pull`), its mass moving with the hull. The actuators have their
lags and no limits, dead bands or play: at a command inside a dead band the true derivative would be zero. Where the
hull is (north, east) changes nothing and is left out. The cable answers at once and follows the tow point's way: good
for motions slower than the cable needs to lie down again behind a hull that turns, a few times L/U.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.autopilot.actuators import ideal
from subzero.autopilot.pull import SteadyPull
from subzero.autopilot.states import INPUT_NAMES, STATE_NAMES, VELOCITY, rate
from subzero.autopilot.steady import Trim
from subzero.errors import UserError, suggestion
from subzero.model import Model

if TYPE_CHECKING:
    import control

STEP = 1e-5
"""Half of a central difference, in SI units, rad and rev/s: truncation 1e-10, rounding 1e-11."""

KEPT = STATE_NAMES[2:]
"""States of the linear model: all but north and east."""


class Subsystem(NamedTuple):
    """A part of the motion that hardly feels the rest: its states, its input."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]


SUBSYSTEMS = {
    "surge": Subsystem(("surge_speed", "propeller_speed"), ("propeller_command",)),
    "yaw_sway": Subsystem(("sway_speed", "yaw_rate", "heading", "rudder_angle"), ("rudder_command",)),
    "pitch_heave": Subsystem(
        ("heave_speed", "pitch_rate", "pitch", "depth", "stern_planes_angle"), ("stern_planes_command",)
    ),
    "roll": Subsystem(("roll_rate", "roll", "stern_planes_difference"), ("stern_planes_difference_command",)),
}
"""The four loops, by name; both planes together pitch, unlike they roll (`states.MIXED`)."""


def linearise(model: Model, steady: Trim) -> control.StateSpace:
    """Return the linear model about a steady motion, deviations from `steady.state` and `steady.command`.

    Args:
        model: vehicle and cable that were trimmed.
        steady: from `trim`; its length of cable pulls in proportion to U² as it stands.

    Returns:
        14 states (`STATES` without north and east), which are the outputs too, and 4 inputs, all by name, in SI
        units, rad and rev/s (`UNITS`).
    """
    import control

    f = _tethered_rate(model, steady)
    A = _slopes(lambda x: f(x, steady.command_angles), steady.state)[2:, 2:]
    B = _slopes(lambda u: f(steady.state, u), steady.command_angles)[2:]
    return control.ss(
        A,
        B,
        np.eye(len(KEPT)),
        np.zeros((len(KEPT), len(INPUT_NAMES))),
        states=list(KEPT),
        outputs=list(KEPT),
        inputs=list(INPUT_NAMES),
        name="hull",
    )


Rate = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _tethered_rate(model: Model, steady: Trim) -> Rate:
    """Return f(x, u) of the hull with its cable in steady motion and its mass."""
    hull = ideal(model.vehicle).numbers()
    pull = SteadyPull.of(model, steady.wet_length)
    extra = steady.wrench - pull.wrench(steady.state[VELOCITY])
    mass = hull.mass_matrix + pull.added_mass(steady.state[VELOCITY])
    heavier = np.linalg.solve(mass, hull.mass_matrix)

    def f(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        rates = rate(x, u, hull, pull.wrench(x[VELOCITY]) + extra)
        rates[VELOCITY] = heavier @ rates[VELOCITY]
        return rates

    return f


def _slopes(f: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Return ∂f/∂x at a point, column by column."""
    columns = [(f(at + step) - f(at - step)) / (2.0 * STEP) for step in STEP * np.eye(at.size)]
    return np.column_stack(columns)


def subsystem(linear: control.StateSpace, name: str) -> control.StateSpace:
    """Return a part of a linear model by name: its own states and input, everything else held at the trim.

    Args:
        linear: from `linearise`.
        name: one of `SUBSYSTEMS`: "surge", "yaw_sway", "pitch_heave", "roll".

    Raises:
        UserError: there is no such subsystem.
    """
    import control

    if name not in SUBSYSTEMS:
        allowed = ", ".join(SUBSYSTEMS)
        raise UserError(f"There is no subsystem '{name}'.{suggestion(name, SUBSYSTEMS)} Allowed: {allowed}.")
    part = SUBSYSTEMS[name]
    to_x = _rows(KEPT, "stern_plane_port_angle", ("stern_planes_angle", "stern_planes_difference"))
    to_u = _rows(INPUT_NAMES, "stern_plane_port_command", SUBSYSTEM_COMMANDS)
    rows = np.array([to_x[state] for state in part.states])
    states = np.column_stack([_spread(row) for row in rows])
    inputs = np.column_stack([_spread(to_u[one]) for one in part.inputs])
    A, B = rows @ np.asarray(linear.A) @ states, rows @ np.asarray(linear.B) @ inputs
    names = {"states": list(part.states), "outputs": list(part.states), "inputs": list(part.inputs)}
    return control.ss(A, B, np.eye(len(rows)), np.zeros(B.shape), name=name, **names)


SUBSYSTEM_COMMANDS = ("stern_planes_command", "stern_planes_difference_command")


def _rows(names: tuple[str, ...], port: str, mixed: tuple[str, str]) -> dict[str, np.ndarray]:
    """Return each signal as a row over `names`, and the planes together and unlike (`states.MIXED`)."""
    rows = dict(zip(names, np.eye(len(names)), strict=True))
    starboard = rows[port.replace("port", "starboard")]
    rows[mixed[0]], rows[mixed[1]] = 0.5 * (starboard + rows[port]), 0.5 * (starboard - rows[port])
    return rows


def _spread(row: np.ndarray) -> np.ndarray:
    """Return how the signals move when the one that `row` reads moves by one and its opposite stays."""
    return row / float(row @ row)
