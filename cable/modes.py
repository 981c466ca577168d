"""Natural modes of a cable about its equilibrium: frequencies, shapes, tensions and damping.

Small displacements u of the nodes and changes τ of the segments' tensions, in the equations of a step
(`moving_end.assembly`):

    M ü + K u + Bᵀ τ = 0,   B u = C τ,   (u, τ) ~ exp(iωt)

M   momentum of the segments, each at the mean velocity of its nodes: ℓ (m I + C_aρA P), P = I − t tᵀ; and the bodies
K   tension that turns, T P/r; bending, EI |P u′|² between neighbours and at clamps; the bed, whose friction sticks
B   stretch t·(u_j − u_{j−1});  C = eℓ, its share per newton: 0 for a cable that does not stretch

With M = W Wᵀ, 1/ω² are the eigenvalues of Wᵀ G W, where G takes forces on the nodes to their displacements at rest, so
cables that stretch and those that do not need no cases. Frequencies are right to second order in the segments: the
n-th of a taut string of N segments is (nπ/N)²/12 too high.

The damping ratio is uᵀDu/(2ω uᵀMu), with the drag linearised about the current (none in still water), internal damping
and the bed's. Left out: drag that turns with the cable, and shifts of frequency by damping (ω√(1 − ζ²)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import splu

from cable.doubts import SLACK_SHARE
from cable.sea_bed import ROUNDED, SeaBed
from cable.sections import COLUMNS, SectionedCable
from subzero.errors import UserError, whole
from subzero.files.text_repr import Overview, shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from cable.history import Equilibrium

MOST_SEGMENTS = 1000
"""Matrices are full: with more segments they take minutes, and gigabytes."""
SINGULAR = 1e-12
"""An eigenvalue that is smaller than this share of the largest is rounding: the cable has no such mode. [-]"""
LEAST_STRETCH = 1e-12
"""Strain that every cable takes under its largest tension: the tension of a straight one is not determined else. [-]"""
STILL = 1e-12
"""A slower flow has no direction. [m/s]"""
SHOWN = 6
"""So many modes are drawn."""
LABELS = {
    "mode": ("1", "number of the mode, from the lowest frequency on"),
    "frequency": ("Hz", "natural frequency, undamped"),
    "period": ("s", "natural period, undamped"),
    "damping_ratio": ("1", "damping as a share of critical"),
    "arc_length": ("m", "distance along the unstretched cable from the first end"),
    "position": ("m", "place of the nodes at rest"),
    "shape": ("1", "displacement of the nodes, as a share of the largest"),
    "segment_tension": ("N/m", "change of tension in the segments per metre of the largest displacement"),
}
"""Name in the dataset → unit and words."""


@shown
@dataclass(frozen=True, kw_only=True)
class Modes:
    """The natural modes of a cable, from the lowest frequency on.

    Where two have the same frequency, as of a straight cable, any mixture of their shapes is a mode, too, and their
    damping is shared out accordingly.

    Attributes:
        frequencies: natural frequencies, undamped (modes,). [Hz]
        damping_ratios: damping as a share of critical (modes,); 0 in still water without internal damping. [-]
        shapes: displacements of the nodes, north, east, down, the largest of a mode 1 (modes, nodes, 3). [-]
        segment_tensions: change of tension per metre of the largest displacement (modes, segments). [N/m]
        arc_length: of the nodes, unstretched, from the first end (nodes,). [m]
        position: of the nodes at rest (nodes, 3). [m]
    """

    frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    segment_tensions: np.ndarray
    arc_length: np.ndarray
    position: np.ndarray

    @property
    def periods(self) -> np.ndarray:
        """Natural periods (modes,). [s]."""
        periods: np.ndarray = 1.0 / self.frequencies
        return periods

    def to_dataset(self) -> xr.Dataset:
        """Return frequencies, periods, damping, shapes and tensions by mode and node, with units and words.

        >>> import cable
        >>> string = cable.CableProperties(compliance=1e-6)
        >>> modes = cable.hold([(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)], 9.9, cable=string).modes(4).to_dataset()
        >>> modes["shape"].dims, modes["period"].attrs["units"]
        (('mode', 'node', 'earth_axis'), 's')
        """
        import xarray as xr  # heavy, and nothing else of the modes needs it

        values = {
            "frequency": ("mode", self.frequencies),
            "period": ("mode", self.periods),
            "damping_ratio": ("mode", self.damping_ratios),
            "shape": (("mode", "node", "earth_axis"), self.shapes),
            "segment_tension": (("mode", "segment"), self.segment_tensions),
            "position": (("node", "earth_axis"), self.position),
        }
        coordinates = {
            "mode": np.arange(1, self.frequencies.size + 1),
            "arc_length": ("node", self.arc_length),
            "earth_axis": ["north", "east", "down"],
        }
        found = xr.Dataset(values, coords=coordinates)
        for name, (unit, words) in LABELS.items():
            found[name].attrs.update(units=unit, long_name=words)
        return found

    def plot(self) -> Figure:
        """Return a matplotlib figure of the lowest modes: displacement north, east and down along the cable."""
        from matplotlib.figure import Figure

        count = min(self.frequencies.size, SHOWN)
        figure = Figure(figsize=(7.0, 0.8 + 1.2 * count), dpi=110, layout="constrained")
        panels = figure.subplots(count, 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for k, axes in enumerate(panels):
            axes.plot(self.arc_length, self.shapes[k], label=["north", "east", "down"])
            axes.set(
                title=f"mode {k + 1}: {self.periods[k]:.4g} s, {self.frequencies[k]:.4g} Hz", ylabel="shape"
            )
        panels[0].legend(frameon=False, ncols=3)
        panels[-1].set_xlabel("distance along the cable [m]")
        return figure

    def _overview(self) -> Overview:
        """Return period, frequency and damping of each."""
        rows = [
            (f"mode {k + 1}", f"{1.0 / f:.4g} s, {f:.4g} Hz, damping {100.0 * z:.3g} % of critical")
            for k, (f, z) in enumerate(zip(self.frequencies, self.damping_ratios, strict=True))
        ]
        return Overview("Natural modes of a cable", [*rows, ("more", "shapes, to_dataset(), plot()")])


def find_modes(rest: Equilibrium, count: int, *, free_end: bool = False) -> Modes:
    """Return the modes of lowest frequency about an equilibrium, its ends held, or its second end free.

    Raises:
        subzero.UserError: a cable that is slack, that nothing brings back to its shape, or of too many segments.
    """
    count, N = whole("modes: count", count, least=1), rest.segment_lengths.size
    if N > MOST_SEGMENTS:
        raise UserError(
            f"modes: the cable has {N} segments; at most {MOST_SEGMENTS} can be. Take longer ones."
        )
    share = rest.slack_length / rest.length
    if share > SLACK_SHARE:
        raise UserError(
            f"modes: {100.0 * share:.3g} % of the cable is slack, and has no shape to vibrate about. Give it less "
            "length, or weight."
        )
    if rest.surface is not None and rest.shape[:, 2].min() < rest.surface + 0.5 * rest.cable.diameter:
        raise UserError(
            "modes: part of the cable is at the free surface, where its weight changes as it moves. Modes are of a "
            "cable under water: hold it without a surface, or deeper."
        )
    parts, moving = _small_motion(rest), slice(3, 3 * (N + 1 if free_end else N))
    displaced, pulled, squares = _lowest(parts, moving, count)
    u = np.zeros((3 * (N + 1), squares.size))
    u[moving] = displaced
    drag = np.einsum("ij,ij->j", u, parts.drag @ u) + parts.inner @ (pulled * pulled)
    inertia, omega = ((parts.root.T @ u) ** 2).sum(axis=0), squares**-0.5
    size = np.linalg.norm(u.reshape(N + 1, 3, -1), axis=1).max(axis=0)
    size *= np.sign(u[np.abs(u).argmax(axis=0), np.arange(squares.size)])  # the largest component is positive
    return Modes(
        frequencies=omega / (2.0 * np.pi),
        damping_ratios=0.5 * drag / (omega * inertia),
        shapes=(u / size).T.reshape(-1, N + 1, 3),
        segment_tensions=(pulled / size).T,
        arc_length=np.concatenate([[0.0], np.cumsum(rest.segment_lengths)]),
        position=rest.shape.copy(),
    )


class _SmallMotion(NamedTuple):
    """The matrices of the small motions of all nodes, held ones as well.

    Attributes:
        stiffness: K (3 nodes, 3 nodes). [N/m]
        root: W (3 nodes, columns), M = W Wᵀ. [√kg]
        stretch, compliance: B (segments, 3 nodes) [-], and the diagonal of C (segments,) [m/N].
        drag: D of water, bodies and bed (3 nodes, 3 nodes). [N s/m]
        inner: what internal damping takes, per square of a tension (segments,). [m² s/N]
    """

    stiffness: Any
    root: Any
    stretch: Any
    compliance: np.ndarray
    drag: Any
    inner: np.ndarray


def _lowest(parts: _SmallMotion, moving: slice, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacements (moving, modes), tensions (segments, modes) and 1/ω² (modes,) of the lowest modes."""
    B, W = parts.stretch[:, moving], parts.root[moving].toarray()
    static = [[parts.stiffness[moving, moving], B.T], [B, -sparse.diags_array(parts.compliance)]]
    try:
        factors = splu(sparse.block_array(static, format="csc"))
    except RuntimeError:  # exactly singular
        raise UserError(
            "modes: nothing brings the cable back to its shape. Give it tension, by less length, or weight."
        ) from None
    answer = factors.solve(np.vstack([W, np.zeros((B.shape[0], W.shape[1]))]))
    flexibility = W.T @ answer[: W.shape[0]]
    most = flexibility.shape[0]
    squares, y = linalg.eigh(
        0.5 * (flexibility + flexibility.T), subset_by_index=[max(most - count, 0), most - 1]
    )
    there = squares > SINGULAR * squares[-1]  # no number is above no number
    squares, found = squares[there][::-1], answer @ y[:, there][:, ::-1]
    return found[: W.shape[0]], found[W.shape[0] :], squares


def _small_motion(rest: Equilibrium) -> _SmallMotion:
    """Return the matrices of an equilibrium."""
    lengths, T, N = rest.segment_lengths, rest.segment_tensions, rest.segment_lengths.size
    chord, c, flow = np.diff(rest.shape, axis=0), _along(rest.cable, lengths), _flow(rest)
    r = np.linalg.norm(chord, axis=1)
    t = chord / r[:, None]
    tt = np.einsum("ji,jk->jik", t, t)
    P, each = np.eye(3) - tt, (slice(None), None, None)
    step = sparse.diags_array([-np.ones(N), np.ones(N)], offsets=[0, 1], shape=(N, N + 1))
    between = sparse.kron(step, sparse.eye_array(3), format="csr")
    middle = sparse.kron(0.5 * abs(step), sparse.eye_array(3), format="csr")
    stiffness = between.T @ _blocks((T / r)[each] * P) @ between
    if rest.cable.bending_stiffness > 0.0:
        turned = _blocks(P / r[each]) @ between
        hinge = np.repeat(2.0 * rest.cable.bending_stiffness / (lengths[1:] + lengths[:-1]), 3)
        bent = sparse.diags_array(np.sqrt(hinge)) @ (turned[3:] - turned[:-3])
        stiffness = stiffness + bent.T @ bent
        for j in _clamped(rest):
            held = np.sqrt(2.0 * rest.cable.bending_stiffness / lengths[j]) * turned[3 * j : 3 * j + 3]
            stiffness = stiffness + held.T @ held
    along, across = np.sqrt(lengths * c["mass"]), np.sqrt(lengths * (c["mass"] + c["added_mass"]))
    wet = lengths * np.sqrt(1.0 + c["compliance"] * T)
    drag = _drag_slopes(0.5 * (flow[1:] + flow[:-1]), t, wet * c["tangential_drag"], wet * c["normal_drag"])
    parts = _SmallMotion(
        stiffness,
        middle.T @ _blocks(along[each] * tt + across[each] * P),
        _blocks(t[:, None, :]) @ between,
        np.maximum(c["compliance"], LEAST_STRETCH / max(T.max(), SINGULAR)) * lengths,
        middle.T @ _blocks(drag) @ middle,
        c["retardation"] * c["compliance"] * lengths,
    )
    parts = _with_bodies(parts, rest, flow) if isinstance(rest.cable, SectionedCable) else parts
    return parts if rest.bed is None else _with_bed(parts, rest, rest.bed, c)


def _clamped(rest: Equilibrium) -> list[int]:
    """Return the segments at clamped ends."""
    ways = (rest.clamps.first, rest.clamps.second) if rest.clamps else (None, None)
    return [j for j, way in zip((0, rest.segment_lengths.size - 1), ways, strict=True) if way is not None]


def _with_bodies(parts: _SmallMotion, rest: Equilibrium, flow: np.ndarray) -> _SmallMotion:
    """Return the matrices with mass and drag of the bodies at their nodes."""
    arc, density = np.cumsum(rest.segment_lengths), rest.cable.water_density
    root, drag = [parts.root], np.zeros((arc.size + 1, 3, 3))
    for body in rest.cable.bodies:  # type: ignore[union-attr]
        j = 1 + int(np.abs(arc - body.place).argmin())
        mass, U = body.mass + density * body.added_mass_coefficient * body.volume, flow[j]
        speed = max(float(np.linalg.norm(U)), STILL)
        drag[j] += 0.5 * density * body.drag_area * (speed * np.eye(3) + np.outer(U, U) / speed)
        root.append(
            sparse.csr_array((3 * [np.sqrt(mass)], (3 * j + np.arange(3), np.arange(3))), (drag.size // 3, 3))
        )
    return parts._replace(root=sparse.hstack(root, format="csr"), drag=parts.drag + _blocks(drag))


def _with_bed(parts: _SmallMotion, rest: Equilibrium, bed: SeaBed, c: dict[str, np.ndarray]) -> _SmallMotion:
    """Return the matrices with pressure, damping and friction of the bed at the nodes between the ends."""
    x = rest.shape
    n, soft, p = bed.normal, ROUNDED * rest.cable.diameter, np.maximum(bed.below(x)[1:-1], 0.0)
    length = 0.5 * (rest.segment_lengths[1:] + rest.segment_lengths[:-1])
    k, by_p = bed.modulus * c["diameter"][:-1], length * np.minimum(p / soft, 1.0)
    pressure = length * k * np.where(p < soft, 0.5 * p * p / soft, p - 0.5 * soft)
    lies = x[2:] - x[:-2]
    lies -= np.outer(lies @ n, n)
    lies /= np.maximum(np.linalg.norm(lies, axis=1), STILL)[:, None]
    rubs = np.array([bed.axial_friction, bed.lateral_friction])
    rate, (axial, lateral) = rubs.max() / (bed.slip * rest.cable.diameter), rubs > 0.0
    nn, ee = np.outer(n, n), np.einsum("ji,jk->jik", lies, lies)
    sticks = axial * ee + lateral * (np.eye(3) - nn - ee)
    damping = 2.0 * bed.damping_ratio * np.sqrt(k * (c["mass"] + c["added_mass"])[:-1])
    ends = ((1, 1), (0, 0), (0, 0))
    pressed = (k * by_p)[:, None, None] * nn + (rate * pressure)[:, None, None] * sticks
    return parts._replace(
        stiffness=parts.stiffness + _blocks(np.pad(pressed, ends)),
        drag=parts.drag + _blocks(np.pad((damping * by_p)[:, None, None] * nn, ends)),
    )


def _drag_slopes(U: np.ndarray, t: np.ndarray, kt: np.ndarray, kn: np.ndarray) -> np.ndarray:
    """Return ∂D/∂V of segments in a flow U (n, 3): 2 k_t|U_t| t tᵀ + k_n (|U_⊥| P + U_⊥ U_⊥ᵀ/|U_⊥|) (n, 3, 3)."""
    along = np.einsum("ji,ji->j", U, t)
    across = U - along[:, None] * t
    speed = np.linalg.norm(across, axis=1)
    tt, each = np.einsum("ji,jk->jik", t, t), (slice(None), None, None)
    bent = np.einsum("ji,jk->jik", across, across) / np.maximum(speed, STILL)[each]
    slopes: np.ndarray = (2.0 * kt * abs(along))[each] * tt
    slopes += kn[each] * (speed[each] * (np.eye(3) - tt) + bent)
    return slopes


def _flow(rest: Equilibrium) -> np.ndarray:
    """Return the velocity of the water at the nodes (nodes, 3). [m/s]"""
    return np.array([rest.current.at(place) for place in rest.shape])


def _along(cable: Any, lengths: np.ndarray) -> dict[str, np.ndarray]:
    """Return the numbers of `CableNumbers` and the diameter of each segment (segments,), by name."""
    cables, ends = [cable], np.zeros(0)
    if isinstance(cable, SectionedCable):
        cables = [section.cable for section in cable.sections]
        ends = np.cumsum([section.length for section in cable.sections])[:-1]
    which = np.searchsorted(ends, np.cumsum(lengths) - 0.5 * lengths)
    numbers: list[Any] = [each.numbers() for each in cables]
    found = {name: np.array([c[name] for c in numbers])[which] for name in COLUMNS[:7]}
    return found | {"diameter": np.array([each.diameter for each in cables])[which]}


def _blocks(parts: np.ndarray) -> Any:
    """Return the block diagonal matrix of parts (n, rows, columns)."""
    return sparse.bsr_array((parts, np.arange(len(parts)), np.arange(len(parts) + 1))).tocsr()
