"""The order with which the tip should converge, where theory has one (docs/convergence.md derives each)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from fem_needle.motion import wanted_radius
from fem_needle.plant import Plant
from fem_needle.scene import Scene, TipLoad

RELEASED_TAIL = 3  # amplitudes of a released static shape fall as N^-4, their tail as N^-3
_AT_A_NODE = 1e-9  # of an element


@dataclass(frozen=True)
class TheoreticalOrder:
    """An order and where it comes from.

    Attributes
    ----------
    order
        p of the tip's error C h^p; None where theory has none.
    reason
        One line.
    """

    order: float | None
    reason: str


def theoretical_order(plant: Plant, over: str, analysis: str, values: Sequence[float]) -> TheoreticalOrder:
    """Return the order of the tip's error.

    Parameters
    ----------
    plant
        The finest model of the study.
    over
        "elements", "time-step" or "modes".
    analysis
        "dynamic", "quasi-static" or "static", as it is computed.
    values
        What the study varies, in its own unit.
    """
    scene = plant.scene
    unknown = _unknown(scene)
    if unknown:
        return TheoreticalOrder(None, f"no theory for {unknown}")
    description = plant.describe()
    if over == "time-step":
        return _over_time(scene, analysis)
    if over == "elements" and "degree" in description:
        return _over_elements(scene, analysis, int(description["degree"]), values)
    if over == "modes" and "modes" in description:
        return _over_modes(scene, description)
    return TheoreticalOrder(None, f"no theory for this model over {over}")


def is_released(scene: Scene, analysis: str) -> bool:
    """Return whether the needle is let go without damping, so that every vibration lasts."""
    damped = any(layer.damping > 0.0 for layer in scene.tissue.layers)
    return analysis == "dynamic" and scene.initial.shape != "equilibrium" and not damped


def _unknown(scene: Scene) -> str:
    """Return what spoils every theory here, or nothing."""
    if scene.tissue.rest_line != "straight":
        return "a needle in its own cut path"
    if scene.tissue.kind != "foundation":
        return "a tip spring"
    if scene.insertion.kind == "force":
        return "a needle that is pushed"
    return ""


def _over_time(scene: Scene, analysis: str) -> TheoreticalOrder:
    """Collocation; of a released needle what the vibrations allow whose phase a step cannot follow.

    The phase of vibration N is wrong by omega^(m+1) h^m t with omega as N^2: all beyond N = h^(-m / (2 m + 2)) are out of phase,
    and their amplitudes N^-4 add up to N^-3.
    """
    method = 4 if analysis == "dynamic" and wanted_radius(scene) == 1.0 else 3
    if is_released(scene, analysis):
        order = Fraction(RELEASED_TAIL * method, 2 * method + 2)
        return TheoreticalOrder(float(order), f"released shape: {order}, the vibrations beyond the steps are out of phase")
    return TheoreticalOrder(float(method), f"collocation of order {method}, once steps resolve each vibration that was excited")


def _over_elements(scene: Scene, analysis: str, degree: int, values: Sequence[float]) -> TheoreticalOrder:
    """Energy of the error of solution and Green's function, 2 (p - 1); less where a layer ends inside an element.

    Of a released needle the phase of vibration N is wrong by omega (N h)^(2 (p - 1)) t, so that those beyond
    N = h^(-(p - 1) / p) are out of phase.
    """
    order = 2 * (degree - 1)
    if is_released(scene, analysis):
        released = Fraction(RELEASED_TAIL * (degree - 1), degree)
        return TheoreticalOrder(float(released), f"released shape: {released}, the vibrations beyond the mesh are out of phase")
    if degree > 3 and _is_cut(scene, values):
        return TheoreticalOrder(5.0, "5: 2 (degree - 1) = 6, less one where a layer ends inside an element")
    motion = "" if analysis == "static" else " of a smooth motion"
    return TheoreticalOrder(float(order), f"2 (degree - 1) = {order}: energy of the error{motion}")


def _is_cut(scene: Scene, values: Sequence[float]) -> bool:
    """Return whether an end of a layer lies inside an element of some mesh, or may pass through one."""
    depth, length = scene.insertion.first_depth, scene.needle.length
    entry = scene.support.kind == "entry"
    ends = {y for layer in scene.tissue.layers for y in (layer.start, layer.far_side)}
    clamp, tip = (0.0 if entry else depth - length), depth
    if scene.insertion.kind != "hold":
        return any(y > 0.0 or not entry for y in ends if y < length)
    places = [(y - clamp) / (tip - clamp) for y in ends if clamp < y < tip]
    return any(abs(place * value - round(place * value)) > _AT_A_NODE for place in places for value in values)


def _over_modes(scene: Scene, description: dict[str, Any]) -> TheoreticalOrder:
    """Each clamped-free mode answers a tip force F by phi(l)^2 F / (EI (beta / l)^4), that is as N^-4; the tail as N^-3."""
    whole = "inserted-length" if scene.support.kind == "entry" else "full-length"
    kinds = {getattr(load, "kind", "") for load in scene.loads}
    tip_only = not scene.support.guides and all(isinstance(load, TipLoad) for load in scene.loads)
    pushed = "tip" in kinds or scene.initial.shape == "tip-displaced"
    if scene.model.basis != whole or not (tip_only and pushed) or scene.model.static_corrections:
        return TheoreticalOrder(None, "theory only for modes of the part that bends under a tip force alone")
    return TheoreticalOrder(3.0, "3: modes answer a tip force as N^-4, those left out as N^-3")
