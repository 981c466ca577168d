"""A tether as a functional mock-up unit (FMI 2, co-simulation), for hosts such as OpenModelica, Simulink or FMPy.

    >>> from subzero.fmu import export_fmu                       # pip install "subzero-auv[fmu]"
    >>> path = export_fmu("tether.fmu", length=30.0)             # doctest: +SKIP

The unit holds one `cable.Tether`, and gives its numbers. It needs Python with this package where it runs: in the file
are a loader of Python (pythonfmu) and a few lines that name `TetherSlave`.

variable                                             causality   unit
---------------------------------------------------  ----------  ----------------------------------------------------
first_north … second_down                            input       m, places of the ends at the end of the step
first_velocity_north … second_velocity_down          input       m/s, their velocities then
pay_out_rate                                         input       m/s, of a winch at the second end; negative reels in
first_force_north … second_force_down                output      N, force of the tether on its ends, then
length, first_tension, second_tension, inner_steps   output      m, N, N, 1
cable.mass_per_length …                              parameter   as in `cable.CableProperties`
length_at_start, segments, longest                   parameter   m, 1, m (0: no limit)
current_north, current_east, current_down            parameter   m/s

A host steps its vehicle first, sets places and velocities as they are at the end of the step, then steps the tether.
The places that are set before initialisation ends are those of the start. States are got and set (reject and retry).
"""

from __future__ import annotations

import pickle
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import SubElement

import numpy as np

from cable import CableProperties, PayOutRate, Tether
from subzero.arguments import checked_arguments
from subzero.errors import BadValueError, UserError, checked, missing_extra, whole

try:
    from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, FmuBuilder, Real
    from pythonfmu.enums import Fmi2Initial, Fmi2Status
except ImportError as missing:  # pragma: no cover - reported to the user
    raise missing_extra("A functional mock-up unit", "pythonfmu", "fmu") from missing

AXES = ("north", "east", "down")
ENDS = ("first", "second")
PLACES = tuple(f"{end}_{axis}" for end in ENDS for axis in AXES)
VELOCITIES = tuple(f"{end}_velocity_{axis}" for end in ENDS for axis in AXES)
FORCES = tuple(f"{end}_force_{axis}" for end in ENDS for axis in AXES)
RESULTS = ("length", "first_tension", "second_tension", "inner_steps")
NUMBERS = ("length_at_start", "segments", "longest", "current_north", "current_east", "current_down")
SCRIPT = '''"""A tether, made by subzero export-fmu."""

from subzero.fmu import TetherSlave

# The loader (pythonfmu 0.7) gives up one reference too many to the names of this module for each unit that it makes,
# and Python would crash when it ends: here is one more for each.
KEPT = []


class {name}(TetherSlave):
    """The tether, with the numbers that it was exported with."""

    start = {start!r}

    def __init__(self, **given):
        """Begin."""
        KEPT.append(globals())
        super().__init__(**given)
'''


class TetherSlave(Fmi2Slave):
    """A tether that a master of a co-simulation steps; the module lists its variables."""

    start: dict[str, float] = {}  # noqa: RUF012  # of the class that `export_fmu` writes
    author = "subzero"
    description = "A cable in water between two ends that a host moves"

    def __init__(self, **kwargs: Any) -> None:
        """Declare the variables, with the numbers of `start`."""
        super().__init__(**kwargs)
        given = {f"cable.{name}": value for name, value in asdict(CableProperties()).items()}
        given |= dict.fromkeys((*NUMBERS, *PLACES, *VELOCITIES, "pay_out_rate"), 0.0)
        self.values = given | dict.fromkeys((*FORCES, *RESULTS), 0.0) | dict(self.start)
        self.tether: Tether | None = None
        for name in self.values:
            kind = {"variability": Fmi2Variability.continuous}
            if name in FORCES + RESULTS:
                kind["causality"] = Fmi2Causality.output
            elif name in (*PLACES, *VELOCITIES, "pay_out_rate"):
                kind["causality"] = Fmi2Causality.input
            else:
                kind = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
                kind["initial"] = Fmi2Initial.exact
            access = {"getter": lambda name=name: self.values[name], "setter": self._setter(name)}
            self.register_variable(Real(name, **kind, **access), nested=False)

    def to_xml(self, model_options: dict[str, str] | None = None) -> Any:
        """Return the description, with the outputs among the unknowns that initialisation computes."""
        root = super().to_xml(model_options or {})
        structure = root.find("ModelStructure")
        unknowns = SubElement(structure, "InitialUnknowns")
        for output in structure.find("Outputs"):
            SubElement(unknowns, "Unknown", {"index": output.get("index")})
        return root

    def exit_initialization_mode(self) -> None:
        """Lay the tether out between the places that were set."""
        values = self.values
        properties = CableProperties(
            **{
                name.removeprefix("cable."): value
                for name, value in values.items()
                if name.startswith("cable.")
            }
        )
        self.tether = Tether(
            properties,
            length=values["length_at_start"],
            ends=self._ends(),
            winch=PayOutRate(rate=0.0),
            longest=values["longest"] or None,
            segments=int(values["segments"]),
            current=[values[f"current_{axis}"] for axis in AXES],
        )
        self._give(self.tether.forces)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on by a step, to the places that were set; False, with the reason in the log, where that is refused."""
        if self.tether is None:
            self.log("The tether was not initialised.", Fmi2Status.error)
            return False
        try:
            winch = PayOutRate(rate=self.values["pay_out_rate"])
            self._give(self.tether.step(step_size, self._ends(), winch))
        except UserError as error:
            self.log(str(error), Fmi2Status.error)
            return False
        return True

    def _setter(self, name: str) -> Any:
        """Return what sets a variable."""

        def set_value(value: float) -> None:
            self.values[name] = float(value)

        return set_value

    def _ends(self) -> np.ndarray:
        """Return places and velocities of the ends, as they are set (2, 2, 3)."""
        places, velocities = (
            np.array([self.values[name] for name in names]).reshape(2, 3) for names in (PLACES, VELOCITIES)
        )
        return np.stack([places, velocities], axis=1)

    def _give(self, forces: np.ndarray) -> None:
        """Fill the outputs."""
        assert self.tether is not None
        tensions = self.tether.tension
        results = (self.tether.length, tensions[0], tensions[-1], self.tether.inner_steps)
        self.values.update(zip(FORCES + RESULTS, map(float, (*forces.ravel(), *results)), strict=True))

    def _get_fmu_state(self) -> dict[str, Any]:
        """Return the state that a master keeps, to come back to."""
        return {"values": dict(self.values), "tether": None if self.tether is None else self.tether.save()}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        """Return to a state."""
        self.values.update(state["values"])
        if self.tether is not None and state["tether"] is not None:
            self.tether.restore(state["tether"])

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return pickle.dumps(state)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        kept: dict[str, Any] = pickle.loads(state)
        return kept


@checked_arguments
def export_fmu(
    path: str | Path,
    *,
    length: float,
    cable: CableProperties | None = None,
    segments: int = 50,
    longest: float | None = None,
    current: tuple[float, float, float] = (0.0, 0.0, 0.0),
    name: str = "Tether",
) -> Path:
    """Write a tether as a functional mock-up unit; return its path.

    Args:
        path: of the file, which ends in ``.fmu``.
        length: unstretched, at the start. [m]
        cable: the cable; Table 1 of the source when not given. Each of its numbers is a parameter of the unit.
        segments: how many.
        longest: all cable that there is, in the water and on the drum; without limit when not given. [m]
        current: velocity of the water north, east, down. [m/s]
        name: of the model, one word.

    Raises:
        subzero.UserError: a number that makes no sense, a name that is no word, a path that does not end in ``.fmu``.
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise BadValueError(
            f"export_fmu: path is {str(path)!r}; the name of a functional mock-up unit ends in .fmu."
        )
    if not name.isidentifier():
        raise BadValueError(
            f"export_fmu: name is {name!r}; it must be one word of letters, digits and underscores."
        )
    start = {f"cable.{field}": value for field, value in asdict(cable or CableProperties()).items()}
    start["length_at_start"] = checked("export_fmu", "length", length, above=0.0, unit="m")
    start["segments"] = float(whole("export_fmu: segments", segments, least=1))
    start["longest"] = (
        0.0 if longest is None else checked("export_fmu", "longest", longest, least=length, unit="m")
    )
    start |= {f"current_{axis}": float(speed) for axis, speed in zip(AXES, current, strict=True)}
    start["first_north"] = 0.9 * length  # a tether that hangs, until a host says where its ends are
    _try(cable, start)
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / f"{name.lower()}_exported.py"
        script.write_text(SCRIPT.format(name=name, start=start), encoding="utf-8")
        states: dict[str, Any] = {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True}
        FmuBuilder.build_FMU(script, dest=path, **states)
    return path


def _try(cable: CableProperties | None, start: dict[str, float]) -> None:
    """Make such a tether and step it: what it refuses is refused here, and its compiled code is kept for the unit."""
    ends = [(start["first_north"], 0.0, 0.0), (0.0, 0.0, 0.0)]
    current = [start[f"current_{axis}"] for axis in AXES]
    Tether(
        cable, length=start["length_at_start"], ends=ends, segments=int(start["segments"]), current=current
    ).step(1e-3, ends)
