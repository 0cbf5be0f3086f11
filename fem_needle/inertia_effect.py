"""How far inertia moves the tip: a bound from an inertia-free pilot run, for the choice of the analysis.

With q_0(t) of the pilot, the inertia that it lacks is a force,

    f = -d/dt (M q_0' + v S q_0) + v S' q_0' + v^2 R q_0,

and at every kink a jump of the momentum M q_0' + v S q_0, which strikes the needle. Where a load jumps (the bevel law at an
interface, a ramp that takes no time) q_0 itself jumps: the needle is let go there. Derivation: docs/theory.md, "What may be
left out".
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fem_needle import banded
from fem_needle.dynamics.grid import TimeGrid
from fem_needle.dynamics.run import run_samples, without_inertia
from fem_needle.free_response import ROUNDING, frozen_matrices, ringing
from fem_needle.limits import check_swings
from fem_needle.loads import load_case
from fem_needle.motion import DepthLaw, depth_law, landing_times, run_duration, shortest_period
from fem_needle.plant import Operators, Plant
from fem_needle.sample_arrays import Samples, joined
from fem_needle.statics import depth_derivative, solve_guided, solve_static

Array = NDArray[np.float64]

PILOT_POINTS = 200  # instants of the pilot
POINTS_PER_PERIOD = 24
SLIVER = 1e-6  # of the run: kinks nearer to each other are one
FEWEST_SAMPLES = 5  # of a smooth piece
BESIDE = 1e-9  # of the length: before and behind an interface
SAME = 1e-6  # of a force: less is no jump


@dataclass(frozen=True, eq=False)
class _Piece:
    """A smooth piece of the pilot: depths, speeds and what follows from the samples' coordinates, one row each."""

    plant: Plant
    times: Array
    depths: Array
    speeds: Array
    coordinates: Array
    rates: Array
    tips: Array

    def operators(self, index: int) -> Operators:
        return self.plant.operators(float(self.depths[index]), float(self.times[index]))

    def momentum(self, index: int) -> Array:
        """Return M q' + v S q."""
        operators = self.operators(index)
        momentum = banded.multiply(operators.mass, self.rates[index])
        if operators.convection is not None:
            momentum = momentum + self.speeds[index] * banded.multiply(operators.convection, self.coordinates[index])
        return momentum


def inertia_effect(plant: Plant) -> float:
    """Return a bound on how far inertia moves the tip, relative to the largest tip deflection.

    2 max |tip of K^-1 f| plus, for each jump of the momentum (at the start, at kinks) and of the equilibrium, the largest tip
    deflection of the free vibration that it starts, as it grows while the needle moves on. It assumes loads slower than the
    lowest natural frequency; where they are not, the first term is of order one by itself.
    """
    scene = plant.scene
    if scene.initial.shape != "equilibrium":
        return float("inf")
    law, pieces = depth_law(scene), _pilot(plant)
    largest = max(*(float(np.max(np.abs(piece.tips))) for piece in pieces), scene.numerics.absolute_tolerance)
    forced = max((_forced_effect(piece) for piece in pieces), default=0.0)
    jumps = [pieces[0].momentum(0) - _starting_momentum(plant, pieces[0], law)]
    jumps += [right.momentum(0) - left.momentum(-1) for left, right in pairwise(pieces)]
    vibration = sum(_struck(pieces[number:], jump) for number, jump in enumerate(jumps))
    landings = landing_times(scene, law, run_duration(scene), plant.smallest_depth)
    vibration += sum(_struck(pieces[number:], _let_go(piece, law, landings)) for number, piece in enumerate(pieces))
    return (2.0 * forced + vibration) / largest


def _pilot(plant: Plant) -> list[_Piece]:
    """Run without inertia and split the samples at the kinks."""
    scene, law, duration = plant.scene, depth_law(plant.scene), run_duration(plant.scene)
    step = min(duration / PILOT_POINTS, shortest_period(scene) / POINTS_PER_PERIOD)
    check_swings(duration, shortest_period(scene))
    landings = landing_times(scene, law, duration, plant.smallest_depth)
    marks = _apart([0.0, *landings, duration], SLIVER * duration)
    outputs = [0.0]
    for start, end in pairwise(marks):
        outputs += np.linspace(start, end, max(FEWEST_SAMPLES, int(np.ceil((end - start) / step))) + 1)[1:].tolist()
    if outputs[-1] < duration:
        outputs.append(duration)
    samples = joined(list(run_samples(plant, without_inertia(scene), TimeGrid(tuple(outputs), landings, duration))))
    inside = [(samples.time >= start) & (samples.time <= end) for start, end in pairwise(marks)]
    return [_piece(plant, law, samples.rows(mask)) for mask in inside]


def _apart(marks: list[float], least: float) -> list[float]:
    """Return rising marks without those that follow another one too closely."""
    kept = marks[:1]
    for mark in marks[1:]:
        if mark - kept[-1] > least:
            kept.append(mark)
    return kept


def _piece(plant: Plant, law: DepthLaw, samples: Samples) -> _Piece:
    times, tip = samples.time, np.array([plant.scene.needle.length])
    speeds = [*(law.after(time).speed for time in times[:-1].tolist()), law.before(float(times[-1])).speed]
    return _Piece(
        plant,
        times,
        np.maximum(samples.depth, plant.smallest_depth),
        np.array(speeds),
        samples.coordinates,
        np.gradient(samples.coordinates, times, axis=0, edge_order=2),
        plant.deflection(samples.coordinates, samples.point_forces, samples.depth, tip)[:, 0],
    )


def _forced_effect(piece: _Piece) -> float:
    """Return the largest |tip of K^-1 f| over a smooth piece, its rates by differences."""
    momenta = np.array([piece.momentum(index) for index in range(len(piece.times))])
    changes = np.gradient(momenta, piece.times, axis=0, edge_order=2)
    effect = 0.0
    for index in range(1, len(piece.times) - 1):
        operators, points, speed = piece.operators(index), piece.plant.points(float(piece.depths[index])), piece.speeds[index]
        force = -changes[index]
        if operators.convection is not None and operators.centrifugal is not None:
            force = force + speed * banded.multiply_transposed(operators.convection, piece.rates[index])
            force = force + speed**2 * banded.multiply(operators.centrifugal, piece.coordinates[index])
        moved, _ = solve_guided(piece.plant, operators, points, force, np.zeros(points.guides))
        effect = max(effect, abs(float(points.rows[-1] @ moved)))
    return effect


def _starting_momentum(plant: Plant, piece: _Piece, law: DepthLaw) -> Array:
    """Return the momentum of the start: rates of the equilibria at frozen loads."""
    speed = law.after(0.0).speed
    if not speed:
        return np.zeros(plant.size)
    rest = solve_static(plant, depth=float(piece.depths[0]), time=0.0)
    operators = piece.operators(0)
    momentum = banded.multiply(operators.mass, speed * depth_derivative(plant, rest)[0])
    if operators.convection is not None:
        momentum = momentum + speed * banded.multiply(operators.convection, rest.coordinates)
    return momentum


def _struck(pieces: list[_Piece], jump: Array) -> float:
    """Return the largest tip deflection [m] after a jump of the momentum at the start of the first piece.

    Energy over frequency of each vibration stays while the needle moves slowly on: struck by p_i = phi_i.jump, with phi_i of unit
    mass, its tip swings by p_i phi_i(tip; z) / sqrt(omega_i(z_0) omega_i(z)).
    """
    if not np.any(jump):
        return 0.0
    first = pieces[0]
    plant, start = first.plant, (float(first.depths[0]), float(first.times[0]))
    rung = ringing(plant, *start, jump)
    if not rung:  # also a needle that rigid guides leave no freedom
        return 0.0
    frequencies, momenta, tips = _vibrations(plant, *start, jump)
    places = [(float(p.depths[i]), float(p.times[i])) for p in pieces for i in (0, len(p.times) // 2, -1)]
    swings = [float(np.sum(momenta * tips / frequencies))]
    for place in places:
        later, _, reached = _vibrations(plant, *place, jump)
        count = min(len(later), len(frequencies))  # a short inserted part may resolve fewer modes
        swing = momenta[:count] * reached[:count] / np.sqrt(frequencies[:count] * later[:count])
        swings.append(float(np.sum(swing)))
    return rung * max(swings) / swings[0]


def _let_go(piece: _Piece, law: DepthLaw, landings: tuple[float, ...]) -> Array:
    """Return the momentum that strikes vibrations as far as a jump of the equilibrium at the start of a piece lets them go."""
    plant, first, shift = piece.plant, float(piece.times[0]), _shift(piece, law, landings)
    struck = np.zeros(plant.size)
    if np.any(shift):
        mass, _, stiffness, basis = frozen_matrices(plant, float(piece.depths[0]), first)
        squares, vectors = eigh(stiffness, mass)
        away = vectors.T @ (basis @ banded.multiply(piece.operators(0).mass, shift)[plant.prescribed :])
        momenta = mass @ vectors @ (np.sqrt(np.maximum(squares, squares[-1] * ROUNDING)) * away)
        struck[plant.prescribed :] = np.linalg.pinv(basis) @ momenta
    return struck


def _shift(piece: _Piece, law: DepthLaw, landings: tuple[float, ...]) -> Array:
    """Return how far the equilibrium jumps at the start of a piece, over all kinks that are one there; zeros without a jump."""
    plant, first = piece.plant, float(piece.times[0])
    scene = plant.scene
    last = max((time for time in landings if first <= time <= first + SLIVER * run_duration(scene)), default=first)
    beside, after = BESIDE * scene.needle.length, law.after(last)
    behind = np.sign(law.before(first).speed) * beside if first > 0.0 else 0.0
    sides = ((first, law.depth(first) - behind), (last, after.depth + np.sign(after.speed) * beside))
    places = [(time, float(np.clip(depth, plant.smallest_depth, scene.needle.length))) for time, depth in sides]
    forces, later = (load_case(scene, depth, time).forces for time, depth in places)
    if first == last and np.allclose(forces, later, rtol=SAME, atol=0.0):
        return np.zeros(plant.size)
    left, right = (solve_static(plant, depth=depth, time=time).coordinates for time, depth in places)
    return right - left


def _vibrations(plant: Plant, depth: float, time: float, jump: Array) -> tuple[Array, Array, Array]:
    """Return natural frequencies [rad/s], |phi_i.jump| and |phi_i(tip)| at a frozen depth."""
    mass, _, stiffness, basis = frozen_matrices(plant, depth, time)
    squares, vectors = eigh(stiffness, mass)
    struck = vectors.T @ (basis @ jump[plant.prescribed :])
    tips = (basis @ plant.points(depth).rows[-1, plant.prescribed :]) @ vectors
    return np.sqrt(np.maximum(squares, squares[-1] * ROUNDING)), np.abs(struck), np.abs(tips)
