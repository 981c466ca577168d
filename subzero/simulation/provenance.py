"""All that determines the numbers of a run, as digests: our sources and libraries, a trial, a model."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import scenarios

WORDS = ("name", "description", "text", "source")
"""Fields of a trial that change no number."""


@cache
def code_digest() -> str:
    """Return a digest of all that the numbers of a run depend on: our sources, and the libraries' versions."""
    root = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for package in ("cable", "scenarios", "subzero", "vehicle"):
        for path in sorted((root / package).rglob("*")):
            if path.suffix in (".py", ".toml"):
                digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes())
    for library in ("numpy", "scipy", "numba", "xarray"):
        digest.update(f"{library} {version(library)}".encode())
    return digest.hexdigest()


def processor() -> str:
    """Return which processor machine code is made for: another one may round otherwise."""
    from llvmlite import binding

    return str(binding.get_host_cpu_name())


def trial_digest(trial: scenarios.Trial) -> str:
    """Return a digest of a trial that changes with every number of it, and with nothing else."""
    values = canonical(trial)
    for words in WORDS:
        values.pop(words)
    return digest_of(values)


def digest_of(value: Any) -> str:
    """Return a digest of a value that JSON can hold, floats to the last bit."""
    return hashlib.sha256(json.dumps(canonical(value), sort_keys=True).encode()).hexdigest()


def canonical(value: Any) -> Any:
    """Return a value of a trial as JSON can hold it, floats to the last bit."""
    if is_dataclass(value):
        return {field.name: canonical(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): canonical(inside) for key, inside in sorted(value.items())}
    if isinstance(value, list | tuple):
        return [canonical(each) for each in value]
    return value
