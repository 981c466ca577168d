"""The gallery has every kind of figure that a page knows, each with a command that the command line understands."""

from __future__ import annotations

import shlex

from benchmarks.gallery import GALLERY, PAGE, page
from subzero.cli.app import app
from subzero.page.report import FIGURES


def test_every_kind_of_figure_has_its_place():
    shown = {name for one in GALLERY for name in one.figures}
    assert set(FIGURES) <= shown


def test_every_command_is_understood():
    for command in {command for one in GALLERY for command in one.commands}:
        words = shlex.split(command)
        assert words[0] == "subzero"
        assert callable(app.parse_args(words[1:], exit_on_error=False, print_error=False)[0])


def test_the_page_is_the_one_of_the_table_with_the_pictures_that_are_there():
    assert PAGE.read_text(encoding="utf-8") == page()
