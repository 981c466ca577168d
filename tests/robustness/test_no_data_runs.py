"""No data file runs code: whatever Python file, pickle or expression it names, in whatever field.

A canary stands beside each file: a program, a module and a pickle that leave a mark when they run. Every text of a good
file is replaced by something that would run them, keys that might ask for it are added, and all of it is read.
"""

from __future__ import annotations

import importlib.util
import os
import pickle
import re
import sys
from pathlib import Path

import pytest

import scenarios
from subzero.cli.app import MISTAKE, main
from subzero.diagnosis import load_effects, read_extended
from subzero.errors import UserError

# pytest imports test files one by one, without their folder; this is a module beside this one.
_spec = importlib.util.spec_from_file_location("readers", Path(__file__).with_name("readers.py"))
assert _spec
assert _spec.loader
readers = sys.modules["readers"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(readers)

KEYS = ("effects_file", "effects", "autopilot", "module", "import", "python", "plugin", "exec", "include")
"""Keys that could make a reader run something, if it knew them."""

MOST = 7
"""Texts of a file that are replaced one by one, each by another lure; then all of them, by each lure."""

TEXT = re.compile(r'"(?:[^"\\\n]|\\.)*"')


class Bomb:
    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return os.mkdir, (str(self.mark),)


@pytest.fixture
def mark(tmp_path, monkeypatch):
    """The mark that a canary leaves; canaries stand in the folder, which is where Python looks for modules, too."""
    mark = tmp_path / "ran"
    program = f"import os\nos.mkdir({str(mark)!r})\nEFFECTS = []\n"
    for name in ("canary.py", "notes.txt", "canary.csv", "canary.toml"):
        (tmp_path / name).write_text(program)
    (tmp_path / "canary.pkl").write_bytes(pickle.dumps(Bomb(mark)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return mark


def lures(folder, mark):
    call = f"__import__('os').mkdir('{mark}')"
    return ("canary.py", "notes.txt", "canary", "canary.pkl", str(folder / "canary.py"), call, f"!{{{call}}}")


def baited(reader, folder, mark):
    """Give texts of a file that each ask for something to run."""
    spots = [found.span() for found in TEXT.finditer(reader.good)]
    for (start, end), lure in zip(spots[:: len(spots) // MOST + 1], lures(folder, mark), strict=False):
        yield reader.good[:start] + f'"{lure}"' + reader.good[end:]
    for lure in lures(folder, mark):
        yield TEXT.sub(lambda _: f'"{lure}"', reader.good)  # noqa: B023  # used at once
        yield "\n".join([*(f'{key} = "{lure}"' for key in KEYS), reader.good])
        if reader.file == "extended.toml":
            yield f'effects_file = "{lure}"\n{reader.good}'
        if reader.file.endswith(".csv"):  # a column, and all cells
            yield reader.good.replace(",", f",{lure},", 1)
            yield reader.good.replace(",", f",{lure},")
    yield (folder / "canary.py").read_text()


def test_the_canaries_would_sing(mark, tmp_path):
    load_effects(tmp_path / "notes.txt")
    assert mark.exists()
    mark.rmdir()
    pickle.loads((tmp_path / "canary.pkl").read_bytes())
    assert mark.exists()
    mark.rmdir()
    importlib.import_module("canary")
    assert mark.exists()
    del sys.modules["canary"]
    mark.rmdir()
    eval(lures(tmp_path, mark)[5])
    assert mark.exists()


@pytest.mark.long
@pytest.mark.parametrize("name", readers.READERS)
def test_no_file_runs_what_it_names(name, mark, tmp_path):
    for text in baited(readers.READERS[name], tmp_path, mark):
        readers.outcome(readers.READERS[name], text, tmp_path)
        assert not mark.exists(), text
    assert "canary" not in sys.modules


def test_an_extended_model_whose_effects_are_elsewhere_is_refused_and_says_how_they_are_given(mark, tmp_path):
    for name in ("canary.py", "notes.txt"):
        path = tmp_path / "extended.toml"
        path.write_text(f'effects_file = "{name}"\n[effects.mine]\nmass_kg = 0.4\n')
        with pytest.raises(UserError, match=f"'{name}', give that file with --effects"):
            read_extended(path)
    assert not mark.exists()


def test_on_the_command_line_only_effects_runs_a_file(mark, tmp_path, capsys):
    (tmp_path / "extended.toml").write_text('effects_file = "canary.py"\n[effects.mine]\nmass_kg = 0.4\n')
    assert main(["simulate", "fig6", "--with", "extended.toml"]) == MISTAKE
    assert "--effects" in capsys.readouterr().err
    assert not mark.exists()
    assert main(["simulate", "fig6", "--with", "extended.toml", "--effects", "canary.py"]) == MISTAKE
    assert mark.exists()  # it ran, and has no effect `mine`
    assert main(["simulate", "fig6", "--effects", "canary.py"]) == MISTAKE
    assert "--with" in capsys.readouterr().err


def test_shipped_scenarios_are_data_only():
    top = scenarios.path("fig6").parent.parent
    files = [
        path for path in top.rglob("*") if path.is_file() and path.parent not in (top, top / "__pycache__")
    ]
    assert {path.suffix for path in files} <= {".toml", ".csv"}
