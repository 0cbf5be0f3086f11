"""Random scenes over all the ranges of `fem_needle.stress.cases` at once."""

from __future__ import annotations

from math import inf

import numpy as np

from fem_needle.stress.numbers import BESIDE, NODES, THINNEST, Analysis, LayerNumbers, Numbers

ANALYSES: tuple[Analysis, ...] = ("static", "quasi-static", "dynamic", "auto")
SHAPES = ("equilibrium", "straight", "tip-displaced")


def random_numbers(seed: int) -> Numbers:
    """Return a scene drawn over all the ranges of `fem_needle.stress.cases`; the same seed gives the same scene."""
    random = np.random.default_rng(seed)
    length, hub = _spread(random, 1e-3, 10.0), bool(random.random() < 0.5)
    mass, layers = _spread(random, 1e-4, 1.0), _layers(random, length)
    steps, time_step = int(random.integers(2, 14)), _spread(random, 1e-7, 10.0)
    depth = _depth(random, length, layers)
    times, depths = _course(random, length, depth, steps, time_step)
    bends = hub or depths[0] > 1e-5 * length  # a shape cannot be given to what is not inserted
    outside = (max(depths) - length) if hub else 0.0
    guides = _guides(random, outside) if hub and outside < 0.0 and random.random() < 0.5 else ()
    lateral: tuple[tuple[float, float], ...] = ()
    if hub and outside < 0.0 and random.random() < 0.3:
        lateral = ((outside * float(random.uniform(0.05, 0.9)), _force(random)),)
    return Numbers(
        support="hub" if hub else "entry",
        length=length,
        bending_stiffness=_spread(random, 1e-8, 1e3),
        mass_per_length=mass,
        layers=tuple(_damped(random, layer, mass) for layer in layers),
        times=times,
        depths=depths,
        guides=guides,
        tip_force=_force(random) if random.random() < 0.8 else 0.0,
        bevel_coefficient=_spread(random, 1e-9, 1e-4) if random.random() < 0.2 else 0.0,
        lateral=lateral,
        initial_shape=str(random.choice(SHAPES, p=[0.7, 0.15, 0.15])) if bends else SHAPES[0],
        tip_deflection=1e-3 * length,
        time_step=time_step,
        steps=steps,
        outputs=min(steps, 4),
        analysis=ANALYSES[int(random.choice(4, p=[0.2, 0.2, 0.5, 0.1]))],
        elements=int(_spread(random, 1.0, 24.0)),
    )


def _spread(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _force(random: np.random.Generator) -> float:
    return _spread(random, 1e-12, 1e4) * float(random.choice([-1.0, 1.0]))


def _layers(random: np.random.Generator, length: float) -> tuple[LayerNumbers, ...]:
    """Return up to four layers, some a micrometre thick, jumps of up to 1e6 between them, one in ten empty."""
    edges = [0.0, *np.sort(random.uniform(0.02, 1.0, int(random.integers(0, 4))) * length).tolist()]
    if random.random() < 0.3:
        edges.append(edges[-1] + THINNEST)
    modulus, layers = _spread(random, 1e-3, 1e9), []
    for start, end in zip(edges, [*edges[1:], None], strict=True):
        empty = random.random() < 0.1
        layers.append(LayerNumbers(start, end, 0.0 if empty else modulus))
        modulus = min(modulus * _spread(random, 1e-6, 1e6), 1e9)
    return tuple(layers)


def _damped(random: np.random.Generator, layer: LayerNumbers, mass: float) -> LayerNumbers:
    """Return the layer without damping, or with a thousandth to ten thousand times the critical one, 2 sqrt(k m)."""
    if random.random() < 0.5:
        return layer
    critical = 2.0 * float(np.sqrt(max(layer.modulus, 1.0) * mass))
    return LayerNumbers(layer.start, layer.end, layer.modulus, critical * _spread(random, 1e-3, 1e4))


def _depth(random: np.random.Generator, length: float, layers: tuple[LayerNumbers, ...]) -> float:
    """Return a depth: anywhere, at an end, or just beside a node or an interface."""
    choice, beside = random.random(), float(random.choice([-BESIDE, 0.0, BESIDE]))
    if choice < 0.5:
        return float(random.uniform(0.0, length))
    if choice < 0.6:
        return float(random.choice([0.0, length]))
    interfaces = [layer.start for layer in layers if layer.start <= length]
    places = interfaces if choice < 0.8 else [length * number / NODES for number in (1, 20, 39)]
    return float(min(max(random.choice(places) + beside, 0.0), length))


def _course(
    random: np.random.Generator, length: float, depth: float, steps: int, time_step: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return corners of the depth over time: held, going in or out, turning at every step, or out of the tissue and back."""
    duration, choice = steps * time_step, random.random()
    if choice < 0.25:
        return (0.0,), (depth,)
    if choice < 0.4:
        return (0.0, 0.5 * duration, duration), (depth, 0.0, depth)
    speed, room = _spread(random, 1e-6, 50.0), (length - depth, -depth)
    if choice < 0.75:
        end = depth + float(np.clip(speed * duration * random.choice([-1.0, 1.0]), room[1], room[0]))
        return (0.0, duration), (depth, end)
    times = time_step * np.arange(steps + 1)
    ways = np.where(np.arange(steps + 1) % 2, np.clip(speed * time_step, 0.0, room[0]), 0.0)
    return tuple(times.tolist()), tuple((depth + ways).tolist())


def _guides(random: np.random.Generator, outside: float) -> tuple[tuple[float, float], ...]:
    """Return up to three guides in front of the tissue, some within a nanometre of each other, soft to rigid."""
    places = np.unique(outside * random.uniform(0.02, 0.95, int(random.integers(1, 4))))
    if random.random() < 0.1:
        places = np.append(places, places[-1] * (1.0 + 1e-9))
    stiffness = [inf if random.random() < 0.4 else _spread(random, 1e-3, 1e9) for _ in places]
    return tuple((float(place), value) for place, value in zip(places, stiffness, strict=True))
