"""What somebody waits for while code is compiled: a line at once, then how much of it is done. Loads no numba."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LOGGER = logging.getLogger("fem_needle")
Watcher = Callable[[str, float], None]

_WATCHERS: list[Watcher] = []


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Show inside the context how much of a compilation is done.

    Parameters
    ----------
    watcher
        Is called with what is compiled and the share that is done, 0 to 1.
    """
    _WATCHERS.append(watcher)
    try:
        yield
    finally:
        _WATCHERS.remove(watcher)


def begun(what: str, seconds: int, *, is_kept: bool) -> None:
    """Say that a compilation begins."""
    if is_kept:
        LOGGER.warning("compiling the %s, once on this machine (some %d s)", what, seconds)
    else:
        LOGGER.warning(
            "compiling the %s (some %d s), in every process anew: no folder to keep it in can be written, neither the package's"
            " nor the user's; NUMBA_CACHE_DIR may name one",
            *(what, seconds),
        )
    done(what, 0.0)


def done(what: str, share: float) -> None:
    """Tell who watches, the one who came last, how much is done."""
    if _WATCHERS:
        _WATCHERS[-1](what, share)
