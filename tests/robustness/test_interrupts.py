"""An interrupt ends what runs and nothing else: the next call gives the same numbers, a command leaves no half files.

Verifies: in process, `KeyboardInterrupt` at random moments of simulations, steps of a simulator, cables that are pulled
out, towed and held, and results (`interrupted.py`); on the command line, SIGINT and SIGTERM at random moments, from the
first import to the last file, and while kernels are compiled. Tolerance: none; the next numbers are the same to the
last bit. (Before a command's first line, about 50 ms, Python's own habits hold.)

The long form is 1000 interrupts in process and 200 of commands:  pytest -m slow tests/robustness/test_interrupts.py -s
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import pytest

import subzero
from subzero.cli.app import INTERRUPTED
from subzero.files.atomic_output import TEMPORARY
from subzero.files.read_file import INCOMPLETE

DRIVER = Path(__file__).with_name("interrupted.py")
SHORT, LONG, LONG_DIAGNOSES = 20, 940, 60
SHORT_COMMANDS, LONG_COMMANDS, COLD_COMMANDS = 6, 185, 15
WITHIN_S = 2.0
"""So soon a command has to be gone after a signal. [s]"""
LONGEST_WAIT_S = 25.0
"""Commands are interrupted within this. [s]"""
LONG_COMPILATION_S = 40.0
"""Kernels take longer than this to compile. [s]"""


def interrupted_in_process(seed, count, what):
    """Interrupt so often in a child process; return what it says."""
    done = subprocess.run(
        [sys.executable, str(DRIVER), str(seed), str(count), what],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    found = json.loads(done.stdout)
    assert found["wrong"] == []
    assert found["interrupts"] == count
    return found


@pytest.mark.long
def test_after_an_interrupt_the_next_call_gives_the_same_numbers():
    assert len(interrupted_in_process(1, SHORT, "few")["where"]) > 3


def test_a_run_that_is_broken_off_leaves_no_thread_behind():
    before = threading.active_count()

    def broken_off(_):
        raise KeyboardInterrupt

    for trial in ("fig6", "rov_hover"):
        with pytest.raises(KeyboardInterrupt):
            subzero.simulate(trial, progress=broken_off)
    assert threading.active_count() == before


@pytest.mark.slow
def test_after_any_of_a_thousand_interrupts_the_next_call_gives_the_same_numbers():
    print("\n", interrupted_in_process(2, LONG, "all"))
    print(interrupted_in_process(3, LONG_DIAGNOSES, "diagnose"))


COMMANDS = {
    "list": ["list"],
    "simulate": ["simulate", "fig6", "--out", "out"],
    "compare": ["compare", "fig6", "--out", "out"],
    "autopilot": ["autopilot", "heading_step", "--out", "out"],
    "manoeuvre": ["manoeuvre", "zigzag", "--out", "out"],
    "challenge": ["challenge", "--seed", "4", "--out", "out"],
    "diagnose": ["diagnose", "record.csv", "--scenario", "fig6", "--screen", "--out", "out"],
}
SLOW_COMMANDS = COMMANDS | {"full": ["diagnose", "record.csv", "--scenario", "fig6", "--out", "out"]}


def started(words, folder, cache=None):
    """Start a command; return it when it heeds signals."""
    environment = (
        os.environ | {"PYTHONFAULTHANDLER": "1"} | ({"SUBZERO_CACHE_DIR": str(cache)} if cache else {})
    )
    command = subprocess.Popen(
        [sys.executable, "-m", "subzero", *words], cwd=folder, env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=heed_again,
    )  # fmt: skip
    while command.poll() is None and not heeds(command.pid):
        time.sleep(0.001)
    return command


def heed_again():
    """Let a command heed signals that this process was started with ignored, as jobs in the background are."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def heeds(pid):
    """Say whether a process has set a handler for SIGTERM."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    except FileNotFoundError:
        return False
    caught = int(status.split("SigCgt:")[1].split()[0], 16)
    return bool(caught & 1 << (signal.SIGTERM - 1))


@functools.cache
def seconds(name, folder):
    """Return how long a command takes that nobody interrupts; None where the folder of its outputs is whole."""
    began = time.monotonic()
    command = started(SLOW_COMMANDS[name], folder)
    out, err = command.communicate()
    assert command.returncode == 0, (out, err)
    return time.monotonic() - began


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which each command has been run: how long it took, and which files it left."""
    top, took, files = tmp_path_factory.mktemp("whole"), {}, {}

    def run(name):
        if name not in took:
            folder = top / name
            folder.mkdir()
            record(folder)
            took[name] = seconds(name, folder)
            files[name] = listing(folder)
        return took[name], files[name]

    return run


def record(folder):
    """Write a record to diagnose, in which the vehicle is slower than it should be."""
    rows = "".join(f"{0.5 * k},{0.9 * min(1.0, 0.25 * k):.3f},{27 + 0.01 * k:.2f}\n" for k in range(40))
    (folder / "record.csv").write_text("time_s,surge_speed_m_s,heading_deg\n" + rows)


def listing(folder):
    """Return the names of all files in a folder and below, without the caches of libraries."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def interrupted(name, folder, after, number, whole, cache=None):
    """Interrupt a command after a time [s]; return how long it took to end, None if it had ended before. [s]"""
    record(folder)
    command = started(SLOW_COMMANDS[name], folder, cache)
    with contextlib.suppress(subprocess.TimeoutExpired):
        command.wait(after)
        command.communicate()
        return None
    sent = time.monotonic()
    command.send_signal(number)
    try:
        out, err = command.communicate(timeout=WITHIN_S if "diagnose" in SLOW_COMMANDS[name] else 60.0)
    except subprocess.TimeoutExpired:  # a diagnosis writes what it has, unless it is told again
        sent = time.monotonic()
        command.send_signal(number)
        out, err = command.communicate(timeout=60.0)
    lasted = time.monotonic() - sent
    check(command.returncode, out, err, folder, whole)
    return lasted if command.returncode == INTERRUPTED else None


def check(code, out, err, folder, whole):
    """An interrupted command says so once, and leaves all of its files or none."""
    assert "Traceback" not in out + err, err
    left = [one for one in listing(folder) if one != "record.csv"]
    assert not any(TEMPORARY in one or INCOMPLETE in one for one in left), left
    if code == 0:  # the signal came behind its last line
        return
    assert code == INTERRUPTED, (code, out, err)
    said = [line for line in err.splitlines() if line.startswith("Interrupted; ") and "being" not in line]
    assert len(said) == 1, err
    if "what it has is written" in err:
        check_unfinished(folder, left)
        return
    assert left in ([], [one for one in whole if one != "record.csv"]), (left, err)
    if "nothing was written" in err:
        assert left == []


OF_A_DIAGNOSIS = {
    *(f"out/{one}" for one in ("report.html", "report.md", "diagnosis.json", "extended.toml")),
    *(f"out/{one}.png" for one in ("misfit", "evidence", "rivals", "detectable", "gain", "missing_force")),
}
"""What docs/diagnosis.md says that a diagnosis leaves behind."""


VERDICTS = {
    "nothing_wrong", "calibrated", "cause_named", "undecided", "outside_catalogue", "nothing_near", "data_error",
}  # fmt: skip
"""The seven of docs/diagnosis.md. A search of the record of these tests that gets far enough finds its speed frozen."""


def check_unfinished(folder, left):
    """A diagnosis that was interrupted once writes what it has: its report and its numbers, and what it has no gain of
    has no figure of it.
    """
    assert {"out/report.html", "out/report.md", "out/diagnosis.json"} <= set(left) <= OF_A_DIAGNOSIS, left
    said = json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    assert said["verdict"] in VERDICTS


def interrupt_commands(seed, count, names, made, folder, cold=False):
    """Interrupt so many commands; return how often which, and the longest time that one took to end [s]."""
    draw, came, slowest = random.Random(seed), Counter(), 0.0
    while came.total() < count:
        name, number = draw.choice(sorted(names)), draw.choice([signal.SIGINT, signal.SIGTERM])
        took, whole = made(name)
        place = folder / str(draw.random())
        place.mkdir()
        after = draw.uniform(0.0, LONG_COMPILATION_S if cold else min(took, LONGEST_WAIT_S))
        lasted = interrupted(
            name, place, after, number, whole, folder / f"cold-{draw.random()}" if cold else None
        )
        if lasted is not None:
            came[name] += 1
            slowest = max(slowest, lasted)
    return came, slowest


def short(name):
    """Return how long a short command lasts at least, and the files that it leaves."""
    figures = ("attitude", "cable", "fig6", "forces", "tension")
    files = [
        "report.html",
        "summary.json",
        "tethered.csv",
        "tethered.nc",
        *(f"{figure}.png" for figure in figures),
    ]
    return {"list": (0.2, []), "simulate": (1.5, sorted(f"out/{file}" for file in files))}[name]


@pytest.mark.long
def test_an_interrupted_command_says_so_and_leaves_all_or_nothing(tmp_path):
    came, _ = interrupt_commands(1, SHORT_COMMANDS, ("simulate", "list"), short, tmp_path)
    assert came.total() == SHORT_COMMANDS


BEHIND = """
import atexit, os, signal, sys
atexit.register(os.kill, os.getpid(), signal.{})
sys.argv = ["subzero", "list"]
from subzero.__main__ import run
run()
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_behind_the_last_line_of_a_command_changes_nothing(name):
    """Python, while it ends, told a traceback or died of a signal though the command was done."""
    done = subprocess.run(
        [sys.executable, "-c", BEHIND.format(name)], capture_output=True, text=True, check=False,
        preexec_fn=heed_again,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "fig6" in done.stdout


MADE_AN_ERROR = """
import os, signal, sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from subzero.cli import app as cli
from subzero.files import atomic_output

def parsed(*arguments, **options):
    try:
        os.kill(os.getpid(), int(sys.argv[1]))
        for _ in range(100):
            pass
    except KeyboardInterrupt:
        pass
    with atomic_output.friendly_errors(Path("out")) if sys.argv[2] == "drawing" else nullcontext():
        raise ValueError("Invalid bounding box")

cli.app = SimpleNamespace(parse_args=parsed)
from subzero.__main__ import run
run()
"""


@pytest.mark.parametrize(
    "number, where",
    [(signal.SIGINT, "else"), (signal.SIGTERM, "else"), (signal.SIGINT, "drawing"), (0, "else")],
)
def test_an_error_that_machine_code_makes_of_an_interrupt_is_an_interrupt(number, where):
    """Matplotlib told a ValueError, with a traceback; while a figure was drawn it was taken for a word of the disk, and
    the exit code was 2. Without a signal (0) an error stays one.
    """
    done = subprocess.run(
        [sys.executable, "-c", MADE_AN_ERROR, str(int(number)), where], capture_output=True, text=True,
        check=False, preexec_fn=heed_again,
    )  # fmt: skip
    if number:
        assert (done.returncode, done.stderr) == (INTERRUPTED, "Interrupted; nothing was written.\n")
    else:
        assert done.returncode == 1
        assert "ValueError: Invalid bounding box" in done.stderr


LINKED = """
import gc, os, signal, sys
from llvmlite.binding import ffi

link, left = ffi.lib.LLVMPY_LinkModules, [int(sys.argv[1])]

def interrupted(*modules):
    done = link(*modules)
    left[0] -= 1
    if left[0] == 0:
        os.kill(os.getpid(), signal.SIGINT)
    return done

ffi.lib._fntab["LLVMPY_LinkModules"] = interrupted
"""
IN_PROCESS = """
from subzero.jit import compiled, inner

@inner
def once(x):
    return x + 1.0

@compiled
def twice(x):
    return once(x) + once(x)

try:
    print(twice(1.0))
except KeyboardInterrupt:
    print("interrupted")
gc.collect()
print(twice(1.0))
"""
ON_THE_COMMAND_LINE = """
sys.argv[1:] = sys.argv[2:]
from subzero.__main__ import run
run()
"""


def linked(script, *words, cache=""):
    """Run a script that is interrupted right behind LLVM's linking of two modules."""
    return subprocess.run(
        [sys.executable, "-c", LINKED + script, *words], env=os.environ | {"SUBZERO_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=False, preexec_fn=heed_again,
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("nth", ["1", "4"])
def test_an_interrupt_behind_the_linker_ends_the_call_and_nothing_else(nth):
    """The linker destroys a module; interrupted before Python knew, it was destroyed twice: SIGSEGV a moment later."""
    done = linked(IN_PROCESS, nth)
    assert (done.returncode, done.stdout, done.stderr) == (0, "interrupted\n4.0\n", "")


@pytest.mark.long
def test_an_interrupt_behind_the_linker_ends_a_command_as_any_other(tmp_path):
    """A diagnosis died of SIGSEGV behind its last words."""
    record(tmp_path)
    words = [
        "diagnose",
        str(tmp_path / "record.csv"),
        "--scenario",
        "fig6",
        "--screen",
        "--out",
        str(tmp_path / "out"),
    ]
    done = linked(ON_THE_COMMAND_LINE, "9", *words, cache=tmp_path / "cold")
    assert (done.returncode, done.stderr.splitlines()[-1:]) == (
        INTERRUPTED,
        ["Interrupted; nothing was written."],
    )


@pytest.mark.slow
def test_two_hundred_interrupted_commands_are_gone_within_two_seconds(made, tmp_path):
    came, slowest = interrupt_commands(2, LONG_COMMANDS, SLOW_COMMANDS, made, tmp_path)
    print(f"\n{dict(came)}, gone within {slowest:.2f} s")
    assert slowest < WITHIN_S


@pytest.mark.slow
def test_an_interrupted_compilation_is_gone_within_two_seconds(made, tmp_path):
    came, slowest = interrupt_commands(3, COLD_COMMANDS, ("simulate",), made, tmp_path, cold=True)
    print(f"\n{dict(came)} while compiling, gone within {slowest:.2f} s")
    assert slowest < WITHIN_S


FORCED = """
import sys, time
from pathlib import Path
from subzero.cli import interrupts
from subzero.files.atomic_output import open_output_folder
interrupts.watch()
with open_output_folder(Path("out")) as output:
    (output.path / "file").write_text("half")
    while True:  # as machine code that does not come back
        try:
            print("begun", flush=True)
            time.sleep(60.0)
        except KeyboardInterrupt:
            continue
"""


def test_a_command_that_has_to_be_ended_leaves_no_hidden_files(tmp_path):
    command = subprocess.Popen(
        [sys.executable, "-c", FORCED],
        cwd=tmp_path,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    while "begun" not in command.stdout.readline():
        pass
    assert len(listing(tmp_path)) > 0
    command.send_signal(signal.SIGTERM)
    _, err = command.communicate(timeout=60.0)
    assert (command.returncode, err) == (INTERRUPTED, "\nInterrupted; nothing was written.\n")
    assert list(tmp_path.iterdir()) == []


LATE = """
import os, signal, time
from subzero.cli import app as cli, interrupts
from subzero.__main__ import run

class Hanging:
    def parse_args(self, *_, **__):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60.0)

def late(code):
    time.sleep(60.0)

cli.app, interrupts.leave = Hanging(), late
run()
"""


def test_a_command_that_is_ended_behind_its_last_words_has_said_them_once():
    """On a busy machine a command had said them, when its patience ended: they were said again."""
    done = subprocess.run(
        [sys.executable, "-c", LATE], capture_output=True, text=True, check=False, preexec_fn=heed_again
    )
    assert (done.returncode, done.stderr) == (INTERRUPTED, "Interrupted; nothing was written.\n")


ENDLESS = """
import sys, time
from types import SimpleNamespace
from subzero.cli import app as cli
from subzero.__main__ import run

def parsed(*_, **__):
    print("begun", file=sys.stderr, flush=True)
    while True:
        try:
            print("words " * 10_000, flush=True)
            print("words " * 10_000, file=sys.stderr, flush=True)
            time.sleep(0.1)
        except KeyboardInterrupt:
            if sys.argv[1] == "heeds":
                raise

cli.app = SimpleNamespace(parse_args=parsed)
run()
"""


STREAMS = ("closed", "full disk", "full pipe", "no reader")
ENDINGS = [
    *((signal.SIGINT, streams, "goes on") for streams in STREAMS),
    *((number, streams, "heeds") for number in (signal.SIGTERM, signal.SIGHUP) for streams in STREAMS[2:]),
]


@pytest.mark.long
@pytest.mark.parametrize(("number", "streams", "how"), ENDINGS)
def test_a_command_ends_whatever_became_of_its_streams(number, streams, how):
    """Where the reader of stderr had gone, the thread that ends a command died of it with a lock in its hands: the
    command ignored every further signal.
    """
    reading, writing = os.pipe()
    full = open("/dev/full", "w")  # noqa: SIM115
    to = {"closed": None, "full disk": full, "full pipe": writing, "no reader": writing}[streams]
    options = {"stdout": to, "stderr": to}
    if streams == "closed":
        options = {"preexec_fn": lambda: (heed_again(), os.close(1), os.close(2))}
    command = subprocess.Popen([sys.executable, "-c", ENDLESS, how], **({"preexec_fn": heed_again} | options))
    os.close(writing)
    if streams == "no reader":
        os.close(reading)
    try:
        while not heeds(command.pid):
            time.sleep(0.001)
        time.sleep(0.3)
        command.send_signal(number)
        assert command.wait(30.0) == INTERRUPTED
    finally:
        command.kill()
        full.close()
        if streams != "no reader":
            os.close(reading)


UNREAD = {
    "full disk": (">/dev/full", 2), "full error": ("2>/dev/full", 0), "closed": (">&-", 0), "no reader": ("| true", 0),
    "closed error": ("2>&-", 0), "first line": ("2>&1 | head -n 1", 0),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("streams", UNREAD)
@pytest.mark.parametrize("words", ["list", "show fig6", "list --json", "simulate none"])
def test_output_that_nothing_reads_is_no_traceback_and_no_silent_failure(streams, words):
    """`> /dev/full` and `| head` were tracebacks, or an exit code of 1 without a word."""
    where, code = UNREAD[streams]
    line = f"set -o pipefail; {sys.executable} -m subzero {words} {where}"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stdout + done.stderr
    expected = 2 if words == "simulate none" else code
    assert done.returncode == expected
    if code and words != "simulate none":
        assert done.stderr == "Standard output cannot be written: No space left on device.\n"
