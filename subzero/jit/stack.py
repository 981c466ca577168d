"""Small arrays that a compiled function works on and forgets: on its own stack, made in no time.

`np.empty` asks the system for memory, which takes longer than the force on a fin.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _interpreted(rows: int, columns: int) -> np.ndarray:
    """Return an array (rows, columns) of anything."""
    return np.empty((rows, columns))


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]  # numba has no types
def _on_stack(context: Any, rows: Any, columns: Any) -> Any:
    """Return an array (rows, columns) of anything, for as long as the function that asks is running."""
    if not (isinstance(rows, types.IntegerLiteral) and isinstance(columns, types.IntegerLiteral)):
        return None
    shape = rows.literal_value, columns.literal_value
    kind = types.Array(types.float64, 2, "C")

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = target.make_array(kind)(target, builder)
        room = cgutils.alloca_once(builder, ir.DoubleType(), size=shape[0] * shape[1])
        sizes = [target.get_constant(types.intp, n) for n in shape]
        strides = [target.get_constant(types.intp, n) for n in (8 * shape[1], 8)]
        size = target.get_constant(types.intp, 8)
        target.populate_array(array, data=room, shape=sizes, strides=strides, itemsize=size, meminfo=None)
        return array._getvalue()

    return kind(rows, columns), generate


scratch = _interpreted if numba.config.DISABLE_JIT else _on_stack
"""(rows, columns), both constants → such an array; its values are what was left there. Not to be given back."""
