"""scikit-fem as its documentation shows it: assembled and factored in every step, and factored once.

The needle of S, D, M and M2 is clamped at the skin of homogeneous tissue. Its inserted part is stretched to 0..1, see
`fem_needle.benchmark.growing_beam`; where it is held this is the plain beam. Average acceleration in time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine, condense
from skfem.helpers import dd, ddot

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.methods import LIBRARY, Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

Array = NDArray[np.float64]
Matrices = tuple[Any, Any, Any]


def assembled(beam: GrowingBeam, elements: int, depth: float) -> tuple[Basis, Matrices]:
    """Return the basis and mass, swept and stiffness matrices at a depth [m], new from the mesh on."""
    basis = Basis(MeshLine(np.linspace(0.0, 1.0, elements + 1)), ElementLineHermite())
    mass, speed = beam.mass_per_length, beam.speed

    @BilinearForm
    def inertia(u: Any, v: Any, w: Any) -> Any:
        return mass * depth * u * v

    @BilinearForm
    def sweeping(u: Any, v: Any, w: Any) -> Any:
        away = 1.0 - w.x[0]
        return mass * speed * (u * v + v * away * u.grad[0] - u * away * v.grad[0])

    @BilinearForm
    def restoring(u: Any, v: Any, w: Any) -> Any:
        away = 1.0 - w.x[0]
        bent = beam.bending_stiffness / depth**3 * ddot(dd(u), dd(v)) + beam.foundation_modulus * depth * u * v
        return bent - mass * speed**2 / depth * away**2 * u.grad[0] * v.grad[0]

    return basis, (inertia.assemble(basis), sweeping.assemble(basis), restoring.assemble(basis))


def _free(basis: Basis) -> tuple[Array, int]:
    """Return the free unknowns and which of them is the tip's deflection."""
    clamped = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all()
    free = np.setdiff1d(np.arange(basis.N), clamped)
    tip = basis.get_dofs(lambda x: np.isclose(x[0], 1.0)).all("u")[0]
    return free, int(np.flatnonzero(free == tip)[0])


def _solve_static(beam: GrowingBeam, elements: int, force: float) -> Array:
    """Return the unknowns at rest in the first depth, by the library's own way to impose conditions."""
    basis, (_, _, stiffness) = assembled(beam, elements, beam.first_depth)
    clamped = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all()
    load = np.zeros(basis.N)
    load[basis.get_dofs(lambda x: np.isclose(x[0], 1.0)).all("u")] = force
    matrix, right, _, free = condense(stiffness, load, D=clamped)
    result: Array = np.zeros(basis.N)
    result[free] = splu(matrix.tocsc()).solve(right)
    return result


class _AverageAcceleration:
    """Average acceleration with matrices that a function gives for each time; the first state as in the cases M and D."""

    def __init__(self, beam: GrowingBeam, elements: int, first_tip: float | None) -> None:
        self.beam = beam
        basis, matrices = assembled(beam, elements, beam.first_depth)
        self.free, self.tip = _free(basis)
        self.first = self.restricted(matrices)
        self.position = _solve_static(beam, elements, 1.0 if first_tip else beam.tip_force(0.0))[self.free]
        if first_tip:
            self.position *= first_tip / self.position[self.tip]
        self.rate = self._moving(elements) if beam.speed else np.zeros(len(self.free))
        mass, swept, stiffness = self.first
        self.pull = splu(mass).solve(self.load(0.0) - swept @ self.rate - stiffness @ self.position)

    def restricted(self, matrices: Matrices) -> Matrices:
        """Return matrices of the free unknowns."""
        mass, swept, stiffness = (matrix[self.free][:, self.free].tocsc() for matrix in matrices)
        return mass, swept, stiffness

    def _moving(self, elements: int) -> Array:
        """Return the rate of the moving equilibrium, by a difference over the depth."""
        beam, small = self.beam, 1e-5 * self.beam.first_depth
        sides = []
        for side in (-small, small):
            moved = replace(beam, first_depth=beam.first_depth + side, speed=0.0)
            sides.append(_solve_static(moved, elements, beam.tip_force(0.0))[self.free])
        return beam.speed * (sides[1] - sides[0]) / (2 * small)

    def load(self, time: float) -> Array:
        """Return the load vector at a time [s]."""
        load = np.zeros(len(self.free))
        load[self.tip] = self.beam.tip_force(time)
        return load

    def step(self, time: float, length: float, matrices: Matrices, solve: Callable[[Array], Array]) -> None:
        """Go on to a time [s]; ``solve`` is that of M + h/2 C + h^2/4 K."""
        _, swept, stiffness = matrices
        ahead = self.position + length * self.rate + length**2 / 4 * self.pull
        faster = self.rate + length / 2 * self.pull
        self.pull = solve(self.load(time) - swept @ faster - stiffness @ ahead)
        self.position, self.rate = ahead + length**2 / 4 * self.pull, faster + length / 2 * self.pull


def _effective(matrices: Matrices, length: float) -> Callable[[Array], Array]:
    mass, swept, stiffness = matrices
    solve: Callable[[Array], Array] = splu(mass + length / 2 * swept + length**2 / 4 * stiffness).solve
    return solve


def _marched(case: Case, setting: Setting, *, once: bool) -> Array:
    """Return the tips at the outputs; with matrices and factors made once, or in every step."""
    beam, elements = growing_beam(case.scene), setting.elements or 1
    state = _AverageAcceleration(beam, elements, case.scene.initial.tip_deflection)
    steps = setting.steps(case) or 1
    between, length = steps // (len(case.times) - 1), case.duration / steps
    matrices = state.first
    solve = _effective(matrices, length)
    tips = [state.position[state.tip]]
    for number in range(1, steps + 1):
        time = number * length
        if not once:
            matrices = state.restricted(assembled(beam, elements, beam.first_depth + beam.speed * time)[1])
            solve = _effective(matrices, length)
        state.step(time, length, matrices, solve)
        if number % between == 0:
            tips.append(state.position[state.tip])
    return np.array(tips)


class NaiveElements(Method):
    """Basis, assembly and sparse factorization in every step."""

    name = "scikit-fem, assembled in each step"
    kind = LIBRARY
    limited = "at most 3000 steps; up to 5 ms each"
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {
        "S": over((1, 2, 4, 8, 16)),
        "D": over((8, 16), time_steps=(1e-4, 5e-5)),
        "M": over((4, 40), time_steps=(1e-2, 1e-2)),
        "M2": over((8, 8), time_steps=(5e-3, 2e-3)),
    }

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole program: nothing is prepared."""
        if case.at_rest:
            beam = growing_beam(case.scene)
            return lambda: _solve_static(beam, setting.elements or 1, beam.tip_force(0.0))[-2:-1]
        return lambda: _marched(case, setting, once=False)


class FactoredElements(Method):
    """Assembled and factored once, a Python loop over the steps; only where the matrices do not change."""

    name = "scikit-fem, factored once"
    kind = LIBRARY
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {"D": over((8, 16, 24, 32), time_steps=(1e-4, 2e-5, 5e-6, 2e-6))}

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole program."""
        return lambda: _marched(case, setting, once=True)
