"""A Seaglider with two pressure gauges that differ; python examples/seaglider/glider.py [--one | --trust].

Ten legs of real dives (SOURCE.txt). With both gauges their ratio and the difference of their clocks are told, and that
nothing tells which is wrong: the operator tuned drag and volume through the first one. With --trust the second one is
trusted; with --one there is only the first.
"""

import csv
import sys
from pathlib import Path

import numpy as np

import subzero.diagnosis as sd

FOLDER = Path(__file__).parent
LIFT, DRAG, INDUCED, EXPONENT, LENGTH = (
    0.00223872,
    0.0163117,
    5.7e-6,
    -0.25,
    1.8,
)  # hd_a, hd_b, hd_c, hd_s [m]
DBAR = 1.0061  # of a metre of this sea water [dbar/m]


def glider(p, u, t):
    """Return the pressure: steady glide at every moment (Eriksen et al. 2001), integrated from the start."""
    force = 9.81e-3 * (u["buoyancy"] + p["volume"])
    pitch = np.radians(u["pitch"] + p["pitch_bias"])
    speed, path = 0.3 + 0.0 * force * pitch, pitch
    for _ in range(12):
        q = np.maximum(0.5 * u["density"] * speed**2, 0.05)
        slope = np.copysign(np.maximum(np.abs(np.tan(path)), 0.05), path)
        drag, lift = p["drag"] * DRAG * q**EXPONENT, p["lift"] * LIFT
        share = np.clip(4.0 * drag * INDUCED / (lift * slope) ** 2, 0.0, 0.95)
        attack = -lift * slope / (2.0 * INDUCED) * (1.0 - np.sqrt(1.0 - share))  # [deg]
        path = pitch - np.radians(attack)
        square = 2.0 * force * np.sin(path) / (u["density"] * LENGTH**2 * (drag + INDUCED * attack**2))
        speed = np.sqrt(np.maximum(square, 1e-6))
    sinking = u["vertical_speed"] - speed * np.sin(path)
    steps = np.diff(t)[:, None] * 0.5 * (sinking[1:] + sinking[:-1])
    pressure = DBAR * (p["depth0"] + np.concatenate([0.0 * sinking[:1], np.cumsum(steps, axis=0)]))
    return {"gauge": pressure, "ad2cp": pressure}


def model(*, second=True, trusted=False):
    """Return the model. Noise is what a path that is smooth within half a minute leaves of each gauge."""
    channels = {"gauge": sd.Sensor(noise=0.3, zero=1.0, unit="dbar", logger="glider")}
    if second:
        channels["ad2cp"] = sd.Sensor(noise=0.5, zero=1.0, unit="dbar", trusted=trusted, logger="ad2cp")
    return sd.Model(
        glider,
        channels,
        inputs=["buoyancy", "pitch", "density"],
        parameters=[
            sd.Number("drag", 1.0, tolerance=0.05, low=0.2, high=5.0),
            sd.Number("lift", 1.0, tolerance=0.1, low=0.2, high=5.0),
            sd.Number("volume", 0.0, tolerance=10.0, unit="cc"),
            sd.Number("pitch_bias", 0.0, tolerance=0.3, unit="deg"),
            sd.Start("depth0", 60.0, tolerance=60.0, unit="m"),  # of no gauge: both are under suspicion
        ],
        causes=[
            sd.Cause("drag", "the drag is another one", changes={"drag": 0.3}),
            sd.Cause("buoyancy", "the buoyancy is off", changes={"volume": 50.0}),
            sd.Cause("pitch", "the pitch sensor has an offset", changes={"pitch_bias": 2.0}),
        ],
        unknown=[sd.Unknown("vertical_speed", size=0.02, time=30.0)],
        tuned_on={"drag": ["gauge"], "lift": ["gauge"], "volume": ["gauge"]},
        batch=True,
    )


def legs():
    """Return the ten legs."""
    tables = {}
    for name in ("legs", "ad2cp"):
        with (FOLDER / f"{name}.csv").open(encoding="utf-8") as file:
            tables[name] = list(csv.DictReader(file))
    records = []
    for leg in dict.fromkeys(row["leg"] for row in tables["legs"]):
        of = {name: [row for row in rows if row["leg"] == leg] for name, rows in tables.items()}
        columns = {
            name: [float(row[name]) for row in of["legs"]]
            for name in ("gauge", "buoyancy", "pitch", "density")
        }
        columns["ad2cp"] = [float(row["pressure"]) for row in of["ad2cp"]]
        time, own = ([float(row["time"]) for row in of[name]] for name in ("legs", "ad2cp"))
        records.append(sd.Record(time, columns, {"ad2cp": own}, leg))
    return records


if __name__ == "__main__":
    asked = model(second="--one" not in sys.argv, trusted="--trust" in sys.argv)
    verdict = sd.diagnose(legs(), asked, progress=lambda share, words: print(words))
    print(verdict)
    verdict.plot().savefig("glider.png", dpi=110)
