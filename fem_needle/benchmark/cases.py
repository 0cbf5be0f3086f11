"""The cases of the benchmark and what an error is in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle.dynamics.grid import output_times
from fem_needle.errors import SceneError
from fem_needle.motion import run_duration
from fem_needle.scene import Scene
from fem_needle.scene_file import load_scene

Array = NDArray[np.float64]

BRACHYTHERAPY_OUTPUT = 0.05  # s


@dataclass(frozen=True, eq=False)
class Case:
    """A scene, the times at which its tip counts, and the scale of its error.

    Attributes
    ----------
    name
        "S", "D", "M", "M2" or "brachytherapy".
    shipped
        Name of the shipped scene.
    about
        What is computed, in one line.
    output_step
        Between the times at which the tip counts [s]; None for a needle at rest, where one number counts.
    over_first
        Whether the error is relative to the first deflection; else to the largest.
    shortened
        In place of the scene's duration [s]; None: the scene's.
    """

    name: str
    shipped: str
    about: str
    output_step: float | None
    over_first: bool = False
    shortened: float | None = None

    @cached_property
    def scene(self) -> Scene:
        """The shipped scene with the output of the case."""
        step = self.duration if self.output_step is None else self.output_step
        return self._shipped.with_value("numerics.output_step", step)

    @cached_property
    def times(self) -> Array:
        """Times at which the tip counts [s]."""
        return np.zeros(1) if self.output_step is None else np.array(output_times(self.duration, self.output_step))

    @property
    def at_rest(self) -> bool:
        """Whether one equilibrium is the answer."""
        return self.output_step is None

    @property
    def duration(self) -> float:
        """Length of the run [s]."""
        return run_duration(self._shipped) if self.shortened is None else self.shortened

    @cached_property
    def _shipped(self) -> Scene:
        scene = load_scene(self.shipped)
        return scene if self.shortened is None else scene.with_value("run.duration", self.shortened)

    def error(self, tips: Array, reference: Array) -> float:
        """Return the largest tip error / first or largest |tip| of the reference (1); infinite where a tip is no number.

        Parameters
        ----------
        tips, reference
            Tip deflections at the times [m].

        Raises
        ------
        ValueError
            If there are not as many tips as times.
        """
        if np.shape(tips) != reference.shape:
            raise ValueError(f"{self.name}: {np.shape(tips)} tips (allowed {reference.shape})")
        scale = abs(float(reference[0])) if self.over_first else float(np.max(np.abs(reference)))
        largest = float(np.max(np.abs(tips - reference)))
        return largest / scale if np.isfinite(largest) else float("inf")


CASES = (
    Case("S", "bench-s", "at rest under a tip force", None),
    Case("D", "bench-d", "the shape of S let go, undamped", 1e-4, over_first=True),
    Case("M", "bench-m", "insertion with inertia", 0.01),
    Case("M2", "bench-m2", "insertion, tip force swinging at 30 Hz", 0.01),
    Case("brachytherapy", "brachytherapy", "hub, template, viscous layers", BRACHYTHERAPY_OUTPUT),
)


def cases_of(names: Sequence[str]) -> tuple[Case, ...]:
    """Return cases by name, capitals or not, or by the name of their scene; all without names.

    Raises
    ------
    SceneError
        If a name is unknown.
    """
    known = {key.lower(): case for case in CASES for key in (case.name, case.shipped)}
    wrong = [name for name in names if name.lower() not in known]
    if wrong:
        allowed = ", ".join(case.name for case in CASES)
        raise SceneError([f"CASES: unknown case (got {name!r}; allowed {allowed})" for name in wrong])
    wanted = [known[name.lower()] for name in names] or CASES
    return tuple(case for case in CASES if case in wanted)
