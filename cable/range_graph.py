"""Range graphs: tension, declination, curvature and bend radius along a cable, as numbers and as a figure.

declination   angle of the cable to the horizontal, positive where it leads down [rad]
curvature     2 tan(θ/2)/ℓ̄ at a node where it turns by θ, ℓ̄ the mean of the segments next to it [1/m]
bend radius   1/curvature; infinite where the cable is straight [m]
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from cable.clamps import Clamps
    from cable.history import Equilibrium

LABELS = {
    "arc_length": ("m", "distance along the unstretched cable from the first end"),
    "position": ("m", "place of the nodes"),
    "tension": ("N", "tension at the nodes"),
    "declination": ("rad", "angle of the cable to the horizontal, positive where it leads down"),
    "curvature": ("1/m", "curvature at the nodes; 0 at ends that are hinges"),
    "bend_radius": ("m", "radius of the bend at the nodes; infinite where the cable is straight"),
}
"""Name in the dataset → unit and words."""
SHORTEST = 1e-30


def declinations(shape: np.ndarray) -> np.ndarray:
    """Return the declination at the nodes (nodes,) of a shape (nodes, 3), a mean of two segments. [rad]"""
    chords = np.diff(shape, axis=0)
    angles = np.arctan2(chords[:, 2], np.linalg.norm(chords[:, :2], axis=1))
    means: np.ndarray = np.concatenate([angles[:1], 0.5 * (angles[1:] + angles[:-1]), angles[-1:]])
    return means


def curvatures(shape: np.ndarray, clamps: Clamps | None = None) -> np.ndarray:
    """Return the curvature at the nodes (nodes,) of a shape (nodes, 3). [1/m]"""
    chords = np.diff(shape, axis=0)
    lengths = np.maximum(np.linalg.norm(chords, axis=1), SHORTEST)
    t = chords / lengths[:, None]
    if (
        clamps is not None
    ):  # a segment of no length beyond each end: along the clamp, or straight on from a hinge
        first, second = (way if way.any() else t[-k] for k, way in enumerate(clamps.tangents))
        t, lengths = np.vstack([first, t, second]), np.concatenate([[0.0], lengths, [0.0]])
    turned, along = np.linalg.norm(t[1:] - t[:-1], axis=1), np.linalg.norm(t[1:] + t[:-1], axis=1)
    bent = 2.0 * turned / np.maximum(along, SHORTEST) / (0.5 * (lengths[1:] + lengths[:-1]))
    ends = np.zeros(0 if clamps is not None else 1)
    return np.concatenate([ends, bent, ends])


def dataset_of(rest: Equilibrium) -> xr.Dataset:
    """Return a cable at rest as an xarray dataset over its nodes."""
    import xarray as xr  # heavy, and nothing else of a cable at rest needs it

    curvature = curvatures(rest.shape, rest.clamps)
    values = {
        "tension": rest.tensions,
        "declination": declinations(rest.shape),
        "curvature": curvature,
        "bend_radius": np.divide(1.0, curvature, out=np.full(curvature.shape, np.inf), where=curvature > 0.0),
    }
    arc = np.concatenate([[0.0], np.cumsum(rest.segment_lengths)])
    found = xr.Dataset(
        {name: ("node", value) for name, value in values.items()}
        | {"position": (("node", "earth_axis"), rest.shape)},
        coords={"arc_length": ("node", arc), "earth_axis": ["north", "east", "down"]},
    )
    for name, (unit, words) in LABELS.items():
        found[name].attrs.update(units=unit, long_name=words)
    return found


def figure_of(rest: Equilibrium) -> Figure:
    """Return the figure of a cable at rest: from the side, and its range graphs."""
    from matplotlib.figure import Figure

    run, figure = dataset_of(rest), Figure(figsize=(7.0, 5.0), dpi=110, layout="constrained")
    side, *graphs = figure.subplots(2, 2).ravel()
    x = run["position"].values
    away = np.linalg.norm(x[:, :2] - x[-1, :2], axis=1)
    side.plot(away, x[:, 2])
    if rest.bed is not None:
        rest_depth = rest.bed.below(x) / rest.bed.normal[2]
        side.plot(away, x[:, 2] - rest_depth, color="0.5", linewidth=1, label="sea bed")
        side.legend(frameon=False)
    side.invert_yaxis()
    side.set(xlabel="horizontal distance from the second end [m]", ylabel="down [m]")
    shown = {"tension": 1.0, "declination": 180.0 / np.pi, "curvature": 1.0}
    for axes, (name, factor) in zip(graphs, shown.items(), strict=True):
        axes.plot(run["arc_length"], factor * run[name])
        unit = "°" if name == "declination" else LABELS[name][0]
        axes.set(xlabel="distance along the cable [m]", ylabel=f"{name} [{unit}]")
    return figure
