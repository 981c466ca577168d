"""Whole numbers that threads change together, in compiled code: each change is whole, and all see them in one order.

What a thread wrote before such a change, another one reads that has seen the change (`acq_rel` of LLVM's language
reference).
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types
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
