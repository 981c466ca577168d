"""What a coupled run is made of, as named tuples that compiled code takes: what stays, and what changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.element import Load
from cable.line import Line
from cable.properties import CableNumbers, DrumNumbers
from vehicle import STATE_SIZE, VehicleNumbers


class Orders(NamedTuple):
    """Commands held between samples: time (n,) [s]; values (n, 4): propeller [rev/s], rudder, planes [rad]."""

    time: np.ndarray
    values: np.ndarray


class Track(NamedTuple):
    """A prescribed motion, linear between samples: time (n,) [s], surge speed [m/s], pitch, heading (n,) [rad]."""

    time: np.ndarray
    surge_speed: np.ndarray
    pitch: np.ndarray
    heading: np.ndarray


class HullWork(NamedTuple):
    """Work space: Runge-Kutta slopes and stage, wrench, rotation; and the states on the way of an exchange."""

    slopes: np.ndarray
    stage: np.ndarray
    wrench: np.ndarray
    rotation: np.ndarray
    force: np.ndarray
    path: np.ndarray


def new_hull_work(most_steps: int) -> HullWork:
    """Return work space for exchanges of up to `most_steps` hull steps."""
    slopes, stage = np.zeros((4, STATE_SIZE)), np.zeros(STATE_SIZE)
    path = np.zeros((most_steps + 1, STATE_SIZE))
    return HullWork(slopes, stage, np.zeros(6), np.zeros((3, 3)), np.zeros(3), path)


class Ledger(NamedTuple):
    """Sums since the start, and the flows at both ends of the last step.

    Attributes:
        total: (7,), rows as in `subzero.energy`. [J]
        hull_old, hull_new: powers of `vehicle.power` (4,). [W]
        cable_old, cable_new: flows of `cable.energy.energy_flow` (5,).
        kinetic: kinetic energy of the hull at the last accepted time, in a one-element array. [J]
    """

    total: np.ndarray
    hull_old: np.ndarray
    hull_new: np.ndarray
    cable_old: np.ndarray
    cable_new: np.ndarray
    kinetic: np.ndarray


def new_ledger() -> Ledger:
    """Return an empty ledger."""
    return Ledger(*(np.zeros(size) for size in (7, 4, 4, 5, 5, 1)))


class Setup(NamedTuple):
    """What does not change during a run."""

    vehicle: VehicleNumbers
    cable: CableNumbers
    drum: DrumNumbers
    current: np.ndarray
    r_c: np.ndarray
    drum_place: np.ndarray
    orders: Orders
    track: Track
    hull_step: float
    cable_step: float
    segment_length: float
    tethered: bool
    prescribed: bool


class Live(NamedTuple):
    """What changes during a run: the state and the forces now and before, the cable, and work space."""

    state: np.ndarray
    force: np.ndarray
    force_before: np.ndarray
    guess: np.ndarray
    tow: np.ndarray
    Z: np.ndarray
    gain: np.ndarray
    last_step: np.ndarray
    line: Line
    load: Load
    hull: HullWork
    ledger: Ledger
