"""How hard a cable that comes taut pulls, against a mass on a spring and smaller steps:  python -m benchmarks.taut

    F = v √(M EA/L)

with the mass M of the vehicle in surge (its added mass included), its speed v at the last result before, and the
cable's length L. The closed form leaves out the propeller's pull (some newtons, which
counts in soft cables), the mass of the cable and its waves. The last columns are runs with steps a quarter and a
sixteenth as long. A cable that does not stretch has an impulse instead of a peak: M v of a plastic impact.

The processor time is that of `subzero.simulate`, with all the runs that prove it, and without compiling.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np

import scenarios
import subzero
from scenarios.parameters import with_vehicle
from subzero.engine.recording import Grid, Run
from subzero.simulation.run import run_trial

FINER = (1, 4, 16)
BRAKE = scenarios.Winch(control="brake")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A cable that comes taut.

    Attributes:
        name: what is special.
        stiffness: EA, None for a cable that does not stretch. [N]
        speed: of the vehicle at the start. [m/s]
        propeller: its command. [rev/s]
        length: of the cable at the start. [m]
        away: of the drum from the tow point, astern. [m]
        winch: the winch.
        vehicle: a shipped one.
        duration: of the run. [s]
    """

    name: str
    stiffness: float | None
    speed: float = 0.85
    propeller: float = 22.0
    length: float = 12.0
    away: float = 10.0
    winch: scenarios.Winch = BRAKE
    vehicle: str = "subzero2"
    duration: float = 5.0

    def trial(self) -> scenarios.Trial:
        """Return the trial."""
        base = subzero.load_scenario("fig6")
        start = replace(
            base.start,
            heading=0.0,
            surge_speed=self.speed,
            propeller_speed=self.propeller,
            wet_length=self.length,
            drum_north=-self.away,
            depth=5.0,
        )
        held = np.array([[self.propeller, 0.0, 0.0, 0.0]])
        made: dict[str, Any] = {
            "start": start,
            "commands": scenarios.Commands(time=np.zeros(1), values=held),
            "winch": self.winch,
            "duration": self.duration,
            "cable": dict(base.cable) | {"compliance": 1.0 / self.stiffness if self.stiffness else 0.0},
        }
        base = with_vehicle(base, self.vehicle)[0]
        return replace(base, **made)


def stop_after(seconds: float, rate: float) -> scenarios.Winch:
    """Return a winch that pays out at a rate [m/s] and stops within a tenth of a second."""
    return scenarios.Winch(
        control="pay_out_rate", time=(0.0, seconds, seconds + 0.1), setpoint=(rate, rate, 0.0)
    )


STIFFNESSES = (1e3, 1e4, 1e5, 1e6, 1e7, None)
CASES = (
    *(Case(name="0.85 m/s, 12 m", stiffness=stiffness) for stiffness in STIFFNESSES),
    Case(name="slow, 0.4 m/s", stiffness=1e5, speed=0.4, propeller=11.0, duration=8.0),
    Case(name="fast, 1.1 m/s", stiffness=3e4, speed=1.1, propeller=28.0),
    Case(name="long, 40 m", stiffness=1e5, length=40.0, away=38.0),
    Case(name="short, 4 m", stiffness=1e4, length=4.0, away=3.0),
    Case(name="the winch stops at 2 s", stiffness=1e5, winch=stop_after(2.0, 0.85), away=11.5),
    Case(
        name="REMUS 100, 1.5 m/s",
        stiffness=1e5,
        speed=1.5,
        propeller=25.0,
        vehicle="remus100",
        length=20.0,
        away=18.0,
    ),
)
REEL_IN = scenarios.Winch(control="pay_out_rate", time=(0.0,), setpoint=(-0.3,))


def finer_run(trial: scenarios.Trial, parts: int) -> Run:
    """Return a run with steps so many times shorter."""
    grid = Grid(trial.times(), parts)
    return run_trial(
        replace(trial, hull_step=trial.hull_step / parts), subzero.Model.of(trial), True, grid=grid
    )


def closed_form(case: Case, run: Run) -> float:
    """Return v √(M EA/L), or M v, of the speed at the last result before the cable pulls hard. [N, N s]"""
    trial = case.trial()
    mass = 1.0 / subzero.Model.of(trial).vehicle.own_numbers.inverse_mass[0, 0]
    pull = run.recording.trace[:, 5]
    taut = int(np.argmax(pull > 0.1 * pull.max()))
    speed = float(run.recording.state[max(taut - 1, 0), 7])
    length = float(run.recording.length[max(taut - 1, 0)])
    return mass * speed if case.stiffness is None else speed * float(np.sqrt(mass * case.stiffness / length))


def strength_of(run: Run) -> float:
    """Return the peak [N] or the impulse [N s] of a run."""
    return run.snap.get("peak_tension_N", run.snap["impulse_N_s"])


def row(case: Case) -> str:
    """Return the row of a case."""
    trial = case.trial()
    runs = [finer_run(trial, parts) for parts in FINER]
    began = process_time()
    doubts = subzero.simulate(trial).attrs["warnings"].count('"check"')
    spent = process_time() - began
    stiffness = "none" if case.stiffness is None else f"{case.stiffness:.0e}"
    numbers = "".join(f"{strength_of(run):10.2f}" for run in runs)
    ended = "yes" if all(run.completed for run in runs) else "NO"
    closed = closed_form(case, runs[0])
    return f"{case.name:26} {stiffness:>7} {closed:10.2f}{numbers} {ended:>5} {spent:7.2f} {doubts:5d}"


def reel_in(stiffness: float | None) -> str:
    """Return the row of a vehicle that is reeled in at 0.3 m/s from 40 m."""
    case = Case(
        name="reel-in",
        stiffness=stiffness,
        speed=0.0,
        propeller=0.0,
        length=40.0,
        away=39.9,
        winch=REEL_IN,
        duration=130.0,
    )
    run = finer_run(case.trial(), 1)
    return f"{stiffness or 'none':>7}  to {float(run.recording.length[-1]):5.2f} m  {run.message}"


def main() -> None:
    """Print the table."""
    subzero.simulate(CASES[0].trial())  # compiles
    head = ("EA [N]", "closed", "steps", "/4", "/16", "ends", "CPU [s]", "warn")
    widths = (8, 11, 10, 10, 10, 6, 8, 6)
    print(f"{'case':26}" + "".join(f"{word:>{width}}" for word, width in zip(head, widths, strict=True)))
    for case in CASES:
        print(row(case), flush=True)
    print("\nReel-in of 40 m at 0.3 m/s")
    for stiffness in STIFFNESSES:
        print(reel_in(stiffness), flush=True)


if __name__ == "__main__":
    main()
