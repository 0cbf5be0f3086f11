"""What is compared: a method has settings for each case and prepares a call that returns the tips."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.cases import Case
from fem_needle.errors import NeedleError

Array = NDArray[np.float64]
Solve = Callable[[], Array]

OWN, EXACT, LIBRARY, RIVAL = "fem-needle", "exact", "library", "rival"


class TooSlowError(NeedleError):
    """A run was stopped at its time limit."""


@dataclass(frozen=True)
class Setting:
    """How finely a method works.

    Attributes
    ----------
    elements, modes
        How many.
    time_step
        [s]; None: none is needed, or the method chooses.
    tolerance
        That a method is asked to keep (1).
    variant
        Of the method: a basis, a solver.
    """

    elements: int | None = None
    time_step: float | None = None
    modes: int | None = None
    tolerance: float | None = None
    variant: str = ""

    @property
    def label(self) -> str:
        """The setting in words, such as "16 elements, 0.5 ms"."""
        parts = [
            None if self.elements is None else f"{self.elements} element{'s' * (self.elements > 1)}",
            None if self.modes is None else f"{self.modes} mode{'s' * (self.modes > 1)}",
            self.variant or None,
            None if self.time_step is None else f"{1e3 * self.time_step:.4g} ms",
            None if self.tolerance is None else f"tolerance {self.tolerance:.0e}",
        ]
        return ", ".join(part for part in parts if part)

    def steps(self, case: Case) -> int | None:
        """Return the number of time steps in a case; None where they are not given."""
        if self.time_step is None or case.at_rest:
            return None
        between = max(1, ceil((case.times[1] - case.times[0]) / self.time_step - 1e-9))
        return between * (len(case.times) - 1)


class Method:
    """A way to compute the cases. A subclass gives a name, a kind, settings from coarse to fine, and `prepare`.

    Attributes
    ----------
    name
        In tables and pictures.
    kind
        `OWN`, `EXACT`, `LIBRARY` or `RIVAL`.
    limited
        What keeps its settings from being finer, if anything does.
    choices
        Settings by the name of the case; a case that is not there cannot be done.
    """

    name: ClassVar[str]
    kind: ClassVar[str] = RIVAL
    limited: ClassVar[str] = ""
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {}

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Return the settings for a case from coarse to fine; none where the method cannot do it."""
        return self.choices.get(case.name, ())

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the call that is timed: it returns the tips [m] at the times of the case."""
        raise NotImplementedError

    def whole(self, case: Case, setting: Setting) -> Solve | None:
        """Return the whole answer as a user calls it, preparation included; None where `prepare` leaves nothing out."""
        return None


def over(elements: tuple[int, ...] = (), *, time_steps: tuple[float, ...] = ()) -> tuple[Setting, ...]:
    """Return settings of elements, each with the time step beside it where there are any."""
    if not time_steps:
        return tuple(Setting(elements=count) for count in elements)
    return tuple(Setting(elements=count, time_step=step) for count, step in zip(elements, time_steps, strict=True))
