"""Convergence studies: how the tip depends on elements, time step or modes, and with which order the error falls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal

from fem_needle.convergence.exact_reference import exact_reference
from fem_needle.convergence.refinement import (
    PATHS,
    Level,
    Setting,
    coarsest_time_step,
    finer_otherwise,
    levels_of,
    refuse_refined,
    setting_of,
    size_of,
)
from fem_needle.convergence.rows import ConvergenceRow, RowMaker, best_reference, gathered
from fem_needle.convergence.theoretical_order import theoretical_order
from fem_needle.display import Card, Shown, columns_in_millimeters, in_millimeters, text
from fem_needle.errors import SceneError
from fem_needle.scene import Scene
from fem_needle.scene.settings import overriding
from fem_needle.threads import one_thread

DEFAULT_VALUES = {"elements": (4, 8, 16, 32), "modes": (1, 2, 4, 8)}
DEFAULT_HALVINGS = 4
UNITS = {"elements": "1", "time-step": "s", "modes": "1"}
_COLUMN_UNITS = {"tip_deflection": "m", "richardson_tip": "m", "solve_time": "s", "note": "", "asymptotic": ""}

Over = Literal["elements", "time-step", "modes"]


@dataclass(frozen=True, eq=False, repr=False)
class ConvergenceStudy(Shown):
    """What a convergence study found.

    Attributes
    ----------
    scene
        What was studied.
    over
        What varies: "elements", "time-step" or "modes".
    analysis
        "static" (equilibria), "quasi-static" or "dynamic".
    held
        What is the same in every row, by name; steps in s.
    held_error
        What a halved time step (or twice the elements) changes in the finest row, relative: the error against an exact answer
        does not fall below it. None where nothing is integrated in time or the reference shares it.
    reference
        What the errors refer to: an exact solution or an extrapolation.
    reference_tip
        Its deflection of the tip at the end [m].
    theoretical_order, theory
        Order that theory has for the tip, None where it has none, and why.
    rows
        From coarse to fine.
    """

    scene: Scene
    over: Over
    analysis: str
    held: dict[str, int | float | str]
    held_error: float | None
    reference: str
    reference_tip: float
    theoretical_order: float | None
    theory: str
    rows: tuple[ConvergenceRow, ...]

    @property
    def observed_order(self) -> float | None:
        """Order of the finest row that has one; rows at the round-off have none."""
        orders = [row.observed_order for row in self.rows if row.observed_order is not None]
        return orders[-1] if orders else None

    @property
    def error(self) -> float | None:
        """Relative error of the finest row [1]."""
        return self.rows[-1].error

    def _card(self) -> Card:
        order = "none" if self.observed_order is None else f"{self.observed_order:.3f}"
        facts = (
            ("over", self.over),
            ("rows", str(len(self.rows))),
            ("order", order if self.theoretical_order is None else f"{order} (theory {self.theoretical_order:g})"),
            ("error of the finest", text(self.error, 3) or "unknown"),
            ("reference", self.reference),
            ("its tip", in_millimeters(self.reference_tip, 8)),
            ("analysis", self.analysis),
            ("theory", self.theory),
        )
        return Card("ConvergenceStudy", self.scene.title, facts, columns_in_millimeters(self.columns()))

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the scene as plain data, SI: `converge.json`."""
        names = [field.name for field in fields(self) if field.name not in {"scene", "rows"}]
        result = {name: getattr(self, name) for name in names} | {"observed_order": self.observed_order, "error": self.error}
        head = {"format": 1, "title": self.scene.title, "model": self.scene.model.kind}
        return head | result | {"rows": [asdict(row) for row in self.rows]}

    def columns(self) -> dict[str, list[Any]]:
        """Return the rows as columns under headers such as ``error [1]``: `converge.csv`."""
        units = _COLUMN_UNITS | {"value": UNITS[self.over]}
        result: dict[str, list[Any]] = {}
        for name in (field.name for field in fields(ConvergenceRow)):
            unit = units.get(name, "1")
            shown = self.over.replace("-", "_") if name == "value" else name
            result[f"{shown} [{unit}]" if unit else shown] = [getattr(row, name) for row in self.rows]
        return result


@one_thread
def converge(
    scene: Scene,
    over: Over = "elements",
    values: Sequence[float] | None = None,
    *,
    model: str | None = None,
    elements: int | None = None,
    degree: int | None = None,
    time_step: float | None = None,
    analysis: str | None = None,
) -> ConvergenceStudy:
    """Compute a scene on finer and finer discretizations and tell how the tip converges.

    The error of a row is the largest error of the tip over the run by the largest tip deflection: against the exact solution
    where `fem_needle.exact` has one, else against the Richardson extrapolation of the finest rows. Only one discretization
    varies; a time step that is held fixed is that of the scene, else an eighth of what the automatic choice begins with.

    Parameters
    ----------
    scene
        What to study. Keyword arguments override its ``[model]`` and ``[numerics]`` values.
    over
        "elements", "time-step" or "modes".
    values
        Elements, modes, or time steps [s], at least two, in any order; default: 4, 8, 16, 32 elements; 1, 2, 4, 8 modes; the
        step with which the automatic choice begins and its halves.
    model
        "fem", "assumed-modes" or another installed model.
    elements, degree, time_step
        What is held fixed.
    analysis
        "auto", "dynamic", "quasi-static" or "static".

    Returns
    -------
    ConvergenceStudy
        Rows from coarse to fine, and what they refer to.

    Raises
    ------
    SceneError
        If a setting is impossible, or nothing varies.
    ComputationError
        If a row cannot be computed.
    """
    if over not in PATHS:
        raise SceneError(f"over: is not a choice (got {over!r}; allowed {', '.join(PATHS)})")
    given = {
        "model.kind": model,
        "numerics.elements": elements,
        "numerics.degree": degree,
        "numerics.time_step": time_step,
        "numerics.analysis": analysis,
    }
    refuse_refined(over, given)
    scene = scene.with_values(overriding({path: value for path, value in given.items() if value is not None}))
    wanted = None if values is None else _checked(over, values)
    setting = setting_of(scene, over, wanted or DEFAULT_VALUES.get(over))
    levels = levels_of(setting, wanted or _default_values(setting))
    return _study(setting, levels)


def _checked(over: Over, values: Sequence[float]) -> tuple[float, ...]:
    """Return the values from coarse to fine."""
    ordered = tuple(sorted(set(values), reverse=over == "time-step"))
    if len(ordered) < 2 or len(ordered) < len(values):
        raise SceneError(f"values: got {', '.join(map(str, values))}; allowed two or more that differ")
    if ordered[0] <= 0 or ordered[-1] <= 0:
        raise SceneError(f"values: got {', '.join(map(str, values))}; allowed above 0{' s' if over == 'time-step' else ''}")
    return ordered


def _default_values(setting: Setting) -> tuple[float, ...]:
    if setting.over != "time-step":
        return DEFAULT_VALUES[setting.over]
    step = coarsest_time_step(setting)
    return tuple(step * 0.5**halving for halving in range(DEFAULT_HALVINGS))


def _study(setting: Setting, levels: tuple[Level, ...]) -> ConvergenceStudy:
    """Return the study of finished rows."""
    finest, analysis = levels[-1], setting.analysis
    theory = theoretical_order(finest.plant, setting.over, analysis, [level.value for level in levels])
    exact = exact_reference(setting.scene, analysis, finest.times.tolist())
    other = finer_otherwise(setting, finest) if exact is not None and setting.times is None else None
    evidence = gathered(levels, exact, other)
    reference = best_reference(evidence, theory.order)
    maker = RowMaker(evidence, reference, theory.order, "" if other is None else _held_name(setting, finest))
    return ConvergenceStudy(
        scene=setting.scene,
        over=setting.over,  # type: ignore[arg-type]
        analysis=analysis,
        held=_held(setting, finest),
        held_error=evidence.held_error,
        reference=reference.text,
        reference_tip=float(reference.tips[-1]),
        theoretical_order=theory.order,
        theory=theory.reason,
        rows=tuple(maker.row(index) for index in range(len(levels))),
    )


def _held_name(setting: Setting, finest: Level) -> str:
    """Return what limits the error against an exact answer: the time step, or the size of the model."""
    return "time step" if setting.over != "time-step" else size_of(finest.plant)[0]


def _held(setting: Setting, finest: Level) -> dict[str, int | float | str]:
    """Return what every row shares: the model's other sizes, and the steps where there are any."""
    held = {name: value for name, value in finest.plant.describe().items() if name != setting.over}
    if setting.time_step is not None:
        held["time_step"] = setting.time_step
    if setting.times is None:
        held["output_step"] = setting.output_step
    return held
