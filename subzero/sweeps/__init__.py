"""Sweeps: a trial with many values of its parameters, on all cores or a cluster, into one dataset, never lost.

    >>> import subzero
    >>> currents = {"water.current_east_m_s": [0.0, 0.1]}
    >>> runs = subzero.sweep("fig6", currents, changes={"run.duration_s": 2.0})
    >>> runs["heading"].dims
    ('member', 'time')

A plan (`plan`) has points (`design`) and the outcomes to keep of each run (`outcomes`). A job (`member`) runs any of
its members anywhere. A schedule (`schedule`) hands them to an executor, of processes here (`workers`) or of a
cluster, and a store (`store`) keeps what comes back. In the end one dataset is written (`result`), and looked at
(`sensitivity`, `figures`). `api` does it all; the command is ``subzero sweep``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from subzero.sweeps.design import Design
    from subzero.sweeps.outcomes import Kept

__all__ = ["Design", "Kept"]

_HOME = {"Design": "subzero.sweeps.design", "Kept": "subzero.sweeps.outcomes"}
"""Name → its module: fetched when it is first used, so that workers begin before numpy is there."""


def __getattr__(name: str) -> Any:
    """Fetch a name from its module, once."""
    if name not in _HOME:
        raise AttributeError(
            f"module 'subzero.sweeps' has no attribute '{name}'; it has {', '.join(__all__)}"
        )
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value
