"""The data of a coupled run, as named tuples that compiled code takes: the constants and the state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.current import Water
from cable.drum import DrumNumbers
from cable.moving_end import Line, Load
from cable.properties import CableNumbers
from subzero.jit import Record
from vehicle import VehicleNumbers


class Orders(NamedTuple):
    """Commands held between samples: time (n,) [s]; values (n, 4 and one a thruster): propeller [rev/s], rudder,
    planes [rad], thrusters [-1 … 1]. Of a vehicle on station, one row, that station keeping writes.
    """

    time: np.ndarray
    values: np.ndarray


TIME, SPEED, PITCH, HEADING = range(4)
"""Rows of a prescribed motion (4, n), linear between samples: time [s], surge speed [m/s], pitch, heading [rad]."""

LINEAR_ROWS = 4
PLACE, SLOPE, KNOT_ROWS = 1, 7, 13
"""Rows of a smooth one (13, n), after that of time: x, y, z [m], φ, θ, ψ [rad], and the rate of each of them."""


PEAK, IMPULSE, OVERLOAD = range(3)
"""Places in `Now.tug`: largest pull [N], its impulse ∫|F|dt [N s], and how long it was above the strength [s]."""


class HullWork(Record):
    """Work space of the hull: rotation R_nb, pull of the cable in earth axes and its wrench, the water around it."""

    rotation: np.ndarray
    pull: np.ndarray
    wrench: np.ndarray
    current: np.ndarray


class Ledger(Record):
    """Sums since the start, and the flows at both ends of the last step.

    Attributes:
        total: (7,), rows as in `subzero.engine.energy`. [J]
        hull_old, hull_new: powers of `vehicle.power` (4,). [W]
        cable_old, cable_new: flows of `cable.moving_end.energy.energy_flow` (FLOWS,).
        kinetic: kinetic energy of the hull at the last accepted time. [J]
    """

    total: np.ndarray
    hull_old: np.ndarray
    hull_new: np.ndarray
    cable_old: np.ndarray
    cable_new: np.ndarray
    kinetic: float


class Fixed(Record):
    """The numbers that do not change during a run.

    `drum_place` is the drum at the start, earth axes (3,) [m]; hull and cable agree when their forces differ by less
    than the fraction `agreement`; energies are summed up if the run is `booked`; the model is `lacking` if something is
    to be added to it, see `Setup`. `strength` is the load that the cable may carry, infinite if not known [N].
    The cable `snaps` if it can come taut against the vehicle: a winch holds its length. (A drum that turns gives cable
    when it is pulled.) It is a `joint` if it does not stretch, too.
    """

    vehicle: VehicleNumbers
    cable: CableNumbers
    drum: DrumNumbers
    r_c: np.ndarray
    drum_place: np.ndarray
    hull_step: float
    agreement: float
    strength: float
    tethered: bool
    prescribed: bool
    booked: bool
    lacking: bool
    snaps: bool
    joint: bool


class Now(Record):
    """Where a run stands.

    Attributes:
        force, force_before: pull of the cable on the vehicle, at the last two accepted times, earth axes (3,). [N]
        missed: by how much the pull came out other than straight on from the two before it, in the last exchange (3,).
            [N]
        guess: pull at the end of the exchange that is being tried (3,). [N]
        change: the last change of the guess (3,). [N]
        tow: tow point there, relative to the drum (3,). [m]
        Z: answer of the pull to the tow point's place (3, 3). [N/m]
        tow_before: the same for the guess before (3,). [m]
        mobility: acceleration of the tow point per pull, body axes, as the last exchanges showed it (3, 3). [1/kg]
        last_step: length of the last accepted exchange, 0 at the start. [s]
        pace: length of an exchange that follows the jumps of the pull; infinite where it does not jump. [s]
        tug: how hard the cable pulled since the last row, rows as in `PEAK` (3,).
        iterations: of Newton's method on the cable, since the start.
        length: of the cable in the water, at the last accepted time, 0 without a cable. [m]
        hull: work space.
        ledger: energies.
    """

    force: np.ndarray
    force_before: np.ndarray
    missed: np.ndarray
    guess: np.ndarray
    change: np.ndarray
    tow: np.ndarray
    tow_before: np.ndarray
    Z: np.ndarray
    mobility: np.ndarray
    last_step: float
    pace: float
    tug: np.ndarray
    iterations: int
    length: float
    hull: HullWork
    ledger: Ledger


BANDWIDTH = 6
"""Place of ω in the gains of a station."""


class Station(NamedTuple):
    """A place and a heading that thrusters keep or follow, see `subzero.engine.station_keeping`.

    Attributes:
        track: time [s], north, east, depth [m] and heading [rad] (n, 5), linear in between; no row: no station.
        gains: diagonal of the mass matrix with added mass, 0 where an angle is free [kg, kg m2], then ω [rad/s] (7,).
        allocate: thrusts per wrench (thrusters, 6).
        error: of place and heading at the last look (4,), 0 where a thruster is at its limit; work space.
    """

    track: np.ndarray
    gains: np.ndarray
    allocate: np.ndarray
    error: np.ndarray


class Setup(NamedTuple):
    """The constants of a run.

    Attributes:
        fixed: numbers; `drum` in it is where the drum is at the end of the step that is being tried.
        orders, track: the commands to the vehicle, or its motion (LINEAR_ROWS or KNOT_ROWS, n).
        water: how the water moves; its origin is the drum's place at the start.
        led: motion of the drum, and setpoint of its winch, see `cable.drum_motion` (n, 8).
        station: that thrusters keep; of no rows for none.
        added, terms: the missing force, see `MissingForce.numbers` (7, n), (m, 5); empty for none.
    """

    fixed: Fixed
    orders: Orders
    track: np.ndarray
    water: Water
    led: np.ndarray
    station: Station
    added: np.ndarray
    terms: np.ndarray


class Live(NamedTuple):
    """The state of a run.

    Attributes:
        now: where it stands.
        state: of the vehicle, as in `vehicle.STATE`, then a lagged command a thruster and the integrals of a station.
        path: the vehicle's states on the way of an exchange (steps + 1, entries of the state).
        stages: Runge-Kutta slopes (rows 0 … 3) and the state they are taken at (5, entries of the state).
        powers: `vehicle.power` at the first stage of each step of an exchange that is booked (steps, 4). [W]
        line: the cable.
        load: work space of the cable.
    """

    now: Now
    state: np.ndarray
    path: np.ndarray
    stages: np.ndarray
    powers: np.ndarray
    line: Line
    load: Load
