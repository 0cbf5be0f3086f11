"""The model "assumed-modes" and the range in which it may be trusted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem_needle import FiniteElementNeedle
from fem_needle.choices import instants, tip_difference, tip_differences
from fem_needle.comparison.ranges import wave_number_at_tip
from fem_needle.dynamics.vibration import needs_no_steps
from fem_needle.free_response import natural_frequencies
from fem_needle.models import ChosenPlant
from fem_needle.scene import Scene
from reduced_model.needle import AssumedModeNeedle

REFERENCE_ELEMENTS = 48


class Truncation(NamedTuple):
    """What too few modes cost, estimated.

    Attributes
    ----------
    tip
        Largest difference of tips from those of finite elements over the run, by the largest tip: of static ones, or over time of
        a held needle that vibrates.
    frequency
        Largest relative error of the lowest natural frequency.
    time, depth
        When [s] and where [m] the larger of the two is.
    """

    tip: float
    frequency: float
    time: float
    depth: float


class AssumedModeModel:
    """Needles on assumed modes (`fem_needle.models.ModelFamily`)."""

    def pilot(self, scene: Scene) -> AssumedModeNeedle:
        """Return the needle itself: it is coarse."""
        return AssumedModeNeedle(scene)

    def build(self, scene: Scene) -> AssumedModeNeedle:
        """Return the needle with the scene's modes, variant and basis."""
        return AssumedModeNeedle(scene)

    def choose(self, scene: Scene, analysis: str) -> ChosenPlant:
        """Return the needle, with a warning where it has too few modes for the scene's tolerance."""
        plant = AssumedModeNeedle(scene)
        if scene.model.variant == "as-printed":
            return ChosenPlant(plant, None)
        found = truncation(plant, dynamic=analysis == "dynamic")
        error = max(found.tip, found.frequency)
        warnings = (_warning(plant, found),) if error > scene.numerics.tolerance else ()
        return ChosenPlant(plant, error, warnings)


FAMILY = AssumedModeModel()


def truncation(plant: AssumedModeNeedle, *, dynamic: bool) -> Truncation:
    """Estimate what the left-out modes cost, against finite elements at instants spread over the run.

    Static tips, and where inertia acts the lowest natural frequency, whose error is a growing error of phase.
    """
    scene = plant.scene
    reference = FiniteElementNeedle(scene.with_value("numerics.mesh", None), elements=REFERENCE_ELEMENTS)
    places = instants(plant)
    tips = tip_differences(scene, plant, reference)
    if dynamic and needs_no_steps(scene):
        found = tip_difference(scene, plant, reference, "dynamic")
        return Truncation(max(found, float(np.max(tips))), 0.0, *places[0])
    frequencies = np.zeros(len(places))
    if dynamic:
        for index, (time, depth) in enumerate(places):
            true = natural_frequencies(reference, depth, time)[0]
            frequencies[index] = abs(natural_frequencies(plant, depth, time)[0] / true - 1)
    worst = int(np.argmax(np.maximum(tips, frequencies)))
    return Truncation(float(np.max(tips)), float(np.max(frequencies)), *places[worst])


def _warning(plant: AssumedModeNeedle, found: Truncation) -> str:
    number = wave_number_at_tip(plant.scene, found.depth, found.time) * found.depth
    what = f"the tip by {found.tip:.2g} of its largest deflection"
    if found.frequency > found.tip:
        what = f"the lowest natural frequency by {found.frequency:.2g}"
    return (
        f"{plant.modes} assumed modes miss {what} (tolerance {plant.scene.numerics.tolerance:g}), most at depth "
        f"{found.depth:.4g} m, where (k/4EI)^(1/4) z = {number:.3g}: take more modes, static_corrections, or model 'fem'"
    )
