"""Command channels of the listed actuators: thrusters, fins, moving masses and buoyancy engines.

    s' = clip((clip((1 − c) command + offset, low, high) − s)/lag, ± rate limit)

Each channel is one command and one state that lags behind it. Both stand behind those of propeller, rudder and planes:
channel i is entry 4 + i of the command and entry STATE_SIZE + i of the state, in the order of `Vehicle.channels`. c is
the share of the command that is lost: with c = 1 the actuator is dead, or jammed at its offset. Lags shorter than
`vehicle.state.QUICKEST` count as that.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from sys import float_info

import numpy as np

from subzero.jit import compiled
from vehicle.state import QUICKEST, STATE_SIZE

MOST_CHANNELS = 16
"""The compiled numbers hold so many channels: one layout, so that all vehicles share one machine code."""
FIRST_COMMAND = 4
"""Commands of propeller, rudder and the two planes stand before those of the channels."""

(LOW, HIGH, LAG, RATE_LIMIT, OFFSET, LOST) = range(6)
COLUMNS = 6
"""Columns of the compiled table."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One command of a listed actuator, and the state that follows it.

    Attributes:
        name: of the command, as in a trial.
        meaning: in words.
        unit: of command and state.
        low: least value of the state.
        high: greatest value of the state.
        lag: time constant. [s]
        rate_limit: fastest change of the state, in its unit. [1/s]
        offset: state at zero command.
        lost_command: share of the command that is lost. [-]
    """

    name: str
    meaning: str
    unit: str
    low: float
    high: float
    lag: float
    rate_limit: float = inf
    offset: float = 0.0
    lost_command: float = 0.0

    def row(self) -> tuple[float, ...]:
        """Return the row of the compiled table (COLUMNS,)."""
        fastest = min(self.rate_limit, float_info.max)  # the compiled numbers are finite
        return (self.low, self.high, self.lag, fastest, self.offset, self.lost_command)


def table_of(channels: tuple[Channel, ...]) -> np.ndarray:
    """Return the compiled table (MOST_CHANNELS, COLUMNS), zeros after the last channel."""
    table = np.zeros((MOST_CHANNELS, COLUMNS))
    for row, channel in zip(table, channels, strict=False):
        row[:] = channel.row()
    return table


@compiled
def channel_rates(
    state: np.ndarray, command: np.ndarray, table: np.ndarray, count: int, out: np.ndarray
) -> None:
    """Fill the rates of the channels' states, out[STATE_SIZE …]; one that a command does not have is commanded to 0."""
    for i in range(min(count, state.size - STATE_SIZE)):
        row = table[i]
        given = command[FIRST_COMMAND + i] if FIRST_COMMAND + i < command.size else 0.0
        asked = (1.0 - row[LOST]) * given + row[OFFSET]
        wanted = max(row[LOW], min(row[HIGH], asked))
        rate = (wanted - state[STATE_SIZE + i]) / max(row[LAG], QUICKEST)
        out[STATE_SIZE + i] = max(-row[RATE_LIMIT], min(row[RATE_LIMIT], rate))
