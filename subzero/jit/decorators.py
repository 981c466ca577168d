"""Compile physics with numba, and keep the compiled code for the next run.

Decorators for functions on plain floats and arrays, shared by all packages. `subzero.jit.machine_code` keeps the
code. Setting ``NUMBA_DISABLE_JIT=1`` runs the same code interpreted.
"""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any, TypeVar, cast

import numba
import numba.extending
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher

from subzero.jit.machine_code import MachineCode
from subzero.jit.signals import deferred_signals

Function = TypeVar("Function", bound=Callable[..., Any])
Result = TypeVar("Result")

LEVEL = type(numba.config.OPT)(1)
"""LLVM's first level of optimisation: the first compilation is shorter, and the loop runs a fifth faster."""


def compiled(function: Function) -> Function:
    """Compile a function of plain floats and arrays; strict IEEE arithmetic, so runs repeat to the last bit.

    It borrows its arrays: it makes none and returns none (`allocating` may). Without reference counts of arrays the
    coupled loop takes two thirds of the time.

    A function whose name starts with an underscore is compiled as by `inner`.
    """
    return inner(function) if function.__name__.startswith("_") else _compile(function, Kernel)


def allocating(function: Function) -> Function:
    """Compile a function that makes or returns arrays, otherwise as `compiled` does."""
    kind = InnerKernel if function.__name__.startswith("_") else Kernel
    return _compile(function, kind, _nrt=True)


def inner(function: Function) -> Function:
    """Compile a function that only compiled code calls: without a Python wrapper it is ready sooner."""
    return _compile(function, InnerKernel)


def inlined(function: Function) -> Function:
    """Compile a function as a part of each caller: for computations at every node, and at every stage of a hull.

    A call passes a `Line` array by array, which takes longer than the arithmetic of a node. The terms of the hull's
    equation, called one by one, take a sixth more.
    """
    return _compile(function, InnerKernel, forceinline=True)


def expanded(function: Function) -> Function:
    """Write a function out in its callers before they are compiled: for a long one with one or two of them.

    The compiler optimises a function together with all that it calls, and does so again for the caller: a chain of five
    functions around the step of a cable would be optimised five times. Only compiled code may call it.
    """
    return _compile(function, InnerKernel, inline="always")


def gated_inlined(function: Function) -> Function:
    """Compile a function as `inlined` does, with a Python wrapper: for functions that Python calls, too."""
    return _compile(function, Kernel, forceinline=True)


def _compile(function: Function, kind: type[Kernel], **more: Any) -> Function:
    """Return the compiled function; arrays are not counted unless `more` says so."""
    if numba.config.DISABLE_JIT:
        return function
    # As in numpy, division by 0 gives an infinity; without the GIL, simulations run in threads side by side.
    options = {
        "nopython": True,
        "error_model": "numpy",
        "nogil": True,
        "no_cfunc_wrapper": True,
        "_nrt": False,
    }
    made = kind(function, targetoptions=options | {"no_cpython_wrapper": kind is InnerKernel} | more)
    made.enable_caching()
    return cast(Function, made)


class Kernel(CPUDispatcher):  # type: ignore[misc]  # numba has no types
    """A compiled function with kept code, compiled once for each combination of argument types.

    numba alone compiles a function again for each literal number and truth value in a call.
    """

    machine_code: MachineCode

    def enable_caching(self) -> None:
        """Use `MachineCode` instead of numba's own cache."""
        self._cache = self.machine_code = MachineCode(self.py_func)

    def compile(self, signature: Any) -> Any:
        """Compile or load the function for a signature."""
        # The name and the settings are those of one compilation: runs in threads wait for each other here.
        with global_compiler_lock, _undisturbed(), _named_by(self.py_func, signature):
            return super().compile(signature)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Return how a call in compiled code is typed: by types of arguments, not by values."""
        unliteral = numba.types.unliteral
        kinds = {name: unliteral(kind) for name, kind in named.items()}
        return super().get_call_template(tuple(map(unliteral, arguments)), kinds)


@contextmanager
def _named_by(function: Any, signature: Any) -> Iterator[None]:
    """Name a function by the types of its arguments while it is compiled.

    The names in kept code are all that a linker goes by, and numba makes them of numbers that it counts anew in each
    process: code of two processes for two kinds of records had the same name, and one was taken for the other.
    """
    name = function.__qualname__
    function.__qualname__ = f"{name}_{_digest(signature)}"
    try:
        yield
    finally:
        function.__qualname__ = name


def _digest(signature: Any) -> str:
    """Return 24 hexadecimal digits of types of arguments, the same in every process."""
    return hashlib.sha256(repr(signature).encode()).hexdigest()[:24]


class InnerKernel(Kernel):
    """A compiled function without a Python wrapper: called by Python, the interpreter would crash, so it refuses."""

    def _compile_for_args(self, *arguments: Any, **named: Any) -> None:
        raise TypeError(
            f"{self.py_func.__qualname__} is for compiled code only; Python may call what is `gated_inlined`, or "
            "`compiled` without an underscore."
        )

    def add_overload(self, made: Any) -> None:
        """Remember the compiled code, but not for calls from Python."""
        # numba would also register the entry point for calls from Python, which this function lacks.
        self.overloads[tuple(made.signature.args)] = made


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Compile at our level of optimisation, without signals, and without garbage collection, an eighth of the
    time.
    """
    # These settings are global: they are restored even if compiling fails.
    level, collects = numba.config.OPT, gc.isenabled()
    with deferred_signals():
        numba.config.OPT = LEVEL
        gc.disable()
        try:
            yield
        finally:
            numba.config.OPT = level
            if collects:
                gc.enable()


def _plain(kernel: Any, kinds: Any) -> FunctionType:
    """Return the function of a kernel without annotations, named by types of its arguments as by `_named_by`."""
    function = kernel.py_func
    plain = FunctionType(function.__code__, function.__globals__)
    plain.__qualname__ = f"{function.__qualname__}_{_digest(kinds)}"
    return plain


def by_field(field: str, yes: Callable[..., Result], no: Callable[..., Result]) -> Callable[..., Result]:
    """Return a function (line, c, …) that is `yes` where the record c has a field, else `no`; only one is compiled.

    So a feature of few simulations does not lengthen the first compilation of all others.
    """

    def choose(line, c, *more):  # type: ignore[no-untyped-def]  # numba compares annotations of the two, too
        return (yes if field in c.dtype.names else no)(line, c, *more)

    def typed(line, c, *more):  # type: ignore[no-untyped-def]
        return _plain(yes if field in c.fields else no, (line, c))

    # Not strict: the chosen functions have names and a number of arguments of their own.
    numba.extending.overload(choose, strict=False)(typed)
    return choose


by_field_at = by_field_in_step = by_field
"""The same for (line, c, index of a segment), and (line, c, weights of the step, whether slopes are asked for)."""
