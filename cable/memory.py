"""Whether the results of a run fit into memory, checked before allocation: an error, not a process that is killed."""

from __future__ import annotations

from subzero.errors import UserError

SHARE = 0.8
"""A run may ask for this share of the memory that is free. [-]"""
SMALL = 2.0**24
"""Up to this size no check of the free memory is made, as the check takes longer than a second of a short run.
[bytes]"""
GIB = 1024.0**3


def free_memory() -> float:
    """Return how much memory can be had without swapping, within the limit of this process. [bytes]."""
    import psutil

    free = float(psutil.virtual_memory().available)
    try:
        import resource
    except ImportError:  # Windows sets no such limit
        return free
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        free = min(free, float(limit) - psutil.Process().memory_info().vms)
    return max(free, 0.0)


def fits(size: float) -> bool:
    """Return whether so many bytes can be had."""
    return size <= SMALL or size <= SHARE * free_memory()


def refuse_unless_it_fits(size: float, what: str, remedy: str) -> None:
    """Raise a UserError if so many bytes are not available: it names their purpose, and the setting to change."""
    if not fits(size):
        raise UserError(
            f"{what} needs {size / GIB:.3g} GiB of memory, and {free_memory() / GIB:.3g} GiB are free. {remedy}"
        )
