"""Free vibration of a uniform beam on a homogeneous foundation, clamped at one end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError
from fem_needle.exact.statics import beam_problem, tip_compliance
from fem_needle.scene import Scene

_TAIL = 1e-13  # of the first deflection: what the modes left out may sum to
_BLOCK = 2**20  # cosines at a time


def clamped_free_roots(count: int) -> NDArray[np.float64]:
    """Roots of cos(beta) cosh(beta) = -1, in rising order, to machine precision.

    With beta_i = (i - 1/2) pi + delta the equation is sin(delta) = -(-1)^i / cosh(beta), a contraction for
    delta that cancels nowhere.

    Parameters
    ----------
    count
        Number of roots.

    Returns
    -------
    numpy.ndarray
        beta_1, beta_2, ..., shape (count,).
    """
    number = np.arange(1, count + 1)
    base = (number - 0.5) * np.pi
    delta = np.zeros(count)
    for _ in range(60):  # the slowest, i = 1, gains half a digit an iteration
        decay = np.exp(-(base + delta))
        delta = np.arcsin((-1.0) ** (number + 1) * 2.0 * decay / (1.0 + decay * decay))
    return base + delta


def natural_frequencies(scene: Scene, depth: float, count: int, time: float = 0.0) -> NDArray[np.float64]:
    """Natural frequencies omega_i = sqrt((EI (beta_i / L)^4 + k) / rho A), undamped.

    L is the inserted length under `entry` and the whole needle under `hub`, where the foundation must then be
    the same everywhere (all inside, or none).

    Parameters
    ----------
    scene
        Scene without guides.
    depth
        z [m].
    count
        Number of frequencies.
    time
        At which the stiffness factor is taken [s].

    Returns
    -------
    numpy.ndarray
        Angular frequencies in rising order [rad/s], shape (count,).

    Raises
    ------
    SceneError
        If the beam is not uniform.
    """
    length, modulus = _uniform_beam(scene, depth, time)
    stiffness = scene.needle.bending_stiffness * (clamped_free_roots(count) / length) ** 4 + modulus
    return np.sqrt(stiffness / scene.needle.mass_per_length)


@dataclass(frozen=True)
class ReleaseFromTipForce:
    """A static shape under a tip force, let go at rest at t = 0 without load or damping, at fixed depth.

    w(tip, t) = sum_i F phi_i(L)^2 / (rho A omega_i^2) cos(omega_i t), phi_i(L)^2 = 4 / L for modes normalized
    to int phi_i^2 dy = 1.

    Parameters
    ----------
    scene
        Held at its initial depth; initial shape `tip-displaced`; homogeneous, undamped, no loads, no guides.

    Raises
    ------
    SceneError
        If the scene is another case.

    Notes
    -----
    Sum over modes as in any textbook on vibration; modes are left out where their sum is below 1e-13 of the
    first deflection.
    """

    scene: Scene

    def __post_init__(self) -> None:
        mistakes = list(_release_mistakes(self.scene))
        if mistakes:
            raise SceneError(mistakes)
        _uniform_beam(self.scene, self.depth, 0.0)

    @property
    def depth(self) -> float:
        """Inserted length z [m]."""
        return self.scene.insertion.first_depth

    @property
    def force(self) -> float:
        """Tip force of the first shape [N]."""
        return float(self.scene.initial.tip_deflection or 0.0) / tip_compliance(self.scene, self.depth)

    @property
    def mode_count(self) -> int:
        """Number of modes that leave at most 1e-13 of the first deflection out.

        Modes beyond N add up to less than 4 L^3 / (3 pi^4 EI (N - 1)^3) per tip force.
        """
        length, _ = _uniform_beam(self.scene, self.depth, 0.0)
        bound = 4.0 * length**3 / (3.0 * math.pi**4 * self.scene.needle.bending_stiffness)
        return 2 + math.ceil((bound / (_TAIL * tip_compliance(self.scene, self.depth))) ** (1.0 / 3.0))

    def tip_deflection(self, time: ArrayLike) -> NDArray[np.float64]:
        """Tip deflection [m] at times [s]; shape of the input."""
        instants = np.asarray(time, dtype=float)
        length, _ = _uniform_beam(self.scene, self.depth, 0.0)
        frequency = natural_frequencies(self.scene, self.depth, self.mode_count)
        amplitude = 4.0 * self.force / (length * self.scene.needle.mass_per_length * frequency**2)
        flat = np.ravel(instants)
        blocks = np.array_split(flat, max(1, flat.size * frequency.size // _BLOCK))
        parts = [np.sum(amplitude * np.cos(np.multiply.outer(block, frequency)), axis=1) for block in blocks]
        return np.concatenate(parts).reshape(instants.shape)


def _release_mistakes(scene: Scene) -> list[str]:
    """Return what makes a scene another case than a release."""
    held = scene.support.hub_deflection == 0.0 and scene.support.hub_angle == 0.0
    undamped = all(layer.damping == 0.0 for layer in scene.tissue.layers)
    steady = isinstance(scene.tissue.stiffness_factor, float)
    conditions = (
        (scene.insertion.kind == "hold", "insertion.kind: moves (allowed 'hold')"),
        (scene.initial.shape == "tip-displaced", "initial.shape: another (allowed 'tip-displaced')"),
        (not scene.loads, "loads: the needle is let go (allowed none)"),
        (undamped, "tissue.layers: damped (allowed damping 0 N s/m^2)"),
        (steady, "tissue.stiffness_factor: varies (allowed a number)"),
        (held, "support: moves (allowed hub_deflection 0 m and hub_angle 0 rad)"),
    )
    return [message for met, message in conditions if not met]


def _uniform_beam(scene: Scene, depth: float, time: float) -> tuple[float, float]:
    """Length of the bending part [m] and its foundation modulus [N/m^2]."""
    problem = beam_problem(scene, depth, time)
    modulus = problem.foundation_modulus
    if scene.support.guides or np.any(modulus != modulus[0]):
        message = "not uniform over the bending part (allowed one foundation modulus, no guides)"
        raise SceneError(f"tissue.layers: {message} at depth = {depth:g} m")
    return float(problem.breaks[-1] - problem.breaks[0]), float(modulus[0])
