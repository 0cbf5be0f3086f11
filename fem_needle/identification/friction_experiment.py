"""The friction experiment in simulation: a push that rises, measured with noise, repeated on needles whose friction differs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.friction import CUTOFF, FrictionFit, identify_friction
from fem_needle.identification.measurements import Measurements
from fem_needle.identification.spread import Spread, spread
from fem_needle.models import build_plant
from fem_needle.scene import Scene
from fem_needle.simulation import simulate

Array = NDArray[np.float64]

NOISE = {"depth": 2e-5, "push_force": 0.01}  # m and N: of a robot's encoder and of a force sensor of some ten newtons
RECORDED = ("depth", "push_force")


@dataclass(frozen=True, eq=False)
class FrictionRepetitions:
    """Repeated experiments.

    Attributes
    ----------
    true
        mu_s [N] and mu_v [N s/m] as drawn, (repetitions, 2).
    fits
        What was identified.
    """

    true: Array
    fits: tuple[FrictionFit, ...]

    @property
    def estimates(self) -> Array:
        """Identified mu_s and mu_v, (repetitions, 2)."""
        return np.array([[fit.coulomb.value, fit.viscous.value] for fit in self.fits])

    @property
    def coulomb(self) -> Spread:
        """Mean and spread of mu_s [N]."""
        return spread(self.estimates[:, 0])

    @property
    def viscous(self) -> Spread:
        """Mean and spread of mu_v [N s/m]."""
        return spread(self.estimates[:, 1])

    @property
    def errors(self) -> Array:
        """Identified minus true, (repetitions, 2)."""
        return self.estimates - self.true


def friction_run(scene: Scene) -> Measurements:
    """Return time, depth and push of a pushed needle as a sensor without error sees them, equally spaced.

    Parameters
    ----------
    scene
        With a push and a fixed ``numerics.output_step``, such as the shipped ``friction-ramp``; any model.

    Raises
    ------
    SceneError
        If the scene has no push or no output step.
    """
    step = scene.numerics.output_step
    if scene.insertion.kind != "force" or not isinstance(step, float):
        found = f"got {scene.insertion.kind!r}, {step!r}; allowed 'force', a time"
        raise SceneError(f"insertion.kind, numerics.output_step: the experiment needs a push and a sampling time ({found})")
    run = simulate(build_plant(scene))
    count = int(np.floor(run.time[-1] / step + 1e-9)) + 1  # a run may end between two samples
    return Measurements({"time": run.time[:count]} | {name: getattr(run, name)[:count] for name in RECORDED}, "simulation")


def with_noise(measured: Measurements, deviations: Mapping[str, float], random: np.random.Generator) -> Measurements:
    """Return measurements with normally distributed noise of given standard deviations [SI] on some columns.

    Parameters
    ----------
    measured
        Without noise, or with other noise.
    deviations
        Standard deviation by column, in its SI unit.
    random
        Where the numbers come from.
    """
    noisy = {name: measured[name] + size * random.standard_normal(measured.size) for name, size in deviations.items()}
    return Measurements({**measured.columns, **noisy}, measured.source)


def needle_mass(scene: Scene) -> float:
    """Return the mass of the scene's needle [kg]."""
    return scene.needle.mass_per_length * scene.needle.length


def repeat_friction_experiment(
    scene: Scene,
    repetitions: int,
    *,
    deviations: tuple[float, float] = (0.0, 0.0),
    noise: Mapping[str, float] | None = None,
    cutoff: float = CUTOFF,
    seed: int = 0,
) -> FrictionRepetitions:
    """Simulate and identify the experiment several times.

    Parameters
    ----------
    scene
        As of `friction_run`; its friction is the mean of what is drawn.
    repetitions
        How many.
    deviations
        Standard deviations of mu_s [N] and mu_v [N s/m] between repetitions, normally distributed.
    noise
        Standard deviations of depth [m] and push_force [N]; default `NOISE`.
    cutoff
        Of the filter [Hz].
    seed
        Of the random numbers.

    Raises
    ------
    SceneError
        As `friction_run` and `identify_friction`; or if a draw is negative.
    """
    random = np.random.default_rng(seed)
    mean = np.array([scene.friction.coulomb, scene.friction.viscous])
    true = mean + np.asarray(deviations) * random.standard_normal((repetitions, 2))
    fits = []
    for coulomb, viscous in true.tolist():
        run = friction_run(scene.with_values({"friction.coulomb": coulomb, "friction.viscous": viscous}))
        found = with_noise(run, NOISE if noise is None else noise, random)
        fits.append(identify_friction(found["time"], found["depth"], found["push_force"], mass=needle_mass(scene), cutoff=cutoff))
    return FrictionRepetitions(true, tuple(fits))
