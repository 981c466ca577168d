"""Buoyancy engines: a bladder, a piston or a tank that changes how much water the vehicle displaces.

    F = −ρ g V k_b,    M = r × F,    k_b = third row of R_nb             V > 0 lifts

V is the volume displaced beyond that of `buoyancy.net_buoyancy`, behind a pump with its rate limit. The mass of the
vehicle is constant: oil moves between the inside and a bladder. Its shift inside the hull is left out, as is
the work of the pump against the pressure of the water.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, compiled
from vehicle.channels import Channel
from vehicle.parameters import Section, parameter
from vehicle.state import STATE_SIZE

MOST_ENGINES = 2


class EngineNumbers(Record):
    """An engine as the compiled functions take it: its channel, ρ g, and its place."""

    channel: int
    lift_per_volume: float
    x: float
    y: float
    z: float


@dataclass(frozen=True, kw_only=True)
class BuoyancyEngine(Section):
    """One buoyancy engine; its name is that of its table in the file."""

    x: float = parameter("centre of the volume, forward of the hull centre", "m")
    y: float = parameter("centre of the volume, to starboard", "m")
    z: float = parameter("centre of the volume, downward", "m")
    least_volume: float = parameter("least volume displaced beyond that at rest", "m3", high=0.0)
    most_volume: float = parameter("most volume displaced beyond that at rest", "m3", low=0.0)
    pump_rate: float = parameter("fastest change of the volume", "m3/s", above=0.0, unlimited=True)
    lag: float = parameter("time constant", "s", low=0.0)
    lost_command: float = parameter("share of the command that is lost; 1: dead", "1", low=0.0, high=1.0)

    def channels(self, name: str) -> tuple[Channel, ...]:
        """Return its command: the volume."""
        return (
            Channel(
                name=name,
                meaning=f"volume displaced by the buoyancy engine {name}",
                unit="m3",
                low=self.least_volume,
                high=self.most_volume,
                lag=self.lag,
                rate_limit=self.pump_rate,
                lost_command=self.lost_command,
            ),
        )

    def numbers(self, channel: int, weight_density: float) -> EngineNumbers:
        """Return what the compiled engine needs; `channel` counts its command, `weight_density` is ρ g [N/m3]."""
        return EngineNumbers(channel, weight_density, self.x, self.y, self.z)


@compiled
def add_engines(
    state: np.ndarray, R: np.ndarray, engines: tuple[EngineNumbers, ...], count: int, out: np.ndarray
) -> None:
    """Add the lift of all buoyancy engines to out (6,) [N, N m].

    Args:
        state: of the vehicle; those of the channels stand behind entry STATE_SIZE.
        R: R_nb.
        engines: MOST_ENGINES of them.
        count: how many count.
        out: the six components, added to.
    """
    for i in range(count):
        engine = engines[i]
        volume = state[STATE_SIZE + engine.channel] if STATE_SIZE + engine.channel < state.size else 0.0
        lift = -engine.lift_per_volume * volume
        X, Y, Z = lift * R[2, 0], lift * R[2, 1], lift * R[2, 2]
        out[0] += X
        out[1] += Y
        out[2] += Z
        out[3] += engine.y * Z - engine.z * Y
        out[4] += engine.z * X - engine.x * Z
        out[5] += engine.x * Y - engine.y * X


NO_ENGINE = EngineNumbers(0, 0.0, 0.0, 0.0, 0.0)
"""Fills the compiled list behind the last engine."""
