"""Make the seven examples of docs/diagnosis_examples.md: hide, diagnose, and write what was found between the marks.

    python -m benchmarks.diagnosis.stories                      # all of them
    python -m benchmarks.diagnosis.stories rudder_lag_on_fig6   # or some
    python -m benchmarks.diagnosis.stories --keep stories/      # with records and reports, to look into

The truth comes from the other cable formulation (`synthetic.reference_run`), with every tolerance drawn, coloured
noise, a few outliers and a gap.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import numpy as np

import subzero
from benchmarks.diagnosis.story_cases import STORIES, Story
from benchmarks.gallery import small
from subzero.channels import BY_NAME
from subzero.cli import write_diagnosis
from subzero.cli.diagnosis import simulated
from subzero.diagnosis.hypothesis.catalogue import START, catalogue
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.report import tables, words
from subzero.diagnosis.report.sections import table
from subzero.diagnosis.report.summary import summary
from subzero.diagnosis.results import Verdict
from subzero.figures.diagnosis import draw_diagnosis
from subzero.figures.style import Title
from subzero.results.netcdf_csv import open_output_folder
from subzero.synthetic.challenge import SAMPLE_S
from subzero.synthetic.planted import Hidden, draw_deviations, hide, make_record

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis_examples.md"
FIGURES = PAGE.parent / "figures"
OPEN, CLOSE = "<!-- stories -->", "<!-- end of stories -->"


def hidden_record(story: Story) -> Logged:
    """Return the record of a story, with the nominal setting of its trial."""
    trial = subzero.load_scenario("fig6")
    nominal = story.trial(Setting(trial=trial, model=subzero.Model.of(trial)))
    rng = np.random.default_rng(story.seed)
    both = (*catalogue(story.channels).values(), *START)
    true = hide(nominal, both, draw_deviations(both, rng, 1.0), Hidden(effects=dict(story.hidden)))
    true = true if story.missing is None else true.with_model(missing=story.missing)
    time = np.arange(story.begins, nominal.trial.duration + 1e-9, SAMPLE_S)
    record = make_record(true, time, story.channels, seed=rng, source=f"{story.name}.csv")
    return Logged(record=record, setting=nominal, name=story.name)


def tell(story: Story, verdict: Verdict) -> str:
    """Return the section of a story, and draw its figures."""
    drawn = draw_diagnosis(verdict, Title(words=story.title, scenario=story.trial.__name__))
    lines = [
        f"### {story.title}",
        "",
        story.words,
        "",
        f"    python -m benchmarks.diagnosis.stories {story.name}",
        "",
    ]
    missed = "" if verdict.verdict == story.expected else f" *It should have been {story.expected}.*"
    lines += [f"**{words.headline(verdict)}.**{missed}", ""]
    for answer in summary(verdict, story.trial.__name__):
        lines += [f"> *{answer.question}:* {re.sub(':$', '.', ' '.join(answer.words))}\n>"]
    lines += ["", *(table(tables.rivals(verdict, short=True)) if verdict.rivals else [])]
    for name in story.figures:
        if name in drawn:
            path = FIGURES / f"diagnosis_{story.name}.png"
            drawn[name].savefig(path)
            path.write_bytes(small(path))
            lines += [f"![{name}](figures/diagnosis_{story.name}.png)", ""]
    return "\n".join([*lines, ""])


def write(sections: dict[str, str]) -> None:
    """Put sections in the place of those of the same title, in the order of the stories."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(OPEN)
    old, _, after = rest.partition(CLOSE)
    titles = {story.title for story in STORIES}
    parts = {part.partition("\n")[0]: part for part in re.split(r"^### ", old, flags=re.M) if part.strip()}
    kept = {title: f"### {part.rstrip()}\n" for title, part in parts.items() if title in titles}
    kept |= sections
    body = "\n".join(kept[story.title] for story in STORIES if story.title in kept)
    PAGE.write_text(f"{before}{OPEN}\n\n{body}\n{CLOSE}{after}", encoding="utf-8")


def keep(logged: Logged, verdict: Verdict, folder: Path) -> None:
    """Write the record, and all files of its diagnosis."""
    with open_output_folder(folder / logged.name) as output_folder:
        names = list(logged.record.values)
        header = ",".join(["time_s", *(BY_NAME[name].column for name in names)])
        columns = np.column_stack([logged.record.time, *(logged.record.values[name] for name in names)])
        np.savetxt(
            output_folder.path / "record.csv", columns, fmt="%.6g", delimiter=",", header=header, comments=""
        )
        write_diagnosis.write_all(verdict, [logged], output_folder, run=simulated)


def main() -> None:
    """Run the stories that are named, or all of them."""
    parser = argparse.ArgumentParser(description="the seven examples of docs/diagnosis_examples.md")
    parser.add_argument("names", nargs="*", choices=[[], *(story.name for story in STORIES)], help="stories")
    parser.add_argument("--keep", type=Path, help="folder for records and reports")
    asked = parser.parse_args()
    for story in STORIES:
        if asked.names and story.name not in asked.names:
            continue
        logged = hidden_record(story)
        verdict = subzero.diagnose(logged)
        as_expected = "as expected" if verdict.verdict == story.expected else f"but expected {story.expected}"
        print(
            f"{story.name}: {verdict.verdict} {[one.id for one in verdict.causes]}, {as_expected}", flush=True
        )
        write({story.title: tell(story, verdict)})
        if asked.keep:
            keep(logged, verdict, asked.keep)


if __name__ == "__main__":
    main()
