"""The seven stories: what is hidden in which trial, and what the diagnosis should say to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from benchmarks.diagnosis.manoeuvres import braked_rich
from subzero.diagnosis.assessment import cruise, flown, rudder_doublets
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.results import CAUSE_NAMED, NOTHING_WRONG, OUT_OF_CATALOGUE, UNDECIDED
from subzero.external_force import MissingForce

BASIC = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")


def fig6(setting: Setting) -> Setting:
    """Return fig6 as it stands."""
    return setting


def straight_run(setting: Setting) -> Setting:
    """Return half a minute straight ahead, at the speed of fig6."""
    return flown(setting, [(0.0, cruise(setting), 0.0, 0.0, 0.0)], 30.0)


@dataclass(frozen=True, kw_only=True)
class Story:
    """A record with something hidden in it.

    Attributes:
        name: of the command.
        title: of the section.
        words: what happens, and what to look at.
        trial: (nominal setting of fig6) → that of the trial that is flown.
        hidden: effect id → deviations.
        missing: a force that is in no catalogue.
        begins: the log begins here. [s]
        channels: that are logged.
        expected: verdict.
        figures: that are shown.
        seed: of tolerances and noise.
    """

    name: str
    title: str
    words: str
    trial: Callable[[Setting], Setting] = fig6
    hidden: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    missing: MissingForce | None = None
    begins: float = 0.0
    channels: tuple[str, ...] = BASIC
    expected: str = CAUSE_NAMED
    figures: tuple[str, ...] = ("misfit",)
    seed: int = 1


def weed() -> MissingForce:
    """Return what a weed does that is caught at 9 s, drags more and more, and is lost at 21 s. [N]"""
    drag = {0.0: 0.0, 9.0: 0.0, 11.0: -0.25, 15.0: -0.45, 20.0: -0.6, 21.0: -0.1, 22.0: 0.0, 30.0: 0.0}
    return MissingForce(
        time=tuple(drag), wrench=tuple((force, 0.0, 0.0, 0.0, 0.0, 0.0) for force in drag.values())
    )


STORIES = (
    Story(
        name="healthy",
        title="1. A healthy vehicle",
        words="Every number of the vehicle, the cable and the sensors is a little off, as in any basin, and no more.",
        expected=NOTHING_WRONG,
        figures=(),
    ),
    Story(
        name="rudder_lag_with_doublets",
        title="2. A rudder that lags, found with doublets",
        words="The rudder's servo has a time constant of 0.40 s instead of 0.15 s. The trial is made for it.",
        trial=rudder_doublets,
        hidden={"rudder_lag": (0.25,)},
    ),
    Story(
        name="rudder_lag_on_fig6",
        title="3. The same rudder on the trial of Fig. 6",
        words="One short rudder pulse cannot separate a lag from other delays of a turn: a set is the answer,"
        " and the trial to fly next.",
        hidden={"rudder_lag": (0.25,)},
        expected=UNDECIDED,
        figures=("evidence",),
    ),
    Story(
        name="cable_drag_or_current",
        title="4. Drag along the cable, or a current?",
        words="A straight run; the log begins at 8 s, under way, and shows the shaft's speed, too. A following current "
        "of 0.55 m/s pays out more cable, which reads as more drag along it: speed through the "
        "water hardly shows the difference.",
        trial=straight_run,
        hidden={"current": (0.49, 0.25)},
        begins=8.0,
        channels=(*BASIC, "propeller_speed"),
        expected=UNDECIDED,
        figures=("evidence",),
    ),
    Story(
        name="battery_sag_or_cable",
        title="5. A battery that sags, or the cable?",
        words="Both let the speed fall slowly. A battery takes the propeller's torque along; the roll angle shows it.",
        hidden={"battery_sag": (0.20,)},
    ),
    Story(
        name="two_effects",
        title="6. Two causes at once",
        words="The propeller lost 30 % of its thrust and the rudder is 1.5 degrees off its centre.",
        trial=braked_rich,
        hidden={"propeller_thrust_gain": (-0.30,), "rudder_offset": (1.5,)},
    ),
    Story(
        name="weed_in_mid_run",
        title="7. A weed that is caught, and lost again",
        words="It drags at the hull from 9 to 21 s and is in no catalogue: its force is recovered as a history.",
        missing=weed(),
        expected=OUT_OF_CATALOGUE,
        figures=("missing_force",),
    ),
)  # fmt: skip
