"""Rows of a convergence study: errors, orders, Richardson values and grid convergence indices of finished answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.convergence.exact_reference import ExactReference
from fem_needle.convergence.refinement import Level
from fem_needle.convergence.richardson import correction_factor, grid_convergence_index, order_from_differences, order_from_errors

Array = NDArray[np.float64]

FLOOR_FACTOR = 10.0  # an error or a difference below this times a floor says nothing about an order
ASYMPTOTIC = 0.15  # how far an observed order may be from that of theory, or from the one before
SMALLEST_ROUND_OFF = 1e-15
ROUND_OFF = "round-off"


@dataclass(frozen=True)
class ConvergenceRow:
    """One discretization of a study; relative figures refer to the largest deflection of the tip over the run.

    Attributes
    ----------
    value
        Elements, modes, or time step [s].
    tip_deflection
        At the end [m].
    error
        Largest error of the tip over the run [1]; None where there is nothing to refer to.
    shape_error
        Root mean square error of the shape at the end by that of the shape [1].
    observed_order
        With which the error fell from the row before: from two errors against an exact answer, else from the differences of
        three rows. None where the floor (`note`) leaves none.
    three_row_order
        From the differences of three rows in both cases.
    richardson_tip
        Tip at the end, extrapolated from this row and the one before [m].
    grid_convergence_index, coarse_grid_convergence_index
        Of this row and of the one before, as fine and as coarse grid, safety factor 1.25 [1].
    asymptotic
        Whether the order is within 15 % of theory, or without theory of the order of the row before.
    round_off
        Floor of the error from round-off [1].
    note
        Why the order is missing or doubtful: "round-off", "limited by the time step" (or elements, modes), "oscillates",
        "diverges", or nothing.
    solve_time
        [s].
    """

    value: float
    tip_deflection: float
    error: float | None
    shape_error: float | None
    observed_order: float | None
    three_row_order: float | None
    richardson_tip: float | None
    grid_convergence_index: float | None
    coarse_grid_convergence_index: float | None
    asymptotic: bool | None
    round_off: float
    note: str
    solve_time: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """Answers of all rows on the instants that they share.

    Attributes
    ----------
    levels
        Coarse to fine.
    tips
        Tip deflections [m], shape (rows, nt).
    exact
        The exact answer on the same instants, or None.
    scale
        Largest tip deflection [m], not below the scene's absolute tolerance.
    held_error
        Relative change of the finest row when what is held fixed is made finer; None where that is of no matter.
    """

    levels: tuple[Level, ...]
    tips: Array
    exact: ExactReference | None
    scale: float
    held_error: float | None

    def difference(self, row: int) -> float:
        """Return the largest difference of a row from the row before, relative."""
        return float(np.max(np.abs(self.tips[row] - self.tips[row - 1]))) / self.scale

    def oscillates(self, row: int) -> bool:
        """Return whether this row's change undoes the change before."""
        return row >= 2 and float((self.tips[row] - self.tips[row - 1]) @ (self.tips[row - 1] - self.tips[row - 2])) < 0.0

    def ratio(self, row: int) -> float:
        """Return the refinement ratio between the row before and a row."""
        return self.levels[row - 1].size / self.levels[row].size

    def round_off(self, row: int) -> float:
        """Return the larger round-off of a row and the row before, relative."""
        return max(SMALLEST_ROUND_OFF, *(level.round_off for level in self.levels[max(row - 1, 0) : row + 1]))

    def differs_by_more_than_round_off(self, row: int) -> bool:
        """Return whether the difference from the row before says something about an order."""
        return self.difference(row) > FLOOR_FACTOR * self.round_off(row)

    def three_row_order(self, row: int) -> float | None:
        """Return the order from this row and the two before it; None where round-off hides a difference."""
        if row < 2 or not all(self.differs_by_more_than_round_off(index) for index in (row - 1, row)):
            return None
        sign = -1.0 if self.oscillates(row) else 1.0
        coarse, fine = sign * self.difference(row - 1), self.difference(row)
        return order_from_differences(coarse, fine, self.ratio(row - 1), self.ratio(row))

    def extrapolated(self, row: int, order: float, values: Sequence[Array] | Array) -> Array:
        """Return the Richardson value of something that all rows have, from a row and the row before."""
        factor = correction_factor(order, self.ratio(row), oscillates=self.oscillates(row))
        return np.asarray(values[row] + factor * (values[row] - values[row - 1]))


@dataclass(frozen=True, eq=False)
class Reference:
    """What errors refer to: text, tips [m], shape at the end [m]; ``is_known`` is false where it is only the finest row."""

    text: str
    tips: Array
    shape: Array | None
    is_known: bool = True


def gathered(levels: tuple[Level, ...], exact: ExactReference | None, other: Level | None) -> Evidence:
    """Return the answers on common instants; runs that end by themselves may differ by samples, their ends are compared.

    Parameters
    ----------
    levels
        Coarse to fine.
    exact
        On the instants of the finest row.
    other
        The finest row once more with what is held fixed made finer.
    """
    count = min(len(level.times) for level in levels)

    def common(values: Array) -> Array:
        return np.append(values[: count - 1], values[-1])

    tips = np.stack([common(level.tips) for level in levels])
    known = tips[-1] if exact is None else common(exact.tips)
    scale = max(float(np.max(np.abs(known))), levels[-1].plant.scene.numerics.absolute_tolerance)
    held = None if other is None else float(np.max(np.abs(common(other.tips) - tips[-1]))) / scale
    shared = None if exact is None else ExactReference(exact.text, common(exact.tips), exact.shape)
    return Evidence(levels, tips, shared, scale, held)


def best_reference(evidence: Evidence, theoretical_order: float | None) -> Reference:
    """Return the exact answer, else the extrapolation of the finest rows that round-off leaves, else the finest row."""
    if evidence.exact is not None:
        return Reference(evidence.exact.text, evidence.exact.tips, evidence.exact.shape)
    for row in range(len(evidence.levels) - 1, 0, -1):
        if not evidence.differs_by_more_than_round_off(row):
            continue
        order = limited(evidence.three_row_order(row), theoretical_order)
        if order is None and row == 1:
            order = theoretical_order
        if order is not None and order > 0.0:
            return _extrapolation(evidence, row, order)
    finest = evidence.levels[-1]
    return Reference(f"the finest row, {finest.value:g}: no order to extrapolate with", evidence.tips[-1], finest.shape, False)


def _extrapolation(evidence: Evidence, row: int, order: float) -> Reference:
    coarse, fine = evidence.levels[row - 1], evidence.levels[row]
    text = f"Richardson extrapolation of {coarse.value:g} and {fine.value:g} with order {order:.2f}"
    shapes = [level.shape for level in evidence.levels]
    return Reference(text, evidence.extrapolated(row, order, evidence.tips), evidence.extrapolated(row, order, shapes))


def limited(order: float | None, theoretical_order: float | None) -> float | None:
    """Return an observed order, not above that of theory: a lucky high one would promise too small an error."""
    return order if order is None or theoretical_order is None else min(order, theoretical_order)


@dataclass(frozen=True, eq=False)
class RowMaker:
    """Makes the rows of one study.

    Attributes
    ----------
    evidence
        The answers.
    reference
        What errors refer to.
    theoretical_order
        Of the tip, or None.
    held_name
        What is held fixed and may limit the error: "time step", "elements", "modes", or nothing.
    """

    evidence: Evidence
    reference: Reference
    theoretical_order: float | None
    held_name: str

    def row(self, index: int) -> ConvergenceRow:
        """Return a row."""
        level, order = self.evidence.levels[index], self._order(index)
        three = self.evidence.three_row_order(index)
        used = limited(three if three is not None else order, self.theoretical_order)
        fine, coarse, richardson = self._extrapolation(index, used)
        return ConvergenceRow(
            value=level.value,
            tip_deflection=float(level.tips[-1]),
            error=self._error(index),
            shape_error=self._shape_error(index),
            observed_order=order,
            three_row_order=three,
            richardson_tip=richardson,
            grid_convergence_index=fine,
            coarse_grid_convergence_index=coarse,
            asymptotic=self._is_asymptotic(index, order),
            round_off=max(level.round_off, SMALLEST_ROUND_OFF),
            note=self._note(index, order),
            solve_time=level.solve_time,
        )

    def _error(self, index: int) -> float | None:
        if not self.reference.is_known:
            return None
        return float(np.max(np.abs(self.evidence.tips[index] - self.reference.tips))) / self.evidence.scale

    def _shape_error(self, index: int) -> float | None:
        shape = self.reference.shape
        if shape is None or not self.reference.is_known or not np.any(shape):
            return None
        return float(np.linalg.norm(self.evidence.levels[index].shape - shape) / np.linalg.norm(shape))

    def _order(self, index: int) -> float | None:
        """Return the order from the row before to this one, None where a floor hides it."""
        if index == 0 or self._floor(index) or self._floor(index - 1):
            return None
        if self.evidence.exact is None:
            return self.evidence.three_row_order(index)
        return order_from_errors(self._error(index - 1) or 0.0, self._error(index) or 0.0, self.evidence.ratio(index))

    def _floor(self, index: int) -> str:
        """Return what the error of a row (without an exact answer: its difference from the row before) cannot fall below."""
        if self.evidence.exact is None:
            hidden = index > 0 and not self.evidence.differs_by_more_than_round_off(index)
            return ROUND_OFF if hidden else ""
        error = self._error(index) or 0.0
        if error <= FLOOR_FACTOR * max(self.evidence.levels[index].round_off, SMALLEST_ROUND_OFF):
            return ROUND_OFF
        return f"limited by the {self.held_name}" if error <= FLOOR_FACTOR * (self.evidence.held_error or 0.0) else ""

    def _note(self, index: int, order: float | None) -> str:
        floor = self._floor(index)
        if floor:
            return floor
        if order is not None and order <= 0.0:
            return "diverges"
        return "oscillates" if order is not None and self.evidence.oscillates(index) else ""

    def _extrapolation(self, index: int, order: float | None) -> tuple[float | None, float | None, float | None]:
        """Return both grid convergence indices and the Richardson value of the tip at the end [m]."""
        if index == 0 or order is None or order <= 0.0 or not self.evidence.differs_by_more_than_round_off(index):
            return None, None, None
        ratio = self.evidence.ratio(index)
        fine = grid_convergence_index(self.evidence.difference(index), order, ratio)
        value = float(self.evidence.extrapolated(index, order, self.evidence.tips)[-1])
        return fine, fine * ratio**order, value

    def _is_asymptotic(self, index: int, order: float | None) -> bool | None:
        expected = self.theoretical_order if self.theoretical_order is not None else self._order(index - 1) if index else None
        if order is None or expected is None or expected <= 0.0:
            return None
        return abs(order / expected - 1.0) <= ASYMPTOTIC
