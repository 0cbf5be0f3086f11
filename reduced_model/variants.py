"""The two variants of the thesis' own equations: ``corrected``, its derivation done right, and ``as-printed``, with its mistakes.

Both are ``fixed-frame``. Where they differ from the conservative model:

- ``corrected`` drops dL/dz from the axial equation (the row of the insertion is zero in the thesis' N), so that a pushed needle
  does not conserve energy.
- ``as-printed`` is Appendix A for two modes:

  1. In the row of q_1 the bending coefficient of q_2 is that of q_1: EI K_11 (q_1 + q_2) in place of EI (K_11 q_1 + K_12 q_2).
  2. In that row the tissue is one spring at the tip, k phi_1(z) (phi_1(z) q_1 + phi_2(z) q_2), with k in N/m. Where a scene has a
     foundation, the number of its modulus stands there, of the wrong unit.
  3. The row of q_2 has no stiffness at all.
  4. In that row the derivative of the Lagrangian by the rate of q_2 was subtracted in place of that by q_2:
     -rho A (M_12 q_1' + M_22 q_2'), of the wrong unit, acts as a negative damping, and the second mode grows without bound.
  5. As in ``corrected``, the row of the insertion lacks dL/dz.

  These equations have no equilibrium. Starts and gains at rest are those of the energies, which are the right ones.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.scene import Scene, as_function

Array = NDArray[np.float64]

UNSTABLE = (
    "the variant 'as-printed' repeats the mistakes of the printed equations: the second mode has no stiffness and a negative "
    "damping, and grows without bound"
)
NO_FOUNDATION = "'as-printed' takes the foundation modulus [N/m^2] for the stiffness of one spring at the tip [N/m]"


def check_variant(scene: Scene) -> None:
    """Refuse what the printed equations do not hold.

    Raises
    ------
    SceneError
        With each thing that ``as-printed`` cannot have.
    """
    if scene.model.variant == "as-printed":
        mistakes = tuple(_missing(scene))
        if mistakes:
            raise SceneError(mistakes)


def variant_warnings(scene: Scene) -> tuple[str, ...]:
    """Return what to know before running a variant."""
    if scene.model.variant != "as-printed":
        return ()
    return (UNSTABLE, NO_FOUNDATION) if scene.tissue.layers else (UNSTABLE,)


def printed_stiffness(scene: Scene) -> float:
    """Return the number that the printed equations have for k, times a constant stiffness factor."""
    layers = scene.tissue.layers
    number = layers[0].foundation_modulus if layers else float(scene.tissue.tip_stiffness or 0.0)
    return number * as_function(scene.tissue.stiffness_factor).value(0.0)


def printed_mistakes(
    bending: Array, tissue: Array, mass: Array, tip_row: Array, stiffness: float
) -> tuple[Array, Array]:
    """Return X and Y, what the printed forces are short of or beyond the right ones: -X q - Y q'.

    Parameters
    ----------
    bending, tissue, mass
        The right matrices of the two modes, shape (2, 2).
    tip_row
        phi_1(z), phi_2(z).
    stiffness
        k as printed.
    """
    printed = np.zeros((2, 2))
    printed[0] = bending[0, 0] + stiffness * tip_row[0] * tip_row
    velocity = np.zeros((2, 2))
    velocity[1] = -mass[1]
    return printed - bending - tissue, velocity


def _missing(scene: Scene) -> Iterator[str]:
    model, tissue = scene.model, scene.tissue
    if model.modes != 2:
        yield f"model.modes: 'as-printed' has two modes (got {model.modes}; allowed 2)"
    if model.basis != "full-length":
        yield f"model.basis: 'as-printed' has modes of the full length (got '{model.basis}'; allowed 'full-length')"
    if model.static_corrections:
        yield "model.static_corrections: 'as-printed' has none (got true; allowed false)"
    if tissue.rest_line != "straight" or not isinstance(tissue.stiffness_factor, float):
        yield "tissue: 'as-printed' has springs of constant stiffness on a straight rest line (got a cut path or swelling)"
    if tissue.layers and not _is_homogeneous(scene):
        yield "tissue.layers: 'as-printed' has one undamped tissue from the surface on (got layers, gaps, a far side or damping)"
    if scene.numerics.analysis not in {"auto", "dynamic"}:
        yield f"numerics.analysis: 'as-printed' has no equilibrium (got '{scene.numerics.analysis}'; allowed 'dynamic')"
    if scene.initial.shape == "equilibrium":
        yield "initial.shape: 'as-printed' has no equilibrium (got 'equilibrium'; allowed 'straight', 'tip-displaced')"


def _is_homogeneous(scene: Scene) -> bool:
    first, *others = scene.tissue.layers
    return not others and first.start == 0.0 and first.far_side >= scene.needle.length and first.damping == 0.0
