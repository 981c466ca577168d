"""Records that nobody would make on purpose, each reproduced by its number.

One run of fig6 is sampled, with its speeds, angles and depth; then times, channels and the sidecar are spoiled: one
sample or none, 0.05 Hz to 1 kHz, ten hours, gaps all over, channels that are constant, empty, absurdly large or the
simulation's own to the last digit, noise that is declared absurdly.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import subzero

COLUMNS = {
    "surge_speed": "surge_speed_m_s", "heading": "heading_deg", "yaw_rate": "yaw_rate_deg_s", "pitch": "pitch_deg",
    "roll_angle": "roll_deg", "depth": "depth_m", "cable_tension": "cable_tension_N",
}  # fmt: skip
RATES_HZ = (0.05, 0.2, 1.0, 3.3, 10.0, 100.0, 1000.0)
SPANS_S = (0.0, 0.3, 2.0, 5.0, 7.0, 7.0, 15.0, 15.0, 30.0, 30.0)
MOST_SAMPLES = 20_000
TEN_HOURS_S = 36_000.0
KINDS = ("as it is", "jitter", "gap", "late", "early", "twice", "backwards", "none")
SHARES = (0.6, 0.15, 0.15, 0.02, 0.02, 0.02, 0.02, 0.02)


@cache
def flown() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times and channels of a run."""
    run = subzero.simulate("fig6")
    return run["time"].values, {name: run[name].values for name in COLUMNS}


def times_of(rng: np.random.Generator) -> np.ndarray:
    """Return times of samples (n,): evenly or not, few or many, early or late. [s]"""
    if rng.random() < 0.05:
        return np.linspace(0.0, TEN_HOURS_S, int(rng.integers(2, 2000)))
    rate, span = rng.choice(RATES_HZ), rng.choice(SPANS_S)
    times = np.arange(min(int(span * rate) + 1, MOST_SAMPLES)) / rate
    kind = rng.choice(KINDS, p=SHARES)
    if kind == "late":
        return times + rng.uniform(0.0, 40.0)
    if kind == "early":
        return times - rng.uniform(0.0, 5.0)
    if kind == "jitter":
        return np.sort(times + rng.normal(0.0, 0.3 / rate, times.size))
    if kind == "gap":
        return times[(times < 0.2 * span) | (times > 0.8 * span)]
    if kind == "twice":
        return np.sort(np.append(times, times[: rng.integers(1, 4)]))
    return {"backwards": times[::-1], "none": times[:0]}.get(kind, times)


def spoiled(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a channel as a strange sensor gives it."""
    spread = float(np.ptp(values)) if values.size else 0.0
    noisy = values + 0.01 * (spread + 0.1) * rng.normal(size=values.size)
    kind = rng.integers(14)
    if kind == 0:
        return np.full(values.size, rng.choice([0.0, 1.0, -999.0, np.nan], p=[0.3, 0.3, 0.3, 0.1]))
    if kind == 1:
        return np.full(values.size, values[0]) if values.size else values
    if kind == 2:
        return np.where(rng.random(values.size) < 0.97, np.nan, noisy)
    if kind == 3:
        return np.where(rng.random(values.size) < 0.05, float(rng.choice([1e6, -1e6, 1e3])), noisy)
    if kind == 4:
        return float(rng.choice([1e-9, 1e3, 1e6, -1.0])) * noisy
    if kind == 5:
        step = 0.4 * spread + 1e-9
        return step * np.round(noisy / step)
    if kind == 6:
        return values + 3.0 * (spread + 1.0) * rng.normal(size=values.size)
    if kind == 7:
        return np.where(np.arange(values.size) < values.size // 2, noisy, np.nan)
    return values if kind == 8 else noisy


def sidecar(columns: list[str], rng: np.random.Generator) -> str:
    """Return a sidecar, now and then with a level of noise that no sensor has."""
    text = 'scenario = "fig6"\n'
    if columns and rng.random() < 0.25:
        text += "[noise]\n" + "".join(f"{name} = {rng.choice([1e-6, 1e-3, 1.0, 1e4])}\n" for name in columns)
    return text


def written(number: int, folder: Path) -> Path:
    """Write record `number`, with its sidecar, into a folder."""
    rng, (there, channels) = np.random.default_rng(number), flown()
    times = times_of(rng)
    count = rng.choice([0, 1, 2, 3, 4, 6], p=[0.04, *[0.192] * 5])
    names = [str(name) for name in rng.permutation(list(COLUMNS))[:count]]
    table = {COLUMNS[name]: spoiled(np.interp(times, there, channels[name]), rng) for name in names}
    rows = zip(times, *table.values(), strict=True)
    lines = [
        ",".join(["time_s", *table]),
        *(",".join("" if x != x else f"{x:.9g}" for x in row) for row in rows),
    ]
    path = folder / f"odd{number}.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    path.with_suffix(".toml").write_text(sidecar(list(table), rng), encoding="utf-8")
    return path
