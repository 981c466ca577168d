"""The reference lists every public name of every package that has an ``__all__``.

Verifies: docs/api.md has a place for each public package with all names of its ``__all__``, and `docs/site_hooks.py`
puts there the documentation, or the value, of each. Configuration: the packages as they are.
"""

import importlib
import importlib.util
import re
from pathlib import Path

import pytest

pytest.importorskip("mkdocs")
ROOT = Path(__file__).parents[2]
INSIDE = ("subzero.diagnosis.", "subzero.arguments", "cable.")
"""Packages with an ``__all__`` for the code around them, not for users."""
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
PUBLIC = re.findall(r"<!-- names of (\S+) -->", PAGE)


@pytest.fixture(scope="module")
def hooks():
    spec = importlib.util.spec_from_file_location("site_hooks", ROOT / "docs" / "site_hooks.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_public_package_has_its_place():
    named = set()
    for top in ("subzero", "cable", "vehicle", "scenarios"):
        for path in (ROOT / top).rglob("*.py"):
            if re.search(r"^__all__", path.read_text(encoding="utf-8"), re.MULTILINE):
                parts = path.relative_to(ROOT).with_suffix("").parts
                named.add(".".join(parts).removesuffix(".__init__"))
    assert {name for name in named if not name.startswith(INSIDE)} == set(PUBLIC)


@pytest.mark.parametrize("package", PUBLIC)
def test_every_public_name_is_listed_and_documented(hooks, package):
    expected = set(importlib.import_module(package).__all__) - hooks.PACKAGES
    listed = PAGE.partition(f"## {package}\n")[2].partition("<!--")[0]
    assert set(re.findall(r"`(\w+)`", listed)) == expected
    text = hooks.public_names(package)
    assert set(re.findall(rf"\b{package}\.(\w+)(?=\"|$)", text, re.MULTILINE)) >= expected
