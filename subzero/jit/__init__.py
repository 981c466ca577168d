"""Compile physics, and keep the compiled code: the only part of subzero that the packages of physics use.

name                                            purpose                                               file
----------------------------------------------  ----------------------------------------------------  ------------
compiled, allocating, inner, inlined,
expanded, gated_inlined, by_field …             how a function is compiled                            decorators
Record, made_once                               numbers as one record in memory, a single pointer     record
scratch                                         a small array on the stack of a compiled function     intrinsics
add, exchange                                   whole numbers that threads change together            intrinsics
compile_in_parallel, Call                       a second process compiles at the same time            parallel
deferred_signals                                signals wait while code is compiled                   signals
-                                               compiled code kept for the next run                   machine_code
"""

from subzero.jit.decorators import (
    allocating,
    by_field,
    by_field_at,
    by_field_in_step,
    compiled,
    expanded,
    gated_inlined,
    inlined,
    inner,
)
from subzero.jit.intrinsics import scratch
from subzero.jit.parallel import Call, compile_in_parallel
from subzero.jit.record import Record, made_once
from subzero.jit.signals import deferred_signals

__all__ = [
    "Call",
    "Record",
    "allocating",
    "by_field",
    "by_field_at",
    "by_field_in_step",
    "compile_in_parallel",
    "compiled",
    "deferred_signals",
    "expanded",
    "gated_inlined",
    "inlined",
    "inner",
    "made_once",
    "scratch",
]
