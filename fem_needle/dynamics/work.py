"""Room for the kernel to work in, and the table through which it finds all its arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation
from fem_needle.dynamics import names as at
from fem_needle.dynamics.arrays import TABLE_COLUMNS
from fem_needle.dynamics.drive import Drive
from fem_needle.dynamics.model import Model

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Work:
    """A needle's arrays by name, and their table.

    Parameters
    ----------
    model
        What does not change.
    method
        Collocation method of the steps, or the nodes of the works between equilibria.
    width
        Unknowns for each coordinate: 2 (the stages of a step) or 1 (an equilibrium).

    Attributes
    ----------
    table
        What compiled functions take: address and sizes of every array (ARRAYS, TABLE_COLUMNS).
    """

    def __init__(self, model: Model, method: Collocation, width: int) -> None:
        self.table: Integers = np.zeros((at.ARRAYS, TABLE_COLUMNS), dtype=np.int64)
        self._arrays: dict[int, NDArray[Any]] = {}
        for name, array in (model.arrays | _method_arrays(method) | _instants(model) | _space(model, width)).items():
            self.put(name, array)
        self.put(at.LIMITS, np.zeros(at.LIMITS_SIZE))
        self.put(at.CURSOR, np.zeros(4, dtype=np.int64))

    def __getitem__(self, name: int) -> NDArray[Any]:
        """Return an array."""
        return self._arrays[name]

    def put(self, name: int, array: NDArray[Any]) -> None:
        """Let the kernel use an array, C-contiguous, under a name."""
        self._arrays[name] = array
        self.table[name, 0] = array.__array_interface__["data"][0]
        self.table[name, 1 : 1 + array.ndim] = array.shape

    def use(self, method: Collocation) -> None:
        """Let steps be taken by a method."""
        for name, array in _method_arrays(method).items():
            self.put(name, array)

    def drive(self, drive: Drive) -> None:
        """Let signals act."""
        self.put(at.SIGNALS, drive.rows)
        self.put(at.SIGNAL_ENDS, drive.offsets)


def _method_arrays(method: Collocation) -> dict[int, NDArray[Any]]:
    rows = (method.nodes, method.weights, method.end, method.start_slope, method.end_slope)
    return {
        at.INVERSE: np.ascontiguousarray(method.inverse),
        at.METHOD: np.ascontiguousarray(np.stack(rows)),
        at.POWER_SLOPES: np.ascontiguousarray(method.power_slopes),
    }


def _instants(model: Model) -> dict[int, NDArray[Any]]:
    """Return the arrays that have a row for each instant of a step."""
    count, n, p = at.INSTANTS, model.size, model.points
    pieces, m, _ = model.arrays[at.COEFFICIENTS].shape
    blocks, printed = model.arrays[at.BEAM].shape[1], n if model.switches[at.PRINTED] else 1
    shapes = {
        at.COURSES: (at.COURSE,), at.CLAMP: (3, 2), at.FORCES: (p,), at.FORCE_RATES: (p,), at.PATH_LOAD: (n,),
        at.PATH_LOAD_RATE: (n,), at.PATH_CONSTANTS: (2,), at.KNOWN: (n,), at.RATES: (n,), at.MOMENTA: (n,),
        at.PRINTED_ERRORS: (2, printed, printed), at.TISSUE_BLOCKS: (blocks, 4, m, m), at.POINT_ROWS: (p, m),
        at.POINT_RATES: (p, m), at.POINT_PLACES: (p, 2), at.FLEXIBLE: (p, p), at.FLEXIBLE_RATE: (p, p),
        at.INSTANT_SUMS: (at.SUMS,),
    }  # fmt: skip
    found: dict[int, NDArray[Any]] = {name: np.zeros((count, *shape)) for name, shape in shapes.items()}
    found[at.COVERED] = np.full((count, pieces, 3), np.nan)
    found[at.POINT_FIRST] = np.zeros((count, p), dtype=np.int64)
    found[at.NODE_TIPS] = np.zeros(2)
    return found


def _space(model: Model, width: int) -> dict[int, NDArray[Any]]:
    """Return the other arrays; nothing in them outlives a call."""
    n, p, guides = model.size, model.points, max(1, int(model.switches[at.GUIDES]))
    pieces, m, orders = model.arrays[at.COEFFICIENTS].shape
    blocks, unknowns, k = model.arrays[at.BEAM].shape[1], width * guides, 2 * width
    swept = blocks if model.switches[at.STRIDE] else 0
    dense = 0 if model.switches[at.STRIDE] else width * n
    shapes: dict[int, tuple[int, ...]] = {
        at.FRESH: (pieces, 3), at.SHAPE: (3, m), at.SIDES: (2, n), at.ANSWER: (width * n,),
        at.COLUMNS: (unknowns, width * n), at.ANSWERS: (unknowns, width * n), at.DENSE: (unknowns, unknowns),
        at.SCRATCH: (unknowns, unknowns), at.GAPS: (unknowns,), at.GUIDE_FORCES: (3, unknowns), at.CUT_COLUMNS: (2, 2 * n),
        at.CUT_LOAD: (2, n), at.CUT_LOAD_RATE: (2, n), at.CUBIC: (4,), at.OTHER_CUBIC: (4,), at.CUT_PAIR: (2, 2),
        at.CUT_MOMENTS: (2, orders), at.MATRICES: (blocks, width * m, width * m), at.NODE_MATRICES: (swept + 1, k, k),
        at.SHARES: (max(1, swept), 3, k, k), at.FACTORS: (dense, dense), at.STIFFNESSES: (width,), at.BEAM_GAPS: (swept, k),
        at.VECTORS: (2, n), at.PAIR: (12,), at.KEPT_LATERAL: (2, n), at.KEPT_AXIAL: (at.AXIAL,), at.KEPT_LEDGER: (at.LEDGER,),
        at.KEPT_HELD: (p,),
    }  # fmt: skip
    found: dict[int, NDArray[Any]] = {name: np.zeros(shape) for name, shape in shapes.items()}
    found[at.KEY] = np.full(7, np.nan)
    given = n if model.switches[at.GIVEN] or model.switches[at.RESOLVES] else 1
    found |= {
        at.ASKED: np.zeros(1, dtype=np.int64), at.ANSWERED: np.zeros(4), at.ANSWERED_LOAD: np.zeros((2, given)),
        at.SUBSPACE: np.zeros((at.INSTANTS, given, given)), at.RANKS: np.zeros(at.INSTANTS, dtype=np.int64),
        at.REDUCED: np.zeros((width * given, width * given)), at.REDUCED_VALUES: np.zeros(2 * width * given),
        at.REDUCED_WORK: np.zeros((given, given)),
    }  # fmt: skip
    for name, size in ((at.CHANGED, blocks), (at.OTHER_CHANGED, blocks), (at.CHOSEN, guides)):
        found[name] = np.zeros(size, dtype=np.int64)
    return found
