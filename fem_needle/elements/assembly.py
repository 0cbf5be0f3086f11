"""The reference element's matrices, assembled with scikit-fem on the unit cell, and the file in which they are kept.

    python -m fem_needle.elements.assembly

writes the file anew. To load scikit-fem takes longer than most runs; a test assembles and compares.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import skfem
from numpy.typing import NDArray

from fem_needle.elements.reference import KEPT

Array = NDArray[np.float64]


class HermiteWithBubble(skfem.ElementLineHermite):
    """Hermite line element with one interior coordinate: how far the middle stands off the cubic."""

    interior_dofs = 1
    maxdeg = 4
    dofnames = ["u", "u_x", "bubble"]  # noqa: RUF012 (scikit-fem's interface)
    doflocs = np.array([[0.0], [0.0], [1.0], [1.0], [0.5]])

    def gdof(self, F, w, i):  # type: ignore[no-untyped-def]
        """Evaluate coordinate ``i`` of a function given with its derivatives."""
        if i < 4:
            return super().gdof(F, w, i)
        (left,), (right,) = w["v"][0], w["v"][1]
        middle = 0.5 * (F[()](left) + F[()](right)) + (right - left) / 8 * (F[(0,)](left) - F[(0,)](right))
        return F[()](0.5 * (left + right)) - middle


def assembled(degree: int) -> dict[str, Array]:
    """Return the matrices of an element of degree 3 or 4 by their names in `ReferenceElement`.

    The unit cell alone is assembled: scikit-fem's global Vandermonde matrices lose digits as cells get small.
    """
    element = skfem.ElementLineHermite() if degree == 3 else HermiteWithBubble()
    basis = skfem.Basis(skfem.MeshLine(np.array([0.0, 1.0])), element, intorder=2 * degree + 2)
    order = np.array([0, 1, 2, 3] if degree == 3 else [0, 1, 4, 2, 3])

    def form(integrand: object) -> Array:
        dense = skfem.BilinearForm(integrand).assemble(basis).toarray()
        return dense[np.ix_(order, order)]

    return {
        # Exact multiples of 0.2: the last digit, times (elements)^4, is an error of the tip.
        "bending": np.round(form(lambda u, v, w: u.hess[0, 0] * v.hess[0, 0]), 9) + 0.0,
        "mass": form(lambda u, v, w: u * v),
        "drag": np.stack([form(lambda u, v, w, p=p: w.x[0] ** p * u.grad[0] * v) for p in (0, 1)]),
        "slip": np.stack([form(lambda u, v, w, p=p: w.x[0] ** p * u.grad[0] * v.grad[0]) for p in (0, 1, 2)]),
    }


def write(path: Path = KEPT) -> None:
    """Write the matrices of both degrees, as JSON with all their digits."""
    kept = {str(degree): {name: array.tolist() for name, array in assembled(degree).items()} for degree in (3, 4)}
    path.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
