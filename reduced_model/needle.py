"""The assumed-mode needle: a beam on a foundation whose deflection is a sum of few shapes of the whole needle, a plant.

    w = sum_i q_i(t) phi_i

with clamped-free modes phi_i of the full length, at a fixed y under ``entry`` and along the needle under ``hub``, or of the
inserted length, stretched with it. The clamp's own motion is added exactly. Derivation: docs/theory.md, "Assumed modes".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.beam_matrices import Beam, stretched_part, whole_needle
from fem_needle.beam_needle import BeamNeedle
from fem_needle.dynamics.resolve import RESOLUTION, ROUNDED
from fem_needle.errors import SceneError
from fem_needle.frames import Frame, MaterialFrame, StretchedFrame
from fem_needle.plant import Operators
from fem_needle.scene import Scene
from reduced_model.corrections import correction_sets, correction_warnings
from reduced_model.growing_beam import FixedFrame, GrowingBeam
from reduced_model.modes import MOST_MODES
from reduced_model.shapes import FunctionSet, LineShapes, ModeSet, joined
from reduced_model.variants import check_variant, printed_mistakes, printed_stiffness, variant_warnings

Array = NDArray[np.float64]

INDEPENDENT_MODES = 2  # of the full length, that are told apart at any depth
# What a step does not resolve must be damped: combinations of nearly parallel modes, whose bending grows as a high power of the
# depth, and the force of a rigid guide on smooth shapes, an index-3 constraint.
STABLE_SPECTRAL_RADIUS = 0.0


class AssumedModeNeedle(BeamNeedle):
    """A scene's needle on clamped-free modes.

    Parameters
    ----------
    scene
        What is modelled.
    modes
        Number of modes; default: the scene's ``model.modes``.
    variant
        ``"conservative"``, ``"corrected"`` or ``"as-printed"``; default: the scene's ``model.variant``.
    basis
        Modes of the ``"full-length"`` or of the ``"inserted-length"``, the same under ``hub``; default: the scene's
        ``model.basis``.
    static_corrections
        Whether the static responses to loads and hub motion join the modes; default: the scene's ``model.static_corrections``.

    Raises
    ------
    SceneError
        If a value is out of range or the variant cannot have what is in the scene.

    Notes
    -----
    Coordinates are deflection [m] and slope of the clamp, which are prescribed, and the modes' amplitudes: q_i [m^1.5] with
    integral phi_i^2 = 1 over the length (``full-length``), q_i [m] with the same over the fraction of the depth
    (``inserted-length``).
    """

    def __init__(
        self,
        scene: Scene,
        *,
        modes: int | None = None,
        variant: str | None = None,
        basis: str | None = None,
        static_corrections: bool | None = None,
    ) -> None:
        scene = _with_settings(scene, modes, variant, basis, static_corrections)
        check_variant(scene)
        length, count = scene.needle.length, scene.model.modes
        if scene.support.kind == "hub":
            shapes = joined(length, _sets(scene, length, count))
            frame: Frame = MaterialFrame(length)
            beam: Beam = whole_needle(shapes, frame, scene)
        elif scene.model.basis == "full-length":
            shapes = joined(length, _sets(scene, length, count))
            frame, beam = FixedFrame(length), GrowingBeam(shapes, scene)
        else:
            shapes = joined(1.0, _sets(scene, 1.0, count))
            frame = StretchedFrame()
            beam = stretched_part(shapes, LineShapes(1.0, shapes.sets, offset=-1.0), frame, scene)
        _check_guides(scene, shapes.size - 2)
        super().__init__(scene, shapes, frame, beam)
        self.modes = count
        self.corrections = shapes.size - count - 2
        grown = shapes.size - 2 if isinstance(frame, FixedFrame) else 0
        self.nearly_dependent = grown > INDEPENDENT_MODES
        self.is_polynomial = scene.model.variant != "as-printed"
        self.axial_force_acts = scene.model.variant == "conservative"
        self.warnings = (*variant_warnings(scene), *correction_warnings(scene))
        if self.nearly_dependent or any(guide.stiffness == "rigid" for guide in scene.support.guides):
            self.largest_spectral_radius = STABLE_SPECTRAL_RADIUS

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices, with what a variant gets wrong, or with the directions that parallel modes resolve."""
        operators = super().operators(depth, time)
        if self.scene.model.variant == "as-printed":
            return self._as_printed(operators, depth)
        if not self.nearly_dependent:
            return operators
        bending, mass = (banded.to_dense(band)[2:, 2:] for band in (operators.bending, operators.mass))
        return replace(operators, subspace=resolved_directions(bending, mass))

    def _as_printed(self, operators: Operators, depth: float) -> Operators:
        bending, tissue, mass = (banded.to_dense(band)[2:, 2:] for band in (operators.bending, operators.tissue, operators.mass))
        position, velocity = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        tip, stiffness = self.shapes.row(depth)[2:], printed_stiffness(self.scene)
        position[2:, 2:], velocity[2:, 2:] = printed_mistakes(bending, tissue, mass, tip, stiffness)
        return replace(operators, positional_error=banded.from_dense(position), velocity_error=banded.from_dense(velocity))

    def describe(self) -> dict[str, int | float | str]:
        """Return kind, number of modes, variant and basis."""
        model = self.scene.model
        found: dict[str, int | float | str] = {
            "model": "assumed-modes",
            "modes": self.modes,
            "variant": model.variant,
            "basis": model.basis,
        }
        return found | ({"static_corrections": self.corrections} if self.corrections else {})


def _with_settings(
    scene: Scene, modes: int | None, variant: str | None, basis: str | None, static_corrections: bool | None
) -> Scene:
    """Return the scene with this model's settings, checked as those of a scene file are."""
    if modes is not None and not 1 <= modes <= MOST_MODES:
        raise SceneError(f"modes: got {modes}; allowed 1 to {MOST_MODES}")
    given = {"modes": modes, "variant": variant, "basis": basis, "static_corrections": static_corrections}
    values = {f"model.{key}": value for key, value in given.items() if value is not None}
    return scene.with_values({"model.kind": "assumed-modes"} | values)


def _check_guides(scene: Scene, functions: int) -> None:
    rigid = sum(guide.stiffness == "rigid" for guide in scene.support.guides)
    if functions <= rigid:
        message = f"too few to obey {rigid} rigid guides and still move (got {scene.model.modes}; allowed {rigid + 1} or more)"
        raise SceneError(f"model.modes: {message}")


def _sets(scene: Scene, span: float, count: int) -> list[FunctionSet]:
    modes = ModeSet(span, count)
    return [modes, *(correction_sets(scene, modes, span) if scene.model.static_corrections else [])]


def resolved_directions(bending: Array, mass: Array) -> Array:
    """Return the combinations (modes, rank) that the modes up to some depth tell apart, each of unit bending energy.

    Modes of the full length are an overcomplete set on a short part of it; solving on the numerically resolved part of their
    span loses nothing that they can represent with moderate amplitudes (Adcock and Huybrechs, Frames and numerical
    approximation, SIAM Review 61, 2019). Rounding leaves an error of epsilon / lambda_j times the largest mass in the mass of
    the j-th combination, whose bending is lambda_j before it is scaled to one: it is kept where this is far below its mass.
    """
    scale = 1 / np.sqrt(np.diag(bending))
    eigenvalues, vectors = np.linalg.eigh(bending * np.outer(scale, scale))
    eigenvalues = np.maximum(eigenvalues, np.finfo(float).tiny)
    directions = scale[:, None] * vectors / np.sqrt(eigenvalues)
    masses = np.einsum("ij,ik,kj->j", directions, mass, directions)
    is_known = eigenvalues > ROUNDED * eigenvalues[-1]
    kept = is_known & (eigenvalues * masses > RESOLUTION * eigenvalues[-1] * masses[-1])
    return np.asarray(directions[:, kept], dtype=float)
