"""docs/tether.md, as a reader would copy from it: the host loop runs, and the table of errors is what is said.

Verifies: the Python block of the page, in a process of its own with nothing else; the beginnings of the messages in its
table. Configuration: an empty folder. Tolerance: the balance of the drone, thrust and pull, to 2 N of 112 N.
"""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cable

PAGE = (Path(__file__).parents[2] / "docs" / "tether.md").read_text(encoding="utf-8")
(LOOP,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
MESSAGES = re.findall(
    r"^\| [^|]+ \| `([^`]+)` \|$", PAGE.partition("## Errors")[2].partition("## Hosts")[0], re.MULTILINE
)


def plain(message):
    """Return a message with a sign in place of each number."""
    return re.sub(r"nan|-?\d+(\.\d+)?(e-\d+)?", "#", message)


def test_the_loop_can_be_copied_as_it_is(tmp_path):
    assert len([line for line in LOOP.splitlines() if line.strip()]) <= 20
    done = subprocess.run(
        [sys.executable, "-c", LOOP], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    x, _, z, pull_x, _, pull_z = (float(number) for number in re.findall(r"-?\d+\.\d*", done.stdout))
    assert done.stderr == ""
    # Its spring of 20 N/m, at the end nearly at rest, holds the pull of the tether.
    assert 20.0 * np.array([x, z + 15.0]) == pytest.approx([pull_x, pull_z], abs=12.0)


def test_the_errors_of_the_page_are_those_of_a_tether():
    """A message of the page, up to its first number, begins one that is raised."""
    ends = np.array([(18.0, 0.0, 8.0), (0.0, 0.0, 0.0)])
    tether, raised, north = cable.Tether(length=20.0, longest=30.0, ends=ends), [], np.eye(3)[0]
    tries = (
        lambda: tether.step(0.1, [ends[0] + 10.0 * north, ends[1]]),
        lambda: tether.step(0.1, [ends[0] * np.nan, ends[1]]),
        lambda: tether.step(0.0, ends),
        lambda: tether.step(2.0, [ends[0] + north, ends[1] - 0.9 * north]),
        lambda: tether.step(0.1, ends, cable.PayOutRate(rate=200.0)),
        lambda: tether.step(0.1, ends, cable.PayOutRate(rate=-300.0)),
        lambda: tether.restore(cable.Tether(length=20.0, ends=ends).save()),
    )
    for each in tries:
        with pytest.raises(ValueError) as error:
            each()
        raised.append(str(error.value))
    for message, said in zip(MESSAGES, map(plain, raised), strict=True):
        assert all(part.strip() in said for part in plain(message).split("…")), (message, said)
