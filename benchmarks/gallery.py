"""Every kind of figure, made anew with the command that makes it: ``python -m benchmarks.gallery``.

    python -m benchmarks.gallery [--width 3.4] [FOLDER ...]

Writes ``docs/gallery.md`` and its pictures in ``docs/figures``: the commands of the table are run in an empty folder,
one after the other, then the scripts of ``examples/``, and what is shown of each is taken from there; of some only, if
their folders are named (``examples`` for the scripts). Pictures that are not made keep their place on the page. With
--width figures are made as narrow as one column of a journal page, into ``build/gallery``, and the page is not written.
Three diagnoses and a sweep take some minutes. No figure is of a run with warnings.
"""

from __future__ import annotations

import ast
import io
import re
import runpy
import shlex
import shutil
import sys
import tempfile
from contextlib import chdir, nullcontext
from dataclasses import dataclass
from pathlib import Path

import scenarios
from subzero.figures import page_width
from subzero.page.report import caption

ROOT = Path(__file__).resolve().parent.parent
PAGE, PICTURES = ROOT / "docs" / "gallery.md", ROOT / "docs" / "figures"
NARROW = ROOT / "build" / "gallery"
SCRIPTS = ROOT / "examples"
COLOURS = 64


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What a command makes: its figures as (folder, names without their ending), below a title."""

    title: str
    commands: tuple[str, ...]
    folder: str
    figures: tuple[str, ...]


GALLERY = (
    Shown(title="A trial with its cable and without", commands=("subzero compare fig6",), folder="fig6",
          figures=("fig6", "attitude", "cable", "tension", "forces")),
    Shown(title="Compared with a record", folder="measured", figures=("measured",),
          commands=("subzero challenge fig6 --seed 38 --out hidden",
                    "subzero compare fig6 --measured hidden/record.csv --out measured")),
    Shown(title="A run from its file", commands=("subzero compare fig6",
                    "subzero plot fig6/tethered.nc --what shape3d motion heading"),
          folder="fig6", figures=("tethered_shape3d", "tethered_motion", "tethered_heading")),
    Shown(title="A prescribed motion that has an exact solution", commands=("subzero simulate fig4",), folder="fig4",
          figures=("fig4",)),
    Shown(title="A prescribed dive", commands=("subzero simulate fig5",), folder="fig5", figures=("fig5",)),
    Shown(title="A winch", commands=("subzero simulate winch_trial.toml",), folder="winch_trial",
          figures=("deployment", "cable")),
    Shown(title="A remotely operated vehicle on station", commands=("subzero compare rov_turn",), folder="rov_turn",
          figures=("station",)),
    Shown(title="A glider", commands=("subzero simulate glider_sawtooth --untethered",), folder="glider_sawtooth",
          figures=("actuators",)),
    Shown(title="A manoeuvre", commands=("subzero manoeuvre zigzag",), folder="zigzag", figures=("manoeuvre",)),
    Shown(title="An autopilot", commands=("subzero autopilot heading_step --autopilot lqr --feed-forward model",),
          folder="heading_step", figures=("manoeuvre",)),
    Shown(title="A sweep", commands=("subzero sweep cable_and_current.toml --out sweep",), folder="sweep",
          figures=("bands", "histograms", "against", "tornado")),
    Shown(title="A diagnosis that names the cause", folder="found",
          commands=("subzero challenge fig6 --seed 38 --out hidden",
                    "subzero diagnose fig6 hidden/record.csv --out found"),
          figures=("misfit", "evidence", "gain", "detectable")),
    Shown(title="A diagnosis that leaves several explanations", folder="several", figures=("rivals",),
          commands=("subzero challenge fig6 --seed 27 --out rubs",
                    "subzero diagnose fig6 rubs/record.csv --out several")),
    Shown(title="A diagnosis of something in no catalogue", folder="strange", figures=("missing_force",),
          commands=("subzero challenge fig6 --seed 31 --out lowered",
                    "subzero diagnose fig6 lowered/record.csv --out strange")),
)  # fmt: skip
"""Every command that draws, in the order of the page, behind those that it needs: each is run once."""

EXAMPLES = (
    "fig6", "own_trial", "own_cable", "measured_record", "sweep", "cable_pulled_out", "static_shape", "winch",
    "vehicle_alone", "own_controller", "autopilot", "gymnasium_environment", "diagnose", "calibrate",
    "glider", "tether_buoy", "tether_snap", "tether_fmu", "ardupilot_rov", "tether_mujoco",
)  # fmt: skip
"""The scripts of ``examples/``, in the order of the page."""

CAPTIONS = {
    "measured": "Other channels that were measured, with the runs",
    "misfit": "Measured and simulated values, and the residual with the noise and the resolution of the sensor",
    "rivals": "The record as each other explanation predicts it",
    "shape3d": "The cable in space, at several times",
    "motion": "The motion of the vehicle over time",
    "heading": "One channel over time",
}
"""Captions where a figure needs other words than on its page."""

HEAD = """# Gallery

Every kind of figure, with the command that makes it, of runs without warnings; below them
[examples in Python](#examples-in-python). Each command also writes `report.html`, with these figures and a replay
([what it shows](page.md)). `simulate` and `compare` take `--width 3.4` for one column of a journal page, and
`--figures pdf` or `svg`; in Python every figure takes `with subzero.figures.page_width(3.4):`.
`python -m benchmarks.gallery` runs the commands and writes this page. Trials and sweeps that a command names are in
`examples/` and `scenarios/sweeps/`.

![The replay of a page](figures/page_follows.png)
"""

EXAMPLES_HEAD = """## Examples in Python

Short scripts; `python examples/fig6.py` leaves `fig6.png` in the current folder.
"""


def main() -> None:
    words = sys.argv[1:]
    narrow = float(words.pop(words.index("--width") + 1)) if "--width" in words else None
    wanted = [one for one in GALLERY if not words or one.folder in words]
    out = NARROW if narrow else PICTURES
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for file in (*(Path(scenarios.__file__).parent / "sweeps").glob("*.toml"), *SCRIPTS.glob("*.toml")):
            shutil.copy(file, folder)
        with page_width(narrow) if narrow else nullcontext():
            for command in dict.fromkeys(command for one in wanted for command in one.commands):
                run(command)
        for one in wanted:
            refuse_warnings(Path(one.folder) / "summary.json")
            for name in one.figures:
                (out / picture(one, name)).write_bytes(small(Path(one.folder) / f"{name}.png"))
        if not narrow and (not words or "examples" in words):
            draw_examples()
    if not narrow:
        PAGE.write_text(page(), encoding="utf-8")


def run(command: str) -> None:
    """Carry out a line of the shell."""
    from subzero.cli.app import FINE, main

    print(command, flush=True)
    if main([*shlex.split(command)[1:], "--quiet"]) != FINE:
        raise SystemExit(f"This failed: {command}")


def refuse_warnings(summary: Path) -> None:
    """End if a run or a sweep was warned of: the gallery shows none of these."""
    text = summary.read_text(encoding="utf-8") if summary.exists() else ""
    if re.search(r'"warnings": (\[[^\]]|\{[^}])', text):
        raise SystemExit(f"{summary} has warnings.")


def draw_examples() -> None:
    """Run every script, and take its picture."""
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    for name in EXAMPLES:
        print(f"examples/{name}.py", flush=True)
        runpy.run_path(str(SCRIPTS / f"{name}.py"), run_name="__main__")
        if name != "fig6":  # the same picture is at the top of the page
            (PICTURES / f"example_{name}.png").write_bytes(small(Path(f"{name}.png")))
        plt.close("all")


def picture(shown: Shown, figure: str) -> str:
    """Return the file name of a figure's picture."""
    return f"gallery_{shown.folder}_{figure}.png"


def small(path: Path) -> bytes:
    """Return a picture with few colours, as a PNG."""
    from PIL import Image

    held = io.BytesIO()
    image = (
        Image.open(path)
        .convert("RGB")
        .quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    image.save(held, format="PNG", optimize=True)
    return held.getvalue()


def words_of(figure: str) -> str:
    """Return the caption of a figure."""
    return CAPTIONS.get(figure) or caption(figure)


def page() -> str:
    """Return the page: commands and pictures of every part, as far as they are there."""
    parts = [HEAD]
    for one in GALLERY:
        lines = "\n".join(one.commands)
        parts.append(f"## {one.title}\n\n```sh\n{lines}\n```\n")
        parts += [
            f"![{words_of(name.removeprefix('tethered_'))}](figures/{picture(one, name)})\n"
            for name in one.figures
            if (PICTURES / picture(one, name)).exists()
        ]
    parts.append(EXAMPLES_HEAD)
    for name in EXAMPLES:
        sentence = ast.get_docstring(ast.parse((SCRIPTS / f"{name}.py").read_text(encoding="utf-8")))
        parts.append(f"**[{name}.py](../examples/{name}.py)**: {sentence}\n")
        if (PICTURES / f"example_{name}.png").exists():
            parts.append(f"![{sentence}](figures/example_{name}.png)\n")
    return "\n".join(parts)


if __name__ == "__main__":
    main()
