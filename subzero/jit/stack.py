"""Small work arrays of a compiled function, on its own stack, at no cost.

`np.empty` allocates memory, which takes longer than the force on a fin.
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
