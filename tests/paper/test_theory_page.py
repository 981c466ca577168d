"""docs/theory.md leads from every equation to the code: each file and each name it mentions exists."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
PLACES = sorted(set(re.findall(r"`([\w/]+\.(?:py|toml|md))(?::(\w+))?`", PAGE)))


@pytest.mark.parametrize(("file", "name"), PLACES)
def test_the_page_names_a_place_that_exists(file, name):
    source = (ROOT / file).read_text(encoding="utf-8")
    assert not name or re.search(rf"^(?:def {name}\(|class {name}\b|{name} = )", source, re.MULTILINE)


def test_the_page_names_all_parts_of_the_default_scheme():
    named = {file for file, _ in PLACES}
    parts = {"segment_load", "assembly", "bdf2", "block_solver", "time_step", "remeshing", "slack_law",
             "chord_correction", "energy"}  # fmt: skip
    assert {f"cable/moving_end/{part}.py" for part in parts} | {"cable/drum.py"} <= named
    assert {
        "subzero/engine/coupling.py",
        "subzero/engine/vehicle_step.py",
        "subzero/engine/energy.py",
    } <= named
