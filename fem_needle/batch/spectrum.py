"""The own vibrations of the inserted part, stretched to a unit length: what the loop of a batch is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.free_response import vibrations
from fem_needle.motion import run_duration
from fem_needle.plant import Plant
from fem_needle.scene import Scene, Sinusoid, Table, TipLoad
from fem_needle.segments import one_layer_holds

Array = NDArray[np.float64]

SHALLOWEST = 1e-3  # of the length: a needle that is hardly inserted is left to the other loops


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Vibrations of a stretched needle of unit stiffness, mass per length and depth.

    Attributes
    ----------
    roots
        lambda_i of K_1 phi = lambda M_1 phi, rising (all,).
    tips
        phi_i(tip) of unit mass (all,).
    convection, centrifugal, drag
        S, R and the drag's matrix between the lowest ones (n, n).
    """

    roots: Array
    tips: Array
    convection: Array
    centrifugal: Array
    drag: Array


def spectrum_of(plant: Plant, moving: int) -> Spectrum:
    """Return the spectrum of a plant of a scene that `is_uniform`, its lowest ``moving`` vibrations with their convection."""
    depth, needle, clamped = 0.5 * plant.scene.needle.length, plant.scene.needle, plant.prescribed
    operators, viscous = plant.operators(depth, 0.0), max((layer.damping for layer in plant.scene.tissue.layers), default=0.0)

    def unit(band: Array | None, factor: float) -> Array:
        """Return a matrix for unit depth, stiffness, mass and viscosity."""
        if band is None:
            return np.zeros((plant.size - clamped, plant.size - clamped))
        return banded.to_dense(banded.trailing(band, clamped)) / factor

    roots, shapes = vibrations(
        unit(operators.mass, needle.mass_per_length * depth), unit(operators.bending, needle.bending_stiffness / depth**3)
    )
    lowest = shapes[:, :moving]

    def between(band: Array | None, factor: float) -> Array:
        return np.ascontiguousarray(lowest.T @ unit(band, factor) @ lowest)

    tips = plant.points(depth).rows[-1, clamped:] @ shapes
    convection = between(operators.convection, needle.mass_per_length)
    centrifugal = between(operators.centrifugal, needle.mass_per_length / depth)
    return Spectrum(roots, tips, convection, centrifugal, between(operators.drag, viscous or 1.0))


def is_uniform(scene: Scene) -> bool:
    """Return whether a run is one of the kind that the batch's own loop knows.

    Support ``entry``, one layer that holds the whole inserted part (or none), a constant speed or none, tip forces that are
    constant or one sinusoid, a straight rest line, no swelling, no numerical damping.
    """
    tissue, insertion = scene.tissue, scene.insertion
    if scene.support.kind != "entry" or scene.numerics.mesh is not None:
        return False
    if tissue.rest_line != "straight" or tissue.tip_stiffness or not isinstance(tissue.stiffness_factor, float):
        return False
    if tissue.layers and not one_layer_holds(tissue.layers, scene.needle.length):
        return False
    if insertion.kind != "hold" and not (insertion.kind == "speed" and isinstance(insertion.speed, float)):
        return False
    if insertion.depth_range(run_duration(scene))[0] < SHALLOWEST * scene.needle.length:
        return False
    return _has_simple_loads(scene) and _has_vibrations(scene)


def _has_vibrations(scene: Scene) -> bool:
    """Return whether the model is made of shapes that stretch with the inserted part, moving or at rest without memory."""
    still = scene.numerics.analysis in {"quasi-static", "static"}
    if scene.numerics.spectral_radius != 1.0 or (still and any(layer.damping > 0.0 for layer in scene.tissue.layers)):
        return False
    model = scene.model
    stretched = model.kind == "assumed-modes" and model.basis == "inserted-length" and not model.static_corrections
    return stretched or model.kind == "fem"


def _has_simple_loads(scene: Scene) -> bool:
    varying = 0
    for load in scene.loads:
        if not isinstance(load, TipLoad) or isinstance(load.force, Table) or load.direction != 1.0:
            return False
        varying += isinstance(load.force, Sinusoid)
    return varying <= 1
