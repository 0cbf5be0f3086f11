"""Coulomb and viscous friction from a push that rises until the needle slides, and on.

While the needle slides without cutting, with the mass m of what moves,

    f - m dv/dt = mu_s sign(v) + mu_v v

is linear in mu_s and mu_v. While it sticks, friction is whatever it must be, |f| <= mu_s: such samples say nothing but a lower
bound, and in the regression they would pull mu_s down. They are told apart by the speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.least_squares import (
    Estimate,
    LinearFit,
    independent_stride,
    weighted_least_squares,
    zero_phase,
)
from fem_needle.identification.measurements import sampling_interval

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COULOMB, VISCOUS = "coulomb", "viscous"
CUTOFF = 20.0  # Hz
NOISE_MARGIN = 6.0  # standard deviations of the speed's noise: no sample in a million is that far out by chance
SMALLEST_SHARE = 0.01  # of the largest speed: what the filter spreads before a needle begins to move stays below it
NORMAL_QUARTILE = 0.6745  # of the standard normal distribution


@dataclass(frozen=True, eq=False)
class Sliding:
    """Which samples stick and which slide; those about a change, where the filter blends both, and at the ends are neither.

    Attributes
    ----------
    sticking, sliding
        (n,).
    speed, acceleration
        Of the filtered depth (n,) [m/s], [m/s^2].
    threshold
        Speed above which a sample slides [m/s].
    """

    sticking: Mask
    sliding: Mask
    speed: Array
    acceleration: Array
    threshold: float


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """Friction identified from one experiment.

    Attributes
    ----------
    coulomb, viscous
        mu_s [N] and mu_v [N s/m].
    break_away
        Filtered push at the last sample that sticks and the first that slides [N]: what holds the needle at rest lies between,
        but for the noise that the filter leaves; None if it never goes from one to the other.
    samples
        Which samples stick and slide.
    used
        Rows of the regression, sliding and about independent of one another (k,).
    fit
        Of the regression.
    """

    coulomb: Estimate
    viscous: Estimate
    break_away: tuple[float, float] | None
    samples: Sliding
    used: NDArray[np.int64]
    fit: LinearFit


def tell_sliding(time: ArrayLike, depth: ArrayLike, *, cutoff: float = CUTOFF, threshold: float | None = None) -> Sliding:
    """Tell sticking from sliding samples.

    Parameters
    ----------
    time, depth
        Equally spaced samples (n,) [s], [m].
    cutoff
        Of the low-pass filter [Hz].
    threshold
        Speed [m/s]; default: six standard deviations of the noise that the filter leaves in the speed, the depth's own noise
        taken from its fourth differences, in which a smooth motion vanishes; at least 1 % of the largest speed.

    Raises
    ------
    SceneError
        If samples are too few or not equally spaced, or the cut-off impossible.
    """
    times, depths = np.asarray(time, dtype=float), np.asarray(depth, dtype=float)
    interval = sampling_interval(times)
    smooth = zero_phase(depths, interval, cutoff)
    speed = np.gradient(smooth, interval)
    noise = NOISE_MARGIN * _speed_noise(depths, interval, cutoff)
    limit = max(noise, SMALLEST_SHARE * float(np.max(np.abs(speed)))) if threshold is None else threshold
    moves = np.abs(speed) > limit
    near = _near_changes(moves, int(np.ceil(1.0 / (cutoff * interval))))
    return Sliding(~moves & ~near, moves & ~near, speed, np.gradient(speed, interval), limit)


def identify_friction(
    time: ArrayLike,
    depth: ArrayLike,
    push_force: ArrayLike,
    *,
    mass: float,
    cutoff: float = CUTOFF,
    threshold: float | None = None,
) -> FrictionFit:
    """Return Coulomb and viscous friction with standard errors.

    The force is filtered like the depth, and of the filtered samples only every 1 / (2 cutoff) enters the regression: those
    between repeat their neighbors' errors and would make the intervals too narrow.

    Parameters
    ----------
    time, depth, push_force
        Equally spaced samples (n,) [s], [m], [N].
    mass
        Of everything that the measured force moves [kg].
    cutoff
        Of the low-pass filter [Hz]: far above the frequencies of the motion, below those of the noise.
    threshold
        As of `tell_sliding` [m/s].

    Raises
    ------
    SceneError
        If too few samples slide, or all at one speed: then mu_s and mu_v are not told apart.
    """
    times, force = np.asarray(time, dtype=float), np.asarray(push_force, dtype=float)
    samples = tell_sliding(times, depth, cutoff=cutoff, threshold=threshold)
    interval = sampling_interval(times)
    smooth = zero_phase(force, interval, cutoff)
    used = _independent(samples.sliding, independent_stride(interval, cutoff))
    if len(used) < 3:
        raise SceneError(
            f"the needle slides in {len(used)} independent samples (allowed 3 or more): push longer or harder, or sample faster"
        )
    speed = samples.speed[used]
    matrix = np.column_stack((np.sign(speed), speed))
    fit = weighted_least_squares(matrix, smooth[used] - mass * samples.acceleration[used], (COULOMB, VISCOUS))
    return FrictionFit(fit.estimate(COULOMB), fit.estimate(VISCOUS), _break_away(samples, smooth), samples, used, fit)


def depth_noise(depth: ArrayLike) -> float:
    """Return the standard deviation of white noise on a smooth motion [m], from the median of its fourth differences."""
    differences = np.diff(np.asarray(depth, dtype=float), 4)
    return float(np.median(np.abs(differences)) / NORMAL_QUARTILE / np.sqrt(70.0)) if differences.size else 0.0


def _speed_noise(depth: Array, interval: float, cutoff: float) -> float:
    """Return what noise of density 2 s^2 dt below the cut-off makes of the speed: (2 pi f)^2 times it, integrated."""
    return float(2.0 * np.pi * cutoff * depth_noise(depth) * np.sqrt(2.0 * interval * cutoff / 3.0))


def _near_changes(moves: Mask, reach: int) -> Mask:
    """Return which samples lie within a reach of a change, or of an end, where the filter looks beyond the data."""
    near = np.zeros(len(moves), dtype=bool)
    for change in np.flatnonzero(moves[1:] != moves[:-1]):
        near[max(0, change + 1 - reach) : change + 1 + reach] = True
    near[:reach] = near[len(moves) - reach :] = True
    return near


def _independent(sliding: Mask, stride: int) -> NDArray[np.int64]:
    return np.flatnonzero(sliding)[::stride]


def _break_away(samples: Sliding, force: Array) -> tuple[float, float] | None:
    slides = np.flatnonzero(samples.sliding)
    sticks = np.flatnonzero(samples.sticking[: slides[0]])
    return (float(force[sticks[-1]]), float(force[slides[0]])) if len(sticks) else None
