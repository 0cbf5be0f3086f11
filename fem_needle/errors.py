"""The package's exceptions and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


class NeedleError(Exception):
    """Base of every error that the package raises on purpose."""


class SceneError(NeedleError, ValueError):
    """Impossible input: every mistake of a scene at once.

    Parameters
    ----------
    mistakes
        One line each: path of the key, value, unit and allowed range.
    """

    def __init__(self, mistakes: Sequence[str] | str) -> None:
        self.mistakes = (mistakes,) if isinstance(mistakes, str) else tuple(mistakes)
        super().__init__("\n".join(self.mistakes))


class ComputationError(NeedleError, RuntimeError):
    """A computation failed: says at which time and depth, and what to change.

    Attributes
    ----------
    partial
        What was computed before, such as a trajectory, or None.
    """

    partial: Any = None


class SuspiciousValueWarning(UserWarning):
    """Possible but unlikely input; the message names the inequality."""


def no_memory(error: MemoryError) -> str:
    """Return the message of a computation that found no memory."""
    return f"not enough memory ({str(error) or 'no size told'}); use fewer elements, output_points or samples"
