"""The model "fem": finite elements, as many as the tolerance needs."""

from __future__ import annotations

import numpy as np

from fem_needle.choices import tip_difference
from fem_needle.errors import SceneError
from fem_needle.models import ChosenPlant
from fem_needle.needle import FiniteElementNeedle
from fem_needle.plant import Plant
from fem_needle.scene import Scene

ELEMENT_CHOICES = (8, 12, 16, 24, 32, 48, 64, 96, 128)
FEWEST_DYNAMIC_ELEMENTS = 16
ELEMENT_SHARE = 0.1  # of the tolerance: what the mesh may cost
PILOT_ELEMENTS = 8


class FiniteElementModel:
    """Needles on finite elements (`fem_needle.models.ModelFamily`)."""

    def pilot(self, scene: Scene) -> FiniteElementNeedle:
        """Return a needle with few elements."""
        return FiniteElementNeedle(scene, elements=PILOT_ELEMENTS)

    def build(self, scene: Scene) -> FiniteElementNeedle:
        """Return the needle with the scene's elements or mesh, 40 elements on "auto"."""
        numerics = scene.numerics
        return FiniteElementNeedle(scene, elements=None if numerics.elements == "auto" else int(numerics.elements))

    def choose(self, scene: Scene, analysis: str) -> ChosenPlant:
        """Return the needle on the mesh or with the elements that the scene gives or, on "auto", needs."""
        return choose_mesh(scene, analysis)


FAMILY = FiniteElementModel()


def choose_elements(scene: Scene, analysis: str) -> tuple[int, float]:
    """Return the fewest elements whose tips agree with twice as many, and the difference that remains.

    Compared at rest at instants spread over the run, or over time where the needle is held and vibrates freely; relative to the
    largest tip deflection among them.
    """
    fewest = FEWEST_DYNAMIC_ELEMENTS if analysis == "dynamic" else ELEMENT_CHOICES[0]
    allowed = ELEMENT_SHARE * scene.numerics.tolerance
    candidates = [count for count in ELEMENT_CHOICES if count >= fewest]
    error = np.inf
    for count in candidates:
        error = mesh_error(scene, FiniteElementNeedle(scene, elements=count), 2 * count, analysis)
        if error <= allowed:
            return count, error
    return candidates[-1], error


def mesh_error(scene: Scene, plant: Plant, finer: int, analysis: str = "static") -> float:
    """Return the largest difference of tips from those on a finer mesh, relative to the largest tip."""
    return tip_difference(scene, plant, FiniteElementNeedle(scene, elements=finer), analysis)


def choose_mesh(scene: Scene, analysis: str) -> ChosenPlant:
    """Return the needle on the mesh or with the elements that the scene gives or, on "auto", needs, and what that may cost.

    The error is relative to the largest tip deflection; None where there is nothing finer to compare with.
    """
    numerics = scene.numerics
    if numerics.mesh is None and numerics.elements == "auto":
        count, error = choose_elements(scene, analysis)
        missed = f"the tolerance {numerics.tolerance:g} was not reached with {count} elements: see error_estimate"
        warnings = (missed,) if error > numerics.tolerance else ()
        return ChosenPlant(FiniteElementNeedle(scene, elements=count), error, warnings)
    plant = _given_mesh(scene, 1)
    try:
        finer = _given_mesh(scene, 2)
    except SceneError:  # more elements than are allowed, or smaller ones
        return ChosenPlant(plant, None)
    return ChosenPlant(plant, tip_difference(scene, plant, finer, analysis))


def _given_mesh(scene: Scene, parts: int) -> FiniteElementNeedle:
    """Return the needle with every element of the scene's own mesh cut into one or two equal parts."""
    numerics = scene.numerics
    if numerics.mesh is None:
        return FiniteElementNeedle(scene, elements=parts * int(numerics.elements))
    nodes = np.array(numerics.mesh)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    return FiniteElementNeedle(scene, mesh=nodes if parts == 1 else np.sort(np.concatenate((nodes, middles))))
