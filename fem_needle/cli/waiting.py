"""How much of a compilation is done, as a bar on a terminal; elsewhere the line that says what is compiled must do."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from fem_needle.dynamics.notice import watched
from fem_needle.progress_bar import ProgressBar


@contextmanager
def compilations_shown() -> Iterator[None]:
    """Show inside the context what is compiled."""
    shown = _Shown()
    try:
        with watched(shown.show):
            yield
    finally:
        shown.stop()


class _Shown:
    """The bar of the compilation that is going on."""

    def __init__(self) -> None:
        self._bar: ProgressBar | None = None

    def show(self, what: str, share: float) -> None:
        if not sys.stderr.isatty():
            return
        if self._bar is None:
            self._bar = ProgressBar(f"compiling the {what}")
        self._bar.progress(share)
        if share >= 1.0:
            self.stop()

    def stop(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
