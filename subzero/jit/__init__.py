"""Compile physics, and keep what was compiled: what every package of physics stands on, and nothing else of subzero.

`cable` and `vehicle` import of `subzero` this package and `subzero.errors`, a leaf as well (a contract holds it).

name                                            what for                                              file
----------------------------------------------  ----------------------------------------------------  ------------
compiled, allocating, inner, inlined,
gated_inlined, by_field                         how a function is compiled                            decorators
Record, made_once                               numbers as one record in memory, a single pointer     record
scratch                                         a small array on the stack of a compiled function     stack
compile_beside, Call                            a second process compiles along                        beside
-                                               machine code kept for the next run, never stale       machine_code
-                                               which files a piece of machine code is made of        sources
-                                               signals wait while code is compiled                   unbroken
"""

from subzero.jit.beside import Call, compile_beside
from subzero.jit.decorators import allocating, by_field, compiled, gated_inlined, inlined, inner
from subzero.jit.record import Record, made_once
from subzero.jit.stack import scratch

__all__ = [
    "Call",
    "Record",
    "allocating",
    "by_field",
    "compile_beside",
    "compiled",
    "gated_inlined",
    "inlined",
    "inner",
    "made_once",
    "scratch",
]
