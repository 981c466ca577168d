"""The order of the tests, for two processes that share their files (``-n 2 --dist loadfile``).

One process compiles hull and cable, while the other tests what needs no compiled code; then come the files with other
code to compile, and last those that are quick, so that both processes end together.
"""

from pathlib import Path

import pytest

FOLDERS = (
    "identification",
    "order",
    "paper",
    "coupling",
    "diagnosis",
    "exact",
    "parity",
    "laws",
    "autopilot",
)
"""Folders in the order of their tests; all others follow."""
FIRST = ("coupling", "test_exchange.py")
"""The first file: it compiles hull and cable."""
HERE = Path(__file__).parent


def pytest_configure(config: pytest.Config) -> None:
    """Keep the order of `pytest_collection_modifyitems`: pytest-xdist would begin with the files of most tests."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Order tests by their files."""
    items.sort(key=lambda item: _place(item.path))


def _place(file: Path) -> tuple[int, str]:
    """Return where a file comes."""
    folder, *rest = file.relative_to(HERE).parts if file.is_relative_to(HERE) else ("",)
    if (folder, *rest) == FIRST:
        return -1, ""
    return FOLDERS.index(folder) if folder in FOLDERS else len(FOLDERS), str(file)
