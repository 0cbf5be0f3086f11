"""A progress bar on stderr, only where something takes long enough to wonder."""

from __future__ import annotations

from math import inf
from textwrap import shorten
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

PATIENCE = 1.0  # s
LONGEST_TITLE = 36  # characters: a longer one leaves no room for the bar


class ProgressBar:
    """An observer of a run that shows how much of it is done.

    Parameters
    ----------
    title
        What is run.
    needs_reader
        Whether nothing is shown where nobody looks: stderr is no terminal and no notebook.
    """

    def __init__(self, title: str, *, needs_reader: bool = False) -> None:
        self._needs_reader = needs_reader
        self._title = shorten(title, LONGEST_TITLE, placeholder="...")
        self._started = perf_counter()
        self._bar: Progress | None = None
        self._task: TaskID | None = None

    def begin(self, plant: Any, choice: dict[str, Any]) -> None:
        """Ignore."""

    def progress(self, fraction: float) -> None:
        """Show a part that is done, 0 to 1."""
        if self._bar is None and perf_counter() - self._started > PATIENCE:
            self._show()
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=fraction)

    def samples(self, block: Any) -> None:
        """Ignore."""

    def stop(self) -> None:
        """Leave the terminal as it was."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def _show(self) -> None:
        from rich.console import Console
        from rich.markup import escape
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        if self._needs_reader and not (console.is_terminal or console.is_jupyter):
            self._started = inf
            return
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
        self._bar = Progress(*columns, console=console, transient=False)
        self._task = self._bar.add_task(escape(self._title), total=1.0)
        self._bar.start()


class Observers:
    """Several observers as one."""

    def __init__(self, *observers: Any) -> None:
        self._observers = observers

    def begin(self, plant: Any, choice: dict[str, Any]) -> None:
        """Tell all."""
        for observer in self._observers:
            observer.begin(plant, choice)

    def progress(self, fraction: float) -> None:
        """Tell all."""
        for observer in self._observers:
            observer.progress(fraction)

    def samples(self, block: Any) -> None:
        """Tell all."""
        for observer in self._observers:
            observer.samples(block)
