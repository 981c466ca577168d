"""Compile physics with numba, and keep what was compiled for the next run.

The one thing that all packages share: a decorator, `compiled`, for functions on plain floats and arrays. What it
compiles is kept by `subzero.jit.machine_code`.

Setting ``NUMBA_DISABLE_JIT=1`` runs the same code interpreted.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
import numba.extending

from subzero.jit.machine_code import MachineCode
from subzero.jit.unbroken import unbroken

Function = TypeVar("Function", bound=Callable[..., Any])
Line = TypeVar("Line")
Special = TypeVar("Special")
General = TypeVar("General")
Result = TypeVar("Result")

numba.config.OPT = type(numba.config.OPT)(
    1
)  # LLVM's first level: compiles in 25 s instead of 27 s, and the loop runs a fifth faster


def compiled(function: Function) -> Function:
    """Compile a function of plain floats and arrays; strict IEEE arithmetic, so runs repeat to the last bit.

    It borrows the arrays that it is given: it makes none, and gives none back (`allocating` may). So nobody counts who
    holds an array, which took as long as the arithmetic: the coupled loop runs half as long again with it.

    A function whose name starts with an underscore is compiled as by `inner`.
    """
    return inner(function) if function.__name__.startswith("_") else _compile(function, gate=True)


def allocating(function: Function) -> Function:
    """Compile a function as `compiled` does, that makes arrays or gives some back."""
    return _compile(function, gate=not function.__name__.startswith("_"), makes=True)


def inner(function: Function) -> Function:
    """Compile a function that only compiled code calls: without its gate to Python it is ready sooner."""
    return _compile(function, gate=False)


def inlined(function: Function) -> Function:
    """Compile a function as a part of each that calls it: for what is done at every node.

    A call hands over a `Line` array by array, which takes longer than the arithmetic of a node.
    """
    return _compile(function, gate=False, inline=True)


def _compile(function: Function, *, gate: bool, inline: bool = False, makes: bool = False) -> Function:
    """Compile a function, and keep its machine code."""
    options = {
        "error_model": "numpy",
        "nogil": True,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": not gate,
        "forceinline": inline,
        "_nrt": makes,
    }
    found: Any = numba.njit(**options)(function)  # called as the function is
    if not numba.config.DISABLE_JIT:
        found._cache = MachineCode(function)  # where numba's own `cache=True` puts its own
        found._compile_for_args = _unbroken(found._compile_for_args)
    return cast(Function, found)


def _unbroken(compile_for: Callable[..., Any]) -> Callable[..., Any]:
    """Return what numba calls for new kinds of arguments, which compiles or loads, without a signal that breaks in."""
    return lambda *arguments, **named: unbroken(partial(compile_for, *arguments, **named))


def by_field(
    field: str, yes: Callable[[Line, Special], Result], no: Callable[[Line, General], Result]
) -> Callable[[Line, General], Result]:
    """Return a function (line, c) that is `yes` where the record c has a field, else `no`; only one is compiled.

    What few runs need so does not lengthen the first compilation of all others.
    """

    def choose(line, c):  # type: ignore[no-untyped-def]  # numba compares annotations of the two, too
        return (yes if field in c.dtype.names else no)(line, c)

    def typed(line, c):  # type: ignore[no-untyped-def]
        chosen: Any = yes if field in c.fields else no
        function = chosen.py_func
        return FunctionType(
            function.__code__, function.__globals__
        )  # no annotations: numba compares them, too

    numba.extending.overload(choose)(typed)
    return choose
