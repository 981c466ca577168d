"""Compile physics with numba, and keep what was compiled for the next run.

The one thing that all packages share: a decorator, `compiled`, for functions on plain floats and arrays. What it
compiles is kept by `subzero.jit.machine_code`.

Setting ``NUMBA_DISABLE_JIT=1`` runs the same code interpreted.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any, TypeVar, cast

import llvmlite.binding as llvm
import numba
import numba.extending
from numba.core.codegen import JITCodeLibrary, RuntimeLinker
from numba.core.compiler import Compiler
from numba.core.targetconfig import TargetConfig

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


def _at_a_glance(equal: Callable[[Any, Any], bool]) -> Callable[[Any, Any], bool]:
    """Return a comparison of numba's options that looks at what was set, before it looks up every default.

    Whatever is called in compiled code is looked for by the options of its caller, 140 000 times in a start.
    """
    return lambda one, other: one._values == getattr(other, "_values", None) or equal(one, other)


TargetConfig.__eq__ = _at_a_glance(TargetConfig.__eq__)


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
    """Compile a function as a part of each that calls it: for what is done at every node, and at every stage of a hull.

    A call hands over a `Line` array by array, which takes longer than the arithmetic of a node. The terms of the hull's
    equation, called one by one, take a sixth more.
    """
    return _compile(function, gate=False, inline=True)


def gated_inlined(function: Function) -> Function:
    """Compile a function as `inlined` does, with a gate to Python besides: for what Python calls, too."""
    return _compile(function, gate=True, inline=True)


def _compile(function: Function, *, gate: bool, inline: bool = False, makes: bool = False) -> Function:
    """Compile a function, and keep its machine code."""
    options: dict[str, Any] = {
        "error_model": "numpy",
        "nogil": True,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": not gate,
        "forceinline": inline,
        "_nrt": makes,
    }
    if not gate:
        options["pipeline_class"] = PartsCompiler
    found: Any = numba.njit(**options)(function)  # called as the function is
    if not numba.config.DISABLE_JIT:
        found._cache = MachineCode(function)  # where numba's own `cache=True` puts its own
        found._compile_for_args = _unbroken(found._compile_for_args)
        if not gate:
            _shut(found)
        found.get_call_template = _of_kinds(found.get_call_template)
    return cast(Function, found)


def _shut(found: Any) -> None:
    """Let a function without a gate to Python say so when Python calls it; the interpreter would crash."""

    def refuse(*arguments: Any, **named: Any) -> None:
        name = found.py_func.__qualname__
        raise TypeError(f"{name} is for compiled code only; Python may call what is `gated_inlined`, or "
                        "`compiled` without an underscore.")  # fmt: skip

    found._compile_for_args = refuse
    found.add_overload = lambda made: found.overloads.update({tuple(made.signature.args): made})


def _unbroken(compile_for: Callable[..., Any]) -> Callable[..., Any]:
    """Return what numba calls for new kinds of arguments, which compiles or loads, without a signal that breaks in."""
    return lambda *arguments, **named: unbroken(
        partial(_tidied_later, partial(compile_for, *arguments, **named))
    )


def _tidied_later(work: Callable[[], Result]) -> Result:
    """Return what work makes, without Python's search for what nobody holds any more.

    A compiler makes millions of objects, most of which are held; looking through them again and again takes an eighth
    of its time.
    """
    tidies = gc.isenabled()
    gc.disable()
    try:
        return work()
    finally:
        if tidies:
            gc.enable()


def _of_kinds(template_for: Callable[..., Any]) -> Callable[..., Any]:
    """Return what numba calls for a call in compiled code, which looks at what kind an argument is, not at its value.

    By itself, numba compiles a function anew for each number and truth value that stands in a call.
    """
    unliteral = numba.types.unliteral
    return lambda arguments, named: template_for(
        tuple(map(unliteral, arguments)), {name: unliteral(kind) for name, kind in named.items()}
    )


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


ENVIRONMENT = "_ZN08NumbaEnv"
"""How the name of a global begins through which a function finds its constants of Python."""


class PartsLibrary(JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """The code of a function for those that call it: to link with, and only its environment to run.

    LLVM takes the code of all functions that one calls into the module of that one, and makes machine code of the
    whole. By itself, numba has machine code made of an inner function alone, which nobody runs, and of all that it
    calls, again and again on each level: a tenth of the first compilation. Another tenth is what LLVM does to make that
    code faster, on each level; here it only takes up into a function what that calls, and cleans up behind it.
    """

    _final_module: Any

    def _optimize_final_module(self) -> None:
        """Make the code smaller for those that link with it; the one that is run is made fast with all of it."""
        codegen = self._codegen
        passes, builder = codegen._module_pass_manager(
            loop_vectorize=codegen._loopvect, slp_vectorize=False, opt=codegen._opt_level, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        """Put the code aside for callers, and finish a module that holds no more than the environments."""
        whole = self._final_module
        if not any(each.name.startswith(RuntimeLinker.PREFIX) for each in whole.global_variables):
            self._finalize_dynamic_globals()
            self._verify_declare_only_symbols()
            for function in whole.functions:
                if not function.is_declaration and function.linkage == llvm.Linkage.external:
                    function.linkage = (
                        "linkonce_odr"  # may stand in many modules, as numba's own method has it
                    )
            self._shared_module = whole
            self._final_module = self._environments(whole)
        super()._finalize_final_module()

    def _environments(self, whole: Any) -> Any:
        """Return a module with the environments that stand in another one."""
        empty = str(self.codegen._create_empty_module(self.name))
        found = [str(each) for each in whole.global_variables if each.name.startswith(ENVIRONMENT)]
        return llvm.parse_assembly("\n".join([empty, *found]))


class PartsCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler, which puts a function's code into such a library."""

    def compile_extra(self, function: Any) -> Any:
        """Compile a function of Python."""
        self.state.library = PartsLibrary(self.state.targetctx.codegen(), function.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(function)
