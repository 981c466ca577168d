"""Functions that numba lacks: small work arrays on the stack, and whole numbers that threads change together.

`np.empty` allocates memory, which takes longer than the force on a fin; an array of `scratch` stands on the stack of
the compiled function, at no cost.

Each change of a number by `add` and `exchange` is whole, and all threads see them in one order. What a thread wrote
before such a change, another one reads that has seen the change (`acq_rel` of LLVM's language reference).
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

NUMBERS = types.Array(types.int64, 1, "C")


def _intrinsic(operation: str) -> Any:
    """Return the function (number (1,), operand) → the number before the operation."""

    def typed(context: Any, number: Any, operand: Any) -> Any:
        def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = target.make_array(NUMBERS)(target, builder, arguments[0])
            return builder.atomic_rmw(operation, array.data, arguments[1], "acq_rel")

        return types.int64(NUMBERS, types.int64), generate

    typed.__name__ = f"atomic_{operation}"
    return intrinsic(typed)


def _add(number: np.ndarray, operand: int) -> int:
    """Add to a number in code that is not compiled, for which Python's lock is held only so long."""
    number[0] += operand
    return int(number[0] - operand)


def _exchange(number: np.ndarray, operand: int) -> int:
    before, number[0] = int(number[0]), operand
    return before


add = _add if numba.config.DISABLE_JIT else _intrinsic("add")
"""(number (1,) of int64, the amount) → the number before."""
exchange = _exchange if numba.config.DISABLE_JIT else _intrinsic("xchg")
"""(number (1,) of int64, another one) → the number before."""


def _interpreted(rows: int, columns: int) -> np.ndarray:
    """Return an uninitialised array (rows, columns)."""
    return np.empty((rows, columns))


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]  # numba has no types
def _on_stack(context: Any, rows: Any, columns: Any) -> Any:
    """Return an uninitialised array (rows, columns), valid until the calling function returns."""
    # The size of a stack frame is fixed when the function is compiled.
    if not (isinstance(rows, types.IntegerLiteral) and isinstance(columns, types.IntegerLiteral)):
        return None
    shape = rows.literal_value, columns.literal_value
    kind = types.Array(types.float64, 2, "C")

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = target.make_array(kind)(target, builder)
        # Allocated where the function begins: in a loop the stack does not grow.
        memory = cgutils.alloca_once(builder, ir.DoubleType(), size=shape[0] * shape[1])
        sizes = [target.get_constant(types.intp, n) for n in shape]
        strides = [target.get_constant(types.intp, n) for n in (8 * shape[1], 8)]
        size = target.get_constant(types.intp, 8)
        target.populate_array(array, data=memory, shape=sizes, strides=strides, itemsize=size, meminfo=None)
        return array._getvalue()

    return kind(rows, columns), generate


scratch = _interpreted if numba.config.DISABLE_JIT else _on_stack
"""(rows, columns), both constants → such an array, uninitialised. It must not be returned."""
