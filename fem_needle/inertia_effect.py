"""How far inertia moves the tip: a coarse needle is run with it and without it, closely behind every kink.

Both runs take the same steps by the same L-stable method (Radau IIA), so that what the steps cost is nearly the same in both and
their difference e is inertia. Behind a kink (of speed, load, hub; an interface; the start) the steps follow the slowest
vibration for a while; then they are long, and what still swings is damped out by the method: it is known by then how far it
swings and whether the tissue damps it. Derivation: docs/theory.md, "What may be left out".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, exp, inf, log, pi

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import collocation
from fem_needle.dynamics.engine import DYNAMIC, REST
from fem_needle.dynamics.grid import TimeGrid
from fem_needle.dynamics.run import Integration, run_samples, without_inertia
from fem_needle.free_response import natural_frequencies
from fem_needle.limits import check_swings
from fem_needle.motion import depth_law, landing_times, lateral_values, run_duration, shortest_period
from fem_needle.plant import Plant
from fem_needle.sample_arrays import joined, tips_of
from fem_needle.scene import Scene

Array = NDArray[np.float64]

PILOT_POINTS = 200  # long steps of the pilot
POINTS_PER_PERIOD = 24  # of a load
STEPS_PER_SWING, SWINGS = 16, 4.0  # behind a kink: of the slowest vibration
SLIVER = 1e-6  # of the run: kinks nearer to each other are one
SHALLOW = 0.02  # of the length: shallower `entry` needles are too stiff to matter
FASTER = 1.3  # what the faster vibrations add to the slowest, whose peaks may lie between two steps
ROUGH = 10.0  # times a bound from the tip alone
SUDDEN = 2.0  # a load that comes at once moves an oscillator twice as far as one that comes slowly
DECAYED = 0.25  # of the first swing is left at the end of the short steps: the tissue damps it
LEFT_AFTER = 0.75 * SWINGS  # swings, after which it is looked at what is left
SETTLING = 4  # long steps, in which the method damps what still swings
SMALLEST_LEFT = 1e-9
FORGOTTEN = 1e-9  # of the largest tip: what has decayed to it
UNDAMPED = 0.9  # of the first swing is left: it may be all of it, seen in few steps


@dataclass(frozen=True)
class _Kink:
    """A kink and what it starts: time [s], depth [m], angular frequency of the slowest vibration [1/s] behind it."""

    time: float
    depth: float
    frequency: float


@dataclass(frozen=True)
class Response:
    """What inertia does between two kinks, relative to the largest tip deflection.

    Attributes
    ----------
    begin, end
        Times of the kinks [s].
    forced
        While nothing swings any more: what loads and motion do by themselves.
    swing
        Largest vibration behind the first kink; one that stays grows by what the needle's way makes of it.
    left
        How much of it is left after `LEFT_AFTER` swings, 0 to 1.
    period
        Of the slowest vibration [s].
    kept
        Vibrations of earlier kinks that do not decay.
    before, before_rate
        Those that decay, at the first kink, and how fast at least [1/s].
    """

    begin: float
    end: float
    forced: float
    swing: float
    left: float
    period: float
    kept: float = 0.0
    before: float = 0.0
    before_rate: float = 0.0

    @property
    def stays(self) -> bool:
        """Whether the tissue lets the vibration stay for many swings."""
        return self.left >= DECAYED

    @property
    def rate(self) -> float:
        """How fast it decays at least [1/s]; one that stays is taken to do so half as fast as it was seen to."""
        slower = 2.0 if self.stays else 1.0
        return -log(max(self.left, SMALLEST_LEFT)) / (slower * LEFT_AFTER * self.period) if self.left < UNDAMPED else 0.0

    def own_at(self, time: float) -> float:
        """Return what is left of the vibration at a time [s]."""
        return self.swing * exp(-self.rate * (time - self.begin))

    def lasting_at(self, time: float) -> float:
        """Return how far inertia moves the tip at a time [s], but for a vibration that is damped at once."""
        earlier = self.kept + self.before * exp(-self.before_rate * (time - self.begin))
        return SUDDEN * self.forced + earlier + (self.own_at(time) if self.stays else 0.0)

    def moving_at(self, time: float) -> float:
        """Return the same with the vibration that is damped at once."""
        return self.lasting_at(time) + (0.0 if self.stays else self.own_at(time))


@dataclass(frozen=True)
class Inertia:
    """What inertia does, relative to the largest tip deflection.

    Attributes
    ----------
    bound
        How far it moves the tip at most.
    lasting
        The same without vibrations that the tissue damps within a few swings.
    ringing
        How far vibrations that last move it, by themselves.
    responses
        Kink by kink; empty where that was not looked at.
    """

    bound: float
    lasting: float
    ringing: float
    responses: tuple[Response, ...] = ()


def inertia_effect(plant: Plant, enough: float = 0.0) -> float:
    """Return how far inertia moves the tip at most, relative to the largest tip deflection: the bound of `inertia_of`."""
    return inertia_of(plant, enough).bound


def inertia_of(plant: Plant, enough: float = 0.0) -> Inertia:
    """Return what inertia does to the tip.

    2 max |e| where steps are long, plus what every kink adds to that while they are short: the sum of all vibrations that stay,
    as they grow while the needle moves on, or the largest of those that decay. Loads that vibrate faster than the needle make it
    of order one by themselves.

    Parameters
    ----------
    plant
        A coarse one.
    enough
        Where the motion without inertia is so slow that a rough bound is below this, that is returned.
    """
    scene = plant.scene
    if scene.initial.shape != "equilibrium":
        return Inertia(inf, inf, inf)
    kinks = _kinks(plant)
    grid, is_short = _grid(plant, kinks)
    slow = _tips(plant, grid, without_inertia(scene))
    largest = max(float(np.max(np.abs(slow))), scene.numerics.absolute_tolerance)
    if without_inertia(scene).kind == REST:
        bound = _slow_bound(plant, kinks, np.array(grid.outputs), slow) / largest
        if bound <= enough:
            return Inertia(bound, bound, bound)
    fast = _tips(plant, grid, Integration(DYNAMIC, collocation(0.0)))
    found = tuple(_carried(_responses(scene, kinks, np.array(grid.outputs), is_short, np.abs(fast - slow) / largest)))
    staying = sum(response.swing for response in found if response.stays)
    passing = max((response.swing for response in found if not response.stays), default=0.0)
    lasting = SUDDEN * max(response.forced for response in found) + staying
    return Inertia(lasting + passing, lasting, staying, found)


def _slow_bound(plant: Plant, kinks: Sequence[_Kink], time: Array, tips: Array) -> float:
    """Return a rough bound [m] from the tips of equilibria: w'' / omega^2, and jumps of w' / omega, ten times over."""
    frequency = min(kink.frequency for kink in kinks)
    slopes, spans = np.diff(tips) / np.diff(time), np.diff(time)
    turns, at_kink = np.abs(np.diff(slopes)), np.isin(time[1:-1], [kink.time for kink in kinks])
    bent = np.max(turns[~at_kink] / (0.5 * (spans[1:] + spans[:-1])[~at_kink]), initial=0.0) / frequency**2
    struck = float(np.sum(turns[at_kink])) / frequency
    if not all(isinstance(value, float) for value in lateral_values(plant.scene)):  # whose rates are not in the start
        struck += abs(float(slopes[0])) / frequency
    return ROUGH * (float(bent) + struck)


def _responses(
    scene: Scene, kinks: Sequence[_Kink], time: Array, is_short: NDArray[np.bool_], difference: Array
) -> Iterator[Response]:
    """Yield what inertia does from kink to kink, from what it does at times [s]."""
    growths = _growths(kinks, is_growing=scene.support.kind == "entry")
    for (kink, following), growth in zip(pairwise(kinks), growths, strict=True):
        inside = slice(np.searchsorted(time, kink.time), np.searchsorted(time, following.time, side="right"))
        short, long = difference[inside][is_short[inside]], difference[inside][~is_short[inside]]
        settled = long[SETTLING:] if len(long) > 2 * SETTLING and len(short) else long
        level, swing, left = float(np.max(settled, initial=0.0)), 0.0, 0.0
        if len(short):
            first, last = (max(float(np.max(part)) - level, 0.0) for part in (short, short[-len(short) // 4 :]))
            swing, left = FASTER * first, last / first if first > 0.0 else 0.0
        if left >= DECAYED:
            swing *= growth
        yield Response(kink.time, following.time, level, swing, left, 2 * pi / kink.frequency)


def _carried(responses: Iterable[Response]) -> Iterator[Response]:
    """Yield responses with what earlier ones have left."""
    kept, decaying, rate = 0.0, 0.0, inf
    for response in responses:
        yield replace(response, kept=kept, before=decaying, before_rate=rate if decaying else 0.0)
        decaying *= exp(-rate * (response.end - response.begin)) if decaying else 0.0
        if response.stays and response.rate == 0.0:
            kept += response.swing
        elif response.stays:
            decaying, rate = decaying + response.own_at(response.end), min(rate, response.rate)
        if decaying < FORGOTTEN:
            decaying, rate = 0.0, inf


def _growths(kinks: Sequence[_Kink], *, is_growing: bool) -> Array:
    """Return how much a vibration that begins at a kink grows while the needle moves on: its energy over its frequency stays.

    The tip of a vibration of unit mass moves by 1 / sqrt(z) of the inserted part under ``entry``, always the same at the hub.
    """
    stiffness = np.array([kink.frequency * (kink.depth if is_growing else 1.0) for kink in kinks])
    least = np.minimum.accumulate(stiffness[::-1])[::-1]
    return np.sqrt(np.maximum(1.0, stiffness[:-1] / least[1:]))


def _kinks(plant: Plant) -> list[_Kink]:
    """Return the start, all kinks and the end; of those nearer to each other than a sliver the first."""
    scene, law, duration = plant.scene, depth_law(plant.scene), run_duration(plant.scene)
    check_swings(duration, shortest_period(scene))
    shallow = SHALLOW * scene.needle.length if scene.support.kind == "entry" else 0.0
    times = [0.0]
    for time in (*landing_times(scene, law, duration, plant.smallest_depth), duration):
        if time - times[-1] > SLIVER * duration:
            times.append(time)
    depths = [max(law.depth(time), shallow) for time in times]
    return [_Kink(time, depth, _slowest(plant, depth, time)) for time, depth in zip(times, depths, strict=True)]


def _slowest(plant: Plant, depth: float, time: float) -> float:
    """Return the lowest natural frequency [rad/s], infinite where guides leave no freedom."""
    frequencies = natural_frequencies(plant, depth, time)
    return float(frequencies[0]) if len(frequencies) and frequencies[0] > 0.0 else inf


def _grid(plant: Plant, kinks: Sequence[_Kink]) -> tuple[TimeGrid, NDArray[np.bool_]]:
    """Return the steps, each an output, and whether they are short."""
    scene, duration = plant.scene, run_duration(plant.scene)
    step = min(duration / PILOT_POINTS, shortest_period(scene) / POINTS_PER_PERIOD)
    times, is_short = [0.0], [True]
    for kink, following in pairwise(kinks):
        begin = kink.time
        fine = 2 * pi / kink.frequency / STEPS_PER_SWING
        if 0.0 < fine < step:
            count = min(ceil(SWINGS * STEPS_PER_SWING), int((following.time - begin) / fine * (1 - 1e-9)))
            times += (begin + fine * np.arange(1, count + 1)).tolist()
            is_short += [True] * count
            begin += fine * count
        count = max(1, ceil((following.time - begin) / step))
        times += np.linspace(begin, following.time, count + 1)[1:].tolist()
        is_short += [False] * count
    landings = landing_times(scene, depth_law(scene), duration, plant.smallest_depth)
    return TimeGrid(tuple(times), landings, duration), np.array(is_short)


def _tips(plant: Plant, grid: TimeGrid, integration: Integration) -> Array:
    """Return the tip deflections [m] at all steps."""
    return tips_of(plant, joined(list(run_samples(plant, integration, grid))))
