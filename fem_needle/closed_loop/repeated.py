"""A loop that is run many times, each time with other scatter and other noise: what was drawn, and where the tip arrived."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.repetitions import Draw
from fem_needle.display import Card, Shown, columns_in_millimeters, in_millimeters
from fem_needle.scene import Scene
from fem_needle.scene.signals import INPUT_UNITS, effort_unit

Array = NDArray[np.float64]

BROKEN_OFF = ("failed", "unstable", "interrupted")


@dataclass(frozen=True, eq=False)
class Repetition:
    """One of many runs of a loop.

    Attributes
    ----------
    number
        From 1 on.
    draw
        What makes it differ.
    summary
        Of its run; of one that failed before it began ``stop_reason`` alone.
    failure
        Why it failed, None where it did not.
    time, depth, tip_deflection
        [s], [m], [m]; shape (nt,).
    """

    number: int
    draw: Draw
    summary: dict[str, Any]
    failure: str | None = None
    time: Array = field(default_factory=lambda: np.zeros(0))
    depth: Array = field(default_factory=lambda: np.zeros(0))
    tip_deflection: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def stop_reason(self) -> str:
        """Why it ended."""
        return str(self.summary["stop_reason"])

    @property
    def is_complete(self) -> bool:
        """Whether it went to its end."""
        return self.stop_reason not in BROKEN_OFF

    @property
    def target_error(self) -> float | None:
        """Tip at the target's depth minus where it is wanted [m]; None where the run was broken off or never got there."""
        return float(self.summary["target_error"]) if self.is_complete and self.summary["target_reached"] else None

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI."""
        keys = ("target_reached", "target_time", "target_depth", "effort", "largest_command", "max_abs_tip_deflection", "steps")
        return {
            "repetition": self.number,
            "target_error": self.target_error,
            **{key: self.summary.get(key) for key in keys},
            "stop_reason": self.stop_reason,
            "failure": self.failure,
            "modulus_factor": self.draw.modulus_factor,
            "entry_angle": self.draw.entry_angle,
            "speed_factor": self.draw.speed_factor,
        }


@dataclass(frozen=True, eq=False, repr=False)
class RepeatedLoop(Shown):
    """Many runs of a loop.

    Attributes
    ----------
    scene
        As it is written, without scatter.
    asked
        How many repetitions were asked for.
    repetitions
        Those that were run, in their order; fewer than asked for after an interrupt.
    """

    scene: Scene
    asked: int
    repetitions: tuple[Repetition, ...]

    def _card(self) -> Card:
        facts = (
            ("repetitions", f"{len(self.repetitions)} of {self.asked}"),
            ("arrived", str(self.target_errors.size)),
            ("mean error", in_millimeters(self.mean)),
            ("standard deviation", in_millimeters(self.standard_deviation)),
            ("largest", in_millimeters(self.largest_error)),
            ("failed", str(self.failed)),
            ("missed", str(self.missed)),
        )
        return Card("RepeatedLoop", self.scene.title, facts, columns_in_millimeters(self.columns()))

    @property
    def target_errors(self) -> Array:
        """Errors [m] of the repetitions that arrived at the target, shape (n,)."""
        return np.array([one.target_error for one in self.repetitions if one.target_error is not None])

    @property
    def mean(self) -> float | None:
        """Mean target error [m]; None where no repetition arrived."""
        errors = self.target_errors
        return float(np.mean(errors)) if errors.size else None

    @property
    def standard_deviation(self) -> float | None:
        """Sample standard deviation of the target errors [m], sqrt(sum (e - mean)^2 / (n - 1)); None of fewer than two."""
        errors = self.target_errors
        return float(np.std(errors, ddof=1)) if errors.size > 1 else None

    @property
    def largest_error(self) -> float | None:
        """Largest magnitude of the target errors [m]; None where no repetition arrived."""
        errors = self.target_errors
        return float(np.max(np.abs(errors))) if errors.size else None

    @property
    def failed(self) -> int:
        """How many repetitions failed or became unstable."""
        return sum(one.stop_reason in {"failed", "unstable"} for one in self.repetitions)

    @property
    def missed(self) -> int:
        """How many repetitions went to their end without reaching the target's depth."""
        return sum(one.is_complete and one.target_error is None for one in self.repetitions)

    @property
    def is_interrupted(self) -> bool:
        """Whether not all were run to their end because somebody interrupted them."""
        return len(self.repetitions) < self.asked or any(one.stop_reason == "interrupted" for one in self.repetitions)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI: the same whenever and in how many processes it was computed."""
        scene = self.scene
        described: dict[str, Any] = next((one.summary for one in self.repetitions if "controller" in one.summary), {})
        return {
            "format": 1,
            "title": scene.title,
            "seed": scene.run.seed,
            "scatter": {key: getattr(scene.scatter, key) for key in type(scene.scatter).model_fields},
            "target": {"depth": scene.target.depth, "lateral": scene.target.lateral},
            **{key: described.get(key) for key in ("model", "analysis", "controller", "sensors")},
            "asked": self.asked,
            "arrived": int(self.target_errors.size),
            "failed": self.failed,
            "missed": self.missed,
            "mean": self.mean,
            "standard_deviation": self.standard_deviation,
            "largest_error": self.largest_error,
            "rows": [one.to_dict() for one in self.repetitions],
        }

    def columns(self) -> dict[str, list[Any]]:
        """Return a column for each figure by header with unit, a value for each repetition; None where it has none."""
        rows = [one.to_dict() for one in self.repetitions]
        plain = {"repetition": "1", "target_error": "m", "target_reached": "1", "target_time": "s", "target_depth": "m"}
        drawn = {"stop_reason": "1", "modulus_factor": "1", "entry_angle": "rad", "speed_factor": "1"}
        found = {f"{key} [{unit}]": [row[key] for row in rows] for key, unit in plain.items()}
        for header, key, name in self._of_inputs():
            found[header] = [(row[key] or {}).get(name) for row in rows]
        found["max_abs_tip_deflection [m]"] = [row["max_abs_tip_deflection"] for row in rows]
        return found | {f"{key} [{unit}]": [row[key] for row in rows] for key, unit in drawn.items()}

    def _of_inputs(self) -> Iterator[tuple[str, str, str]]:
        """Yield header, key of a row and name of the input for what depends on inputs."""
        for name in self.inputs:
            yield f"effort_{name} [{effort_unit(name)}]", "effort", name
            yield f"largest_{name} [{INPUT_UNITS[name]}]", "largest_command", name

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what was commanded."""
        named = [name for one in self.repetitions for name in one.summary.get("effort", ())]
        return tuple(name for name in INPUT_UNITS if name in named)
