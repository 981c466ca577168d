"""What the README and the pages of the command line say is what happens."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from subzero.channels import BY_COLUMN
from subzero.cli import EXAMPLES
from subzero.cli.app import app

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
TEST_LINE = (
    'python3 -m venv .venv && .venv/bin/pip install ".[test]" && .venv/bin/pytest -n 2 --dist loadfile'
)
PAGES = [(ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("command_line.md", "trials.md")]


def shell_lines(text):
    return [line for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) for line in block.splitlines()]


SHELL = shell_lines(README)
COMMANDS = [
    line.partition("#")[0].strip()
    for line in dict.fromkeys(line for text in (README, *PAGES) for line in shell_lines(text))
    if line.startswith("subzero ")
]


def test_two_lines_do_everything_each_with_its_own_environment():
    lines = [line for line in SHELL if line.startswith("python3 -m venv ")]
    assert lines == [
        "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/subzero compare fig6",
        TEST_LINE,
    ]


def test_ci_takes_its_test_line_from_the_readme():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    pattern = re.search(r"grep -E '(.*)' README\.md", script)
    assert pattern is not None
    found = [line for line in README.splitlines() if re.search(pattern[1], line)]
    assert found == [TEST_LINE]
    assert all(step in script for step in ("ruff check", "ruff format --check", "mypy", "lint-imports"))


@pytest.mark.long
@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_is_understood(line):
    command, bound, _ = app.parse_args(shlex.split(line)[1:], exit_on_error=False, print_error=False)
    assert shlex.split(line)[1] in EXAMPLES
    assert callable(command)
    assert bound.arguments or shlex.split(line)[1] in ("list", "doctor", "warm")


def test_the_readme_is_short_with_a_picture_at_the_top():
    lines = README.splitlines()
    assert len(lines) <= 120
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", "\n".join(lines[:20]))
    assert pictures
    assert all((ROOT / path).stat().st_size < 150_000 for path in pictures)


def test_every_link_of_the_readme_leads_to_a_file():
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_every_column_that_is_named_exists():
    columns = set(re.findall(r"`(time_s, [^`]*_N), …`", PAGES[0])[0].split(", "))
    assert columns
    assert columns <= set(BY_COLUMN)
