"""The model "fem": finite elements, as many as the tolerance needs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import instants, relative_differences, static_tips, tip_difference
from fem_needle.dynamics.vibration import needs_no_steps
from fem_needle.errors import SceneError
from fem_needle.models import ChosenPlant
from fem_needle.needle import FiniteElementNeedle
from fem_needle.plant import Plant
from fem_needle.rounding import round_off
from fem_needle.scene import Scene, as_function

Array = NDArray[np.float64]

ELEMENT_CHOICES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
ELEMENT_SHARE = 0.1  # of the tolerance: what the mesh may cost
ONLY_SHARE = 0.8  # likewise, where nothing else costs anything
BETWEEN = 1.25  # the largest difference at rest over the largest at the instants that are compared
MESH_INSTANTS = 12
VIBRATING = 4.0 / 3.0  # the error of a free vibration over the difference from twice as many elements: its order is 2 or more
PILOT_ELEMENTS = 8
LONGEST_ELEMENT = 4.0  # decay lengths (4 EI / k)^(1/4): meshes of longer ones may agree with each other and be wrong
SWOLLEN_TIMES = 200  # at which the largest stiffness factor is looked for
CAREFUL = 1e-6  # of the tip: rounding stays below it on any mesh that is chosen
GROWN = 2.0  # an error that two finer meshes make larger by this factor is round-off


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
        """Return the needle on the mesh or with the elements that the scene gives or, on "auto", needs.

        The error is relative to the largest tip deflection; None where there is nothing finer to compare with.
        """
        meshes = Meshes(scene, analysis)
        if scene.numerics.mesh is None and scene.numerics.elements == "auto":
            return meshes.chosen()
        plant = _given_mesh(scene, 1)
        try:
            finer = _given_mesh(scene, 2)
        except SceneError:  # more elements than are allowed, or smaller ones
            return ChosenPlant(plant, None)
        error, tolerance = meshes.between(plant, finer), scene.numerics.tolerance
        return ChosenPlant(plant, error, _missed(plant, error, tolerance))


FAMILY = FiniteElementModel()


@dataclass(frozen=True)
class Meshes:
    """What meshes of equal elements cost the tip of a scene.

    Attributes
    ----------
    scene, analysis
        As in `FiniteElementModel.choose`.
    """

    scene: Scene
    analysis: str
    _needles: dict[int, FiniteElementNeedle] = field(default_factory=dict)
    _errors: dict[int, float] = field(default_factory=dict)
    _tips: dict[Plant, Array] = field(default_factory=dict)

    def error(self, elements: int) -> float:
        """Return the difference of the tip from that of twice as many elements, relative to the largest tip deflection."""
        if elements not in self._errors:
            self._errors[elements] = self.between(self.needle(elements), self.needle(2 * elements))
        return self._errors[elements]

    def needle(self, elements: int) -> FiniteElementNeedle:
        """Return the needle with so many elements."""
        if elements not in self._needles:
            self._needles[elements] = FiniteElementNeedle(self.scene, elements=elements)
        return self._needles[elements]

    def between(self, plant: Plant, finer: Plant) -> float:
        """Return how far two needles' tips differ, relative to the largest tip deflection.

        At rest at instants spread over the run; over time where the needle is held and vibrates freely.
        """
        if self._needs_no_steps:
            return VIBRATING * tip_difference(self.scene, plant, finer, self.analysis)
        tips = self._tips_at_rest(plant), self._tips_at_rest(finer)
        return BETWEEN * float(np.max(relative_differences(self.scene, *tips)))

    def _tips_at_rest(self, plant: Plant) -> Array:
        if plant not in self._tips:
            self._tips[plant] = static_tips(plant, MESH_INSTANTS)
        return self._tips[plant]

    @property
    def _needs_no_steps(self) -> bool:
        return self.analysis == "dynamic" and needs_no_steps(self.scene) and self.scene.numerics.time_step == "auto"

    def fewest(self, allowed: float) -> int:
        """Return the fewest elements whose error is allowed; where none is, those with the smallest error."""
        resolving = [count for count in ELEMENT_CHOICES if self.decay_lengths(count) <= LONGEST_ELEMENT] or [ELEMENT_CHOICES[-1]]
        errors = []
        for count in resolving:
            errors.append(self.error(count))
            if errors[-1] <= allowed:
                return count
            if len(errors) > 2 and min(errors[-2:]) > GROWN * min(errors):  # round-off grows with the elements
                break
        return resolving[int(np.argmin(errors))]

    def chosen(self) -> ChosenPlant:
        """Return the needle with the fewest elements that the tips at rest allow."""
        share = ONLY_SHARE if self._needs_no_steps else ELEMENT_SHARE
        return self.choice(self.needle(self.fewest(share * self.scene.numerics.tolerance)), 0.0)

    def decay_lengths(self, count: int) -> float:
        """Return the length of one of so many elements over the shortest decay length of the layers that the tip reaches."""
        scene, (_, deepest) = self.scene, self.scene.insertion.depth_range(self.scene.duration)
        swollen = float(np.max(as_function(scene.tissue.stiffness_factor).value(np.linspace(0.0, scene.duration, SWOLLEN_TIMES))))
        reached = [swollen * layer.foundation_modulus for layer in scene.tissue.layers if layer.start < deepest]
        span = deepest if scene.support.kind == "entry" else scene.needle.length
        return span / count * (max(reached, default=0.0) / (4.0 * scene.needle.bending_stiffness)) ** 0.25

    def finer(self, plant: Plant, factor: float) -> FiniteElementNeedle | None:
        """Return the needle with ``factor`` times the elements of a plant and more than it has; None beyond the finest."""
        present = int(plant.describe()["elements"])
        counts = [count for count in ELEMENT_CHOICES if count > present and count >= factor * present]
        return self.needle(counts[0]) if counts else None

    def choice(self, plant: Plant, error: float) -> ChosenPlant:
        """Return the choice of one of the needles, whose error in motion is known, relative to the largest tip deflection."""
        count, tolerance = int(plant.describe()["elements"]), self.scene.numerics.tolerance
        error = max(error, self.error(count))
        lengths = self.decay_lengths(count)
        coarse = (
            f"each of {count} elements is {lengths:.2g} decay lengths (4 EI / k)^(1/4) long > {LONGEST_ELEMENT:g}: the tolerance "
            "may be missed without a sign of it; give more elements, or a mesh that is fine where forces act"
        )
        warnings = (*_missed(plant, error, tolerance), *((coarse,) if lengths > LONGEST_ELEMENT else ()))
        return ChosenPlant(self.needle(count), error, warnings, round_off=self.round_off(count), ladder=self)

    def round_off(self, count: int) -> float:
        """Return what rounding costs the largest tip deflection: at rest, or all of an error that more elements make larger.

        Tolerances above `CAREFUL` are far from it: 0.
        """
        finer = [error for other, error in self._errors.items() if other > count]
        if len(finer) > 1 and min(finer) > GROWN * self.error(count):
            return self.error(count)
        if self.scene.numerics.tolerance > CAREFUL:
            return 0.0
        plant = self.needle(count)
        places, tips = instants(plant, MESH_INSTANTS), np.abs(self._tips_at_rest(plant))
        time, depth = places[int(np.argmax(tips))]
        return round_off(plant, depth, time, stepped=self.analysis == "dynamic" or plant.foundation.is_damped)


def _missed(plant: Plant, error: float, tolerance: float) -> tuple[str, ...]:
    if error <= tolerance:
        return ()
    return (f"the tolerance {tolerance:g} was not reached with elements = {plant.describe()['elements']}: see error_estimate",)


def _given_mesh(scene: Scene, parts: int) -> FiniteElementNeedle:
    """Return the needle with every element of the scene's own mesh cut into one or two equal parts."""
    numerics = scene.numerics
    if numerics.mesh is None:
        return FiniteElementNeedle(scene, elements=parts * int(numerics.elements))
    nodes = np.array(numerics.mesh)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    return FiniteElementNeedle(scene, mesh=nodes if parts == 1 else np.sort(np.concatenate((nodes, middles))))
