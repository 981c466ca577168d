"""The page that shows the way names nothing that is not there, and every package that is."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")


def exists(file, name):
    """Say whether there is such a file, with such a function, class or table in it, if one is named."""
    path = ROOT / file
    found = rf"^(?:def {name}\(|class {name}\b|{name}\b.* = )"
    return path.is_file() and (not name or re.search(found, path.read_text(encoding="utf-8"), re.MULTILINE))


def test_every_place_on_the_page_exists():
    places = re.findall(r"`([\w/.-]+\.(?:py|toml|md))(?::(\w+))?`", PAGE)
    assert len({place for place in places if place[1]}) > 30
    assert [place for place in places if not exists(*place)] == []


def test_every_package_is_on_the_page():
    for top in ("subzero", "cable", "vehicle", "scenarios"):
        for path in (ROOT / top).rglob("__init__.py"):
            package = str(path.parent.relative_to(ROOT))
            assert package in PAGE or package.replace("/", ".") in PAGE
