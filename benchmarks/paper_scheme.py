"""What the paper's scheme does when run as printed: the numbers of ``docs/paper_scheme.md`` and its figure.

    python -m benchmarks.paper_scheme            prints the tables
    python -m benchmarks.paper_scheme --figure   draws docs/figures/paper_scheme.png as well

Section 4.1 of the paper: Table 1, straight pull (i) and dive (ii), tow point half a metre behind the centre.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np

import cable
from cable.feng_allen.run import run_paper
from cable.task import PullOut

DRAG = cable.CableProperties().tangential_drag
FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "paper_scheme.png"


def pull_out_paper(tow_velocity, duration, step, *, reading="tangent", implicit=False) -> cable.History:
    """Run the paper's scheme."""
    scheme = cable.Paper(time_step=step, reading=reading, implicit=implicit)
    return cable.pull_out(tow_velocity, duration, scheme=scheme)


def pull_out_boxes(tow_velocity, duration, step) -> cable.History:
    """Run equation (7) in boxes."""
    return cable.pull_out(tow_velocity, duration, scheme=cable.Equation7(time_step=step))


def ahead(_time):
    """Give 1 m/s to the north."""
    return 1.0, 0.0, 0.0


def stop(time):
    """Give 1 m/s, and nothing from 10 s on."""
    return (1.0 if time < 10.0 else 0.0), 0.0, 0.0


def dive(time):
    """Pitch down at 6°/s between 10 and 20 s; velocity of the tow point at (−0.5, 0, 0)."""
    rate = np.radians(-6.0) if 10.0 < time <= 20.0 else 0.0
    pitch, w = np.radians(-6.0) * np.clip(time - 10.0, 0.0, 10.0), 0.5 * rate
    return np.cos(pitch) + w * np.sin(pitch), 0.0, -np.sin(pitch) + w * np.cos(pitch)


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def straight_table() -> str:
    """Tow tension of the straight pull at Δt = 1 s, every scheme beside the exact value (37)."""
    runs = [
        pull_out_paper(ahead, 30.0, 1.0),
        pull_out_paper(ahead, 30.0, 1.0, implicit=True),
        pull_out_paper(ahead, 30.0, 1.0, reading="drum"),
        cable.pull_out(ahead, 30.0, scheme=cable.MovingEnd(time_step=1.0)),
    ]
    head = [
        "t [s]",
        "exact (37)",
        "tangent continued",
        "the same, implicit",
        "wound on the drum",
        "moving end",
    ]
    rows = [
        [str(k), f"{DRAG * k:.4f}", *(f"{run.tow_tension[k]:.4f}" for run in runs)]
        for k in (1, 2, 3, 4, 5, 6, 29, 30)
    ]
    return table(head, rows)


def dive_table() -> str:
    """Tension and length at the end of the dive against the time step."""
    rows = []
    for step in (1.0, 0.5, 0.25, 0.1):
        runs = [pull_out_paper(dive, 30.0, step, implicit=implicit) for implicit in (False, True)]
        ours = cable.pull_out(dive, 30.0, scheme=cable.MovingEnd(time_step=step))
        boxes = pull_out_boxes(dive, 30.0, step)
        cells = [f"{run.tow_tension[-1]:.3f}, {run.length[-1]:.2f}" for run in (*runs, ours, boxes)]
        rows.append([f"{step:g}", f"{jitter(runs[0]):.4f}", *cells])
    head = ["Δt [s]", "jitter [N]", "tangent continued", "the same, implicit", "moving end", "equation7"]
    return table(head, rows)


def jitter(run: cable.History) -> float:
    """Return the largest kink of the tow tension, T(t − Δt) − 2 T(t) + T(t + Δt), from 22 s on. [N]."""
    return float(np.abs(np.diff(run.tow_tension, 2))[run.time[1:-1] >= 22.0].max())


def drum_table() -> str:
    """How the printed state of the new node fares on a straight line, where nothing may bend."""
    rows = []
    for step in (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.005):
        duration, scheme = 30.0 if step >= 0.02 else 5.0, cable.Paper(time_step=step, reading="drum")
        run = cable.pull_out(ahead, duration, scheme=scheme)
        record, _ = run_paper(PullOut(tow_velocity=ahead, duration=duration), scheme)
        bend = max(float(np.abs(y[:, 5] - np.pi).max()) for y in record.states)
        side = float(np.abs(run.tow_force[:, 2]).max())
        end = "runs to 30 s" if run.outcome.completed else f"Newton fails at {run.time[-1] + step:.3g} s"
        error = float(np.abs(run.tow_tension - DRAG * run.length).max())
        rows.append([f"{step:g}", f"{step / 0.1:g}", f"{bend:.1f}", f"{error:.3f}", f"{side:.3f}", end])
    head = [
        "Δt [s]",
        "ΔS/R_d [rad]",
        "worst angle [rad]",
        "worst error of T(0) [N]",
        "force sideways [N]",
        "outcome",
    ]
    return table(head, rows)


def stop_table() -> str:
    """Tow tension around a stop at 10 s; afterwards the cable lies still and T is zero."""
    runs = [
        pull_out_paper(stop, 14.0, 1.0),
        pull_out_paper(stop, 14.0, 1.0, implicit=True),
        cable.pull_out(stop, 14.0, scheme=cable.MovingEnd(time_step=1.0)),
    ]
    rows = [[str(k), *(f"{run.tow_tension[k] + 0.0:.4f}" for run in runs)] for k in range(8, 15)]
    return table(["t [s]", "tangent continued", "the same, implicit", "moving end"], rows)


def coupled_table() -> str:
    """How the trial of Fig. 6 fares coupled as the paper prints it, beside the default scheme at 0.1 s."""
    import subzero

    trial, ours = subzero.load_scenario("fig6"), subzero.simulate("fig6")
    rows = []
    for step in (1.0, 0.5, 0.2, 0.1):
        run = subzero.simulate(dataclasses.replace(trial, scheme="paper_tangent", cable_step=step))
        time, cells = run["time"].values, [f"{step:g}"]
        for name, scale in (("surge_speed", 1e3), ("cable_tension", 1e3), ("heading", 1.0)):
            there = np.interp(time, ours["time"].values, ours[name].values)
            cells.append(f"{scale * np.abs(run[name].values - there).max():.2f}")
        stopped = run.attrs["outcome"] == "stopped"
        rows.append([*cells, f"stops after {time[-1]:g} s" if stopped else f"runs to {time[-1]:g} s"])
    return table(["Δt [s]", "speed [mm/s]", "T(0) [mN]", "heading [degree]", "outcome"], rows)


TABLES = {
    "Straight pull at Δt = 1 s: T(0) [N]": straight_table,
    "The dive: T(0) [N] and S [m] at 30 s": dive_table,
    "The wound tangent on a straight line": drum_table,
    "The vehicle stops at 10 s: T(0) [N]": stop_table,
    "Fig. 6, coupled: largest difference from the default scheme": coupled_table,
}


def draw() -> None:
    """Draw staircase, dive, stop and the wound tangent."""
    from subzero.figures.style import BLUE, GREEN, INK, ORANGE, sheet

    figure, (stairs, down, rest, bend) = sheet(2, 2, "The scheme of Feng and Allen (2004), as printed")
    time = np.linspace(0.0, 12.0, 50)
    run = pull_out_paper(ahead, 12.0, 1.0)
    stairs.plot(time, DRAG * time, color=INK, linewidth=0.9, label="exact (37)")
    stairs.plot(
        run.time, run.tow_tension, "o-", color=ORANGE, markersize=3, linewidth=1, label="as printed, 1 s"
    )
    ours = cable.pull_out(ahead, 12.0, scheme=cable.MovingEnd(time_step=1.0))
    stairs.plot(ours.time, ours.tow_tension, "x", color=BLUE, markersize=4, label="moving end, 1 s")
    for step, colour in ((1.0, ORANGE), (0.1, GREEN)):
        run = pull_out_paper(dive, 30.0, step)
        down.plot(run.time, run.tow_tension, color=colour, linewidth=0.9, label=f"as printed, {step:g} s")
    ours = cable.pull_out(dive, 30.0, scheme=cable.MovingEnd(time_step=0.1))
    down.plot(ours.time, ours.tow_tension, color=BLUE, linewidth=1.2, label="moving end, 0.1 s")
    run, ours = (
        pull_out_paper(stop, 20.0, 1.0),
        cable.pull_out(stop, 20.0, scheme=cable.MovingEnd(time_step=1.0)),
    )
    rest.plot(
        run.time, run.tow_tension, "o-", color=ORANGE, markersize=3, linewidth=1, label="as printed, 1 s"
    )
    rest.plot(ours.time, ours.tow_tension, color=BLUE, linewidth=1.2, label="moving end, 1 s")
    for step, colour in ((1.0, ORANGE), (0.2, GREEN)):
        place = pull_out_paper(ahead, 30.0, step, reading="drum").shapes[-1]
        bend.plot(
            place[:, 0],
            place[:, 2],
            "o-",
            color=colour,
            markersize=2.5,
            linewidth=1,
            label=f"wound, {step:g} s",
        )
    bend.axhline(0.0, color=INK, linewidth=0.9, label="exact")
    bend.set_xlim(0.0, 6.0)
    bend.set_ylim(0.35, -0.15)
    words = {
        stairs: ("time [s]", "tow tension, straight pull [N]"),
        down: ("time [s]", "tow tension, dive [N]"),
        rest: ("time [s]", "tow tension, stop at 10 s [N]"),
        bend: ("north of the drum [m]", "below the drum [m]"),
    }
    for axes, (across, up) in words.items():
        axes.set_xlabel(across, fontsize=8)
        axes.set_ylabel(up, fontsize=8)
        axes.legend(fontsize=7, frameon=False)
    figure.subplots_adjust(hspace=0.42)
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURE)


def main() -> None:
    """Print all tables; draw the figure when asked."""
    for title, make in TABLES.items():
        print(f"### {title}\n\n{make()}\n")
    if "--figure" in sys.argv[1:]:
        draw()


if __name__ == "__main__":
    main()
