"""What a point stiffness [N/m] says about a foundation modulus [N/m^2], and what it does not.

A point stiffness belongs to tissue AND tool. It becomes a modulus only with the tool's size or the beam it is measured with:

    punch, any axisymmetric tool   dF/dd = 2 a E / (1 - nu^2)                     (Sneddon 1965; Pharr, Oliver, Brotzen 1992)
    beam lying on a half space     k = 0.65 E / (1 - nu^2) (E b^4 / EI)^(1/12)     (Vesic 1961)
    end of a long beam             F/w = k^(3/4) (EI/4)^(1/4)                      (Hetenyi 1946: w = 2 F lambda / k)
    middle of a long beam          F/w = k^(3/4) (64 EI)^(1/4)                     (Hetenyi 1946: w = F lambda / (2 k))
    rigid rod moved sideways       F/w = k z
"""

from __future__ import annotations

from typing import Literal

from fem_needle.errors import SceneError

INCOMPRESSIBLE = 0.5  # Poisson's ratio of soft tissue
VESIC = 0.65
_BEAM_FACTORS = {"end": 0.25, "middle": 64.0}  # (F/w)^4 / (k^3 EI)


def indented_modulus(stiffness: float, contact_radius: float, poisson_ratio: float = INCOMPRESSIBLE) -> float:
    """Return Young's modulus of a half space [Pa] from the tangent stiffness under an indenter.

    Parameters
    ----------
    stiffness
        dF/dd [N/m]; of a flat punch the secant is the same.
    contact_radius
        a of the circle of contact [m].
    poisson_ratio
        nu of the tissue.

    Raises
    ------
    SceneError
        If a value is out of range.
    """
    _check(stiffness=(stiffness, "N/m"), contact_radius=(contact_radius, "m"))
    return stiffness * _plane_share(poisson_ratio) / (2.0 * contact_radius)


def beam_foundation_modulus(
    youngs_modulus: float, diameter: float, bending_stiffness: float, poisson_ratio: float = INCOMPRESSIBLE
) -> float:
    """Return the foundation modulus k [N/m^2] of a beam that lies on an elastic half space.

    Fitted by Vesic to Biot's exact solution for a concentrated load on an infinite beam; a beam inside the medium, held on both
    sides, is stiffer, about twice.

    Parameters
    ----------
    youngs_modulus
        E of the medium [Pa].
    diameter
        Width b of the beam [m].
    bending_stiffness
        EI of the beam [N m^2].
    poisson_ratio
        nu of the medium.

    Raises
    ------
    SceneError
        If a value is out of range.
    """
    values = {"youngs_modulus": (youngs_modulus, "Pa"), "bending_stiffness": (bending_stiffness, "N m^2")}
    _check(diameter=(diameter, "m"), **values)
    slenderness = youngs_modulus * diameter**4 / bending_stiffness
    return float(VESIC * youngs_modulus / _plane_share(poisson_ratio) * slenderness ** (1.0 / 12.0))


def beam_point_stiffness(
    foundation_modulus: float, bending_stiffness: float, place: Literal["end", "middle"] = "end"
) -> float:
    """Return F/w [N/m] where a force acts at the free end or the middle of a long beam on a foundation.

    Parameters
    ----------
    foundation_modulus
        k [N/m^2].
    bending_stiffness
        EI [N m^2] of the needle.
    place
        ``"end"``: the force acts at the free end; ``"middle"``: far from both ends.

    Raises
    ------
    SceneError
        If a value is out of range.
    """
    _check(foundation_modulus=(foundation_modulus, "N/m^2"), bending_stiffness=(bending_stiffness, "N m^2"))
    return float((_beam_factor(place) * bending_stiffness * foundation_modulus**3) ** 0.25)


def beam_modulus_of_point(stiffness: float, bending_stiffness: float, place: Literal["end", "middle"] = "end") -> float:
    """Return the foundation modulus [N/m^2] from F/w [N/m] measured with the needle itself: `beam_point_stiffness` inverted.

    Parameters
    ----------
    stiffness
        F/w [N/m].
    bending_stiffness
        EI [N m^2] of the needle.
    place
        ``"end"``: the force acts at the free end; ``"middle"``: far from both ends.

    Raises
    ------
    SceneError
        If a value is out of range.
    """
    _check(stiffness=(stiffness, "N/m"), bending_stiffness=(bending_stiffness, "N m^2"))
    return float((stiffness**4 / (_beam_factor(place) * bending_stiffness)) ** (1.0 / 3.0))


def rod_modulus_of_point(stiffness: float, inserted_length: float) -> float:
    """Return the foundation modulus k = (F/w) / z [N/m^2] from a rigid rod that is moved sideways as a whole.

    Parameters
    ----------
    stiffness
        F/w [N/m].
    inserted_length
        z [m].

    Raises
    ------
    SceneError
        If a value is out of range.
    """
    _check(stiffness=(stiffness, "N/m"), inserted_length=(inserted_length, "m"))
    return stiffness / inserted_length


def _plane_share(poisson_ratio: float) -> float:
    if not 0.0 <= poisson_ratio <= INCOMPRESSIBLE:
        raise SceneError(f"poisson_ratio: out of range (got {poisson_ratio:g}; allowed 0 to 0.5)")
    return 1.0 - poisson_ratio**2


def _beam_factor(place: str) -> float:
    if place not in _BEAM_FACTORS:
        raise SceneError(f"place: unknown (got {place!r}; allowed {', '.join(_BEAM_FACTORS)})")
    return _BEAM_FACTORS[place]


def _check(**values: tuple[float, str]) -> None:
    wrong = {name: given for name, given in values.items() if not given[0] > 0.0}
    mistakes = [f"{name}: out of range (got {value:g}; allowed above 0 {unit})" for name, (value, unit) in wrong.items()]
    if mistakes:
        raise SceneError(mistakes)
