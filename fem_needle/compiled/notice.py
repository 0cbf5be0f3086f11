"""Say so when somebody has to wait for a compilation: once, then it is kept beside the package or in the user's cache."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from numba.core import config, event

from fem_needle.compiled.loop import run_steps

LOGGER = logging.getLogger("fem_needle")
OPTIMIZATION = 2


class _Announcer(event.Listener):
    """Announces the compilation of the loop, not those of its parts."""

    def on_start(self, event: event.Event) -> None:
        """Announce it."""
        if event.data["dispatcher"] is run_steps:
            LOGGER.warning("compiling the time loop, once on this machine (some seconds)")

    def on_end(self, event: event.Event) -> None:
        """Nothing to say."""


@contextmanager
def announced() -> Iterator[None]:
    """Announce compilations inside the context, and optimize one step less than numba does: the same loop, a fifth sooner."""
    usual = config.OPT  # type: ignore[attr-defined]
    config.OPT = type(usual)(OPTIMIZATION)  # type: ignore[attr-defined]
    try:
        with event.install_listener("numba:compile", _Announcer()):
            yield
    finally:
        config.OPT = usual  # type: ignore[attr-defined]
