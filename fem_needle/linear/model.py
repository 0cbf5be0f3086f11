"""A linear model of a needle about an operating point: matrices with named states, poles, transfer functions, gains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import ComputationError, NeedleError, SceneError
from fem_needle.linear.small_motion import OperatingPoint

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STILL = 1e-9  # of the fastest pole: an imaginary part below is none


@dataclass(frozen=True)
class Signal:
    """Name and SI unit of a state, an input or an output."""

    name: str
    unit: str


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """mass x'' + damping x' + stiffness x = b0 u + b1 u' + b2 u'', outputs = rows x + direct u.

    Attributes
    ----------
    mass, damping, stiffness
        Shape (n, n).
    forces
        b0, b1, b2, each (n, inputs): a hub that is moved acts with its velocity and acceleration too.
    rows, direct
        Shapes (outputs, n) and (outputs, inputs).
    """

    mass: Array
    damping: Array
    stiffness: Array
    forces: tuple[Array, Array, Array]
    rows: Array
    direct: Array

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """Return A, B, C, D with the states x1 = x - Gamma u and x2 = x1' - Lambda u, so that no rate of an input is needed.

        Gamma = mass^-1 b2, Lambda = mass^-1 (b1 - damping Gamma); both are zero for forces.
        """
        count = len(self.mass)
        value, rate, acceleration = self.forces

        def divided(matrix: Array) -> Array:
            return np.asarray(np.linalg.solve(self.mass, matrix), dtype=float)

        shift = divided(acceleration)
        rate_shift = divided(rate - self.damping @ shift)
        lower = divided(np.hstack([-self.stiffness, -self.damping]))
        driven = divided(value - self.stiffness @ shift - self.damping @ rate_shift)
        system = np.vstack([np.hstack([np.zeros((count, count)), np.eye(count)]), lower])
        outputs = np.hstack([self.rows, np.zeros_like(self.rows)])
        return system, np.vstack([rate_shift, driven]), outputs, self.direct + self.rows @ shift


@dataclass(frozen=True, eq=False)
class LinearModel:
    """dx/dt = A x + B u, y = C x + D u: changes from an operating point.

    Attributes
    ----------
    A, B, C, D
        Matrices, SI.
    states, inputs, outputs
        What rows and columns are; the unit of a coordinate is the model's own.
    operating_point
        Where the needle was linearized.
    second_order
        The same in second order.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    operating_point: OperatingPoint
    second_order: SecondOrder

    @cached_property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A, by magnitude [rad/s]."""
        found = np.linalg.eigvals(self.A).astype(complex)
        return found[np.lexsort((found.imag, np.abs(found)))]

    @property
    def _vibrations(self) -> ComplexArray:
        return self.poles[self.poles.imag > STILL * np.max(np.abs(self.poles), initial=0.0)]

    @property
    def natural_frequencies(self) -> Array:
        """Magnitude of the pole of every pair that vibrates, rising [rad/s]; overdamped motions are among the `poles`."""
        return np.asarray(np.abs(self._vibrations))

    @property
    def damping_ratios(self) -> Array:
        """-Re(pole) by its magnitude, of the same."""
        return np.asarray(-self._vibrations.real / np.abs(self._vibrations))

    def transfer_function(self, output: str, input: str, frequencies: ArrayLike) -> ComplexArray:
        """Return rows (stiffness + s damping + s^2 mass)^-1 (b0 + s b1 + s^2 b2) + direct at s = i omega.

        Parameters
        ----------
        output, input
            Names.
        frequencies
            omega [rad/s], any shape.

        Raises
        ------
        SceneError
            If a name is unknown.
        ComputationError
            If a frequency is that of an undamped vibration or, at 0, of a depth that nothing holds.
        """
        row, column = self._index(self.outputs, output), self._index(self.inputs, input)
        omega = np.asarray(frequencies, dtype=float)
        return np.array([self._response(float(one), row, column) for one in omega.ravel()]).reshape(omega.shape)

    def static_gain(self, output: str, input: str) -> float:
        """Return the transfer function at frequency 0; names and errors as there."""
        return float(self.transfer_function(output, input, 0.0).real)

    def _response(self, omega: float, row: int, column: int) -> complex:
        parts, s = self.second_order, 1j * omega
        value, rate, acceleration = (force[:, column] for force in parts.forces)
        try:
            moved = np.linalg.solve(
                parts.stiffness + s * parts.damping + s**2 * parts.mass, value + s * rate + s**2 * acceleration
            )
        except np.linalg.LinAlgError:
            raise ComputationError(
                f"no response of {self.outputs[row].name} to {self.inputs[column].name} at {omega:g} rad/s: nothing holds "
                "the needle there (hold the depth: axial = 'held')"
            ) from None
        return complex(parts.rows[row] @ moved + parts.direct[row, column])

    def _index(self, signals: tuple[Signal, ...], name: str) -> int:
        names = [signal.name for signal in signals]
        if name not in names:
            raise SceneError(f"unknown signal (got {name!r}; allowed {', '.join(names)})")
        return names.index(name)

    def to_control(self) -> Any:
        """Return the model as `control.StateSpace` of python-control, with the names of its signals.

        Raises
        ------
        NeedleError
            If python-control is not installed.
        """
        try:
            control = import_module("control")
        except ImportError:
            raise NeedleError("python-control is not installed: pip install 'fem-needle[control]'") from None
        names = {
            key: [signal.name for signal in getattr(self, key)] for key in ("states", "inputs", "outputs")
        }
        return control.ss(self.A, self.B, self.C, self.D, **names)
