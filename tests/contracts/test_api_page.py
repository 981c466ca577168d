"""The reference lists every public name of every package that has an ``__all__``.

Verifies: docs/api.md has a place for each public package, and the names that `docs/site_hooks.py` puts there are all of
its ``__all__``, each with a place where it is documented or with its value. Configuration: the packages as they are.
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
PUBLIC = re.findall(r"<!-- names of (\S+) -->", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"))


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
def test_every_public_name_is_listed(hooks, package):
    text = hooks.public_names(package)
    expected = set(importlib.import_module(package).__all__) - hooks.PACKAGES
    missing = [
        name for name in expected if not re.search(rf"\b{package}\.{name}\b(?=\"|$)", text, re.MULTILINE)
    ]
    assert missing == []
