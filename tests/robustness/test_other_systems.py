"""Without what only POSIX has, everything can be imported, and commands do their work: as on Windows.

Verifies: modules and functions that Windows lacks are needed by nothing that is imported, by a comparison, a sweep with
two workers, a checkpoint and an interrupt. Configuration: a fresh Python in which our packages find no such module, and
`os`, `signal` and `socket` lack what they lack there. What cannot be shown here: files and processes of Windows itself;
`.github/workflows/systems.yml` runs a part of the tests there.
"""

import os
import subprocess
import sys

import pytest

PRELUDE = """
import builtins, os, signal, socket, subprocess, sys
import psutil, numba  # what they need of the system is theirs

HIDDEN = {"fcntl", "grp", "posix", "pwd", "resource", "termios", "tty", "pty", "syslog"}
found = builtins.__import__

def hiding(name, globals=None, *rest, **more):
    ours = (globals or {}).get("__name__", "").partition(".")[0] in ("cable", "scenarios", "subzero", "vehicle")
    if ours and name.partition(".")[0] in HIDDEN:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return found(name, globals, *rest, **more)

builtins.__import__ = hiding
for module, names in {
    os: "fork forkpty geteuid getuid getegid getgid sched_getaffinity O_DIRECTORY",
    signal: "SIGALRM SIGHUP SIGUSR1 SIGUSR2 SIGQUIT SIGPIPE alarm setitimer pause",
    socket: "send_fds recv_fds",
}.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
"""

IMPORTS = """
import importlib, pkgutil
for name in ("cable", "scenarios", "vehicle", "subzero"):
    package = importlib.import_module(name)
    for found_module in pkgutil.walk_packages(package.__path__, name + "."):
        if not found_module.name.endswith("__main__"):
            importlib.import_module(found_module.name)
"""

RUN = """
sys.argv[:] = ["subzero", *{arguments!r}]
from subzero.__main__ import run
run()
"""


def started(code, folder):
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(
        [sys.executable, "-c", PRELUDE + code],
        cwd=folder,
        env=env,
        capture_output=True,
        text=True,
        timeout=600,
    )


@pytest.mark.long
def test_every_module_is_imported(tmp_path):
    done = started(IMPORTS, tmp_path)
    assert done.returncode == 0, done.stderr


SWEEP = """
trial = "fig6"
description = "two pieces of cable in the water at the start"
design = "grid"

[parameters]
"start.wet_length_m" = [1.0, 2.0]
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "file"),
    [
        (["compare", "fig6", "--out", "out"], "out/summary.json"),
        (["simulate", "fig6", "--checkpoint", "1", "--out", "out"], "out/tethered.nc"),
        (["sweep", "lengths.toml", "--workers", "2", "--out", "out"], "out/summary.json"),
    ],
)
def test_commands_do_their_work(arguments, file, tmp_path):
    (tmp_path / "lengths.toml").write_text(SWEEP)
    done = started(RUN.format(arguments=arguments), tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / file).exists(), [str(path) for path in tmp_path.rglob("*")]


@pytest.mark.parametrize("name", ["cable", "vehicle", "scenarios"])
@pytest.mark.parametrize("form", ["{}.py", "{}/__init__.py"])
def test_another_package_by_the_name_of_ours_is_named_in_one_line(name, form, tmp_path):
    """A user's own cable.py in the folder where Python starts, or a package of that name installed later."""
    path = tmp_path / form.format(name)
    path.parent.mkdir(exist_ok=True)
    path.write_text('"""Mine."""\n')
    env = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    command = [sys.executable, "-m", "subzero", "list"]
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"needs its own package '{name}'" in done.stderr
    assert str(path) in done.stderr
    used = [sys.executable, "-c", "import subzero; subzero.simulate"]
    done = subprocess.run(used, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert f"ImportError: subzero needs its own package '{name}'" in done.stderr
