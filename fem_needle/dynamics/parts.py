"""Parts of a run, and how the needle gets through each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

EQUILIBRIA, CREEP_STEPS = "equilibria", "steps without inertia"
FOLLOWED, PASSED_OVER, COSINES = "steps with inertia", "steps over vibrations", "cosines"


@dataclass(frozen=True)
class Part:
    """A part of a run.

    Attributes
    ----------
    begin, end
        Times [s].
    how
        "equilibria"; "steps without inertia"; "steps with inertia"; "steps over vibrations": with inertia, by an L-stable method
        that need not follow them; "cosines": eigenvectors once, no steps.
    reason
        Why.
    moved
        How far inertia moves the tip there at most, relative to its largest deflection, but for vibrations that the tissue damps
        before they are seen; 0 where that was not looked at.
    """

    begin: float
    end: float
    how: str
    reason: str
    moved: float = 0.0


def part_at(parts: Sequence[Part], time: float) -> Part:
    """Return the part of a time [s]."""
    return next((part for part in parts if time < part.end), parts[-1])


def is_passed_over(parts: Sequence[Part], time: float) -> bool:
    """Return whether steps at a time [s] pass over vibrations."""
    return bool(parts) and part_at(parts, time).how == PASSED_OVER


def cosines_from(parts: Sequence[Part]) -> float:
    """Return when cosines take over from steps [s]; infinite where they never do."""
    return parts[-1].begin if parts and parts[-1].how == COSINES else float("inf")
