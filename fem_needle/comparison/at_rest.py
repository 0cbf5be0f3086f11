"""Two models at rest: tips, shapes and natural frequencies over the depth, and their differences."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import SHALLOW, instants, static_tips
from fem_needle.free_response import natural_frequencies
from fem_needle.gauss import gauss_rule
from fem_needle.linear.linearization import reach
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.statics import Equilibrium, solve_static

Array = NDArray[np.float64]

FREQUENCIES = 3
DEPTHS = 81
PANELS, POINTS = 8, 8  # of the Gauss rule along the needle
SAME_DEPTH = 1e-6  # of the length: a smaller way is none
END = 0.02  # of the length: how far before the hub meets something the depths of a held needle end
PROBE_FORCE = 1.0  # N at the tip, of a scene whose loads bend nothing


@dataclass(frozen=True)
class StaticLoad:
    """What the equilibria are loaded with.

    Attributes
    ----------
    time
        Instant whose loads, hub motion and stiffness factor are taken [s].
    probe_force
        Force added at the tip [N]; 0 where the scene's own loads bend the needle.
    """

    time: float
    probe_force: float

    def applied(self, scene: Scene) -> Scene:
        """Return the scene with the added force."""
        if not self.probe_force:
            return scene
        return scene.with_value("loads", [*scene.to_dict().get("loads", ()), {"kind": "tip", "force": self.probe_force}])

    @property
    def text(self) -> str:
        """In words."""
        if self.probe_force:
            return f"{self.probe_force:g} N at the tip, because the scene's loads bend nothing"
        return f"loads at {self.time:g} s"


@dataclass(frozen=True, eq=False)
class RestStates:
    """A model at rest.

    Attributes
    ----------
    depths
        z [m], shape (n,).
    rests
        Equilibria.
    tips
        Deflection of the tip [m], shape (n,).
    shapes
        Deflection at the `shape_stations` [m], shape (n, stations).
    frequencies
        Lowest undamped natural frequencies [rad/s], shape (n, 3); nan where the model has fewer.
    solve_time
        Of all equilibria, without the frequencies [s].
    """

    depths: Array
    rests: tuple[Equilibrium, ...]
    tips: Array
    shapes: Array
    frequencies: Array
    solve_time: float


@dataclass(frozen=True, eq=False)
class StaticErrors:
    """Differences from the reference by its own values, with their signs (tips, frequencies) or as norms (shapes).

    Attributes
    ----------
    tip
        (w - w_ref) / abs(w_ref) at the tip (1), shape (n,); infinite where only the reference's tip is zero.
    shape
        |w - w_ref| / |w_ref| (1), root mean squares over the part that bends, shape (n,).
    frequency
        f / f_ref - 1 (1), shape (n, 3).
    """

    tip: Array
    shape: Array
    frequency: Array


def static_load(plant: Plant) -> StaticLoad:
    """Return the loads of the instant, of seven over the run, at which the needle at rest bends most at its tip."""
    tips = np.abs(static_tips(plant))
    if float(np.max(tips)) <= plant.scene.numerics.absolute_tolerance:
        return StaticLoad(0.0, PROBE_FORCE)
    return StaticLoad(float(instants(plant)[int(np.argmax(tips))][0]), 0.0)


def compared_depths(scene: Scene, smallest: float) -> Array:
    """Return depths over the scene's range [m], or over the whole needle where the scene does not move."""
    insertion, length = scene.insertion, scene.needle.length
    lowest, highest = insertion.depth_range(scene.duration)
    if insertion.kind == "force":
        lowest, highest = insertion.first_depth, insertion.final_depth or reach(scene)
    if highest - lowest < SAME_DEPTH * length:
        margin = END * length if scene.support.kind == "hub" else 0.0
        lowest, highest = 0.0, reach(scene) - margin
    lowest = max(lowest, smallest, SHALLOW * length, *(guide.position for guide in scene.support.guides))
    return np.linspace(lowest, highest, DEPTHS)


def rest_states(plant: Plant, depths: Sequence[float] | Array, time: float) -> RestStates:
    """Return a model's equilibria and natural frequencies at depths.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    places = np.asarray(depths, dtype=float)
    started = clock.perf_counter()
    rests = tuple(solve_static(plant, depth=depth, time=time) for depth in places.tolist())
    seconds = clock.perf_counter() - started
    shapes = [rest.deflection(shape_stations(plant.scene, rest.depth)[0]) for rest in rests]
    return RestStates(
        places,
        rests,
        np.array([rest.tip_deflection for rest in rests]),
        np.array(shapes),
        np.array([_frequencies(plant, depth, time) for depth in places.tolist()]),
        seconds,
    )


def static_errors(states: RestStates, reference: RestStates, stations_of: Scene) -> StaticErrors:
    """Return the differences of a model's states from those of the reference at the same depths."""
    norms = [
        _norm(states.shapes[row] - reference.shapes[row], stations_of, depth) / _norm(reference.shapes[row], stations_of, depth)
        for row, depth in enumerate(reference.depths.tolist())
    ]
    return StaticErrors(
        relative_difference(states.tips, reference.tips),
        np.array(norms),
        states.frequencies / reference.frequencies - 1.0,
    )


def relative_difference(values: Array, reference: Array) -> Array:
    """Return (value - reference) / |reference|; infinite where only the reference is zero, 0 where both are."""
    difference, scale = np.asarray(values - reference, dtype=float), np.abs(reference)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = difference / scale
    return np.where(difference == 0.0, 0.0, found)


def shape_stations(scene: Scene, depth: float) -> tuple[Array, Array]:
    """Return arc lengths [m] and weights [m] that integrate along the part that bends: inserted, or under ``hub`` all."""
    length = scene.needle.length
    start = length - depth if scene.support.kind == "entry" else 0.0
    points, weights = gauss_rule(POINTS)
    size = (length - start) / PANELS
    edges = start + size * np.arange(PANELS)
    return (edges[:, None] + size * points).ravel(), np.tile(size * weights, PANELS)


def _norm(shape: Array, scene: Scene, depth: float) -> float:
    """Return the root of the integral of a square [m^1.5]."""
    return float(np.sqrt(shape_stations(scene, depth)[1] @ shape**2))


def _frequencies(plant: Plant, depth: float, time: float) -> Array:
    found = natural_frequencies(plant, depth, time)[:FREQUENCIES]
    return np.concatenate([found, np.full(FREQUENCIES - len(found), np.nan)])
