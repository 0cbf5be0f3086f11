"""Random scenes for studies of automatic settings: everything that the two slow reference solvers can have."""

import numpy as np

from fem_needle.scene import (
    Guide,
    Initial,
    Insertion,
    LateralLoad,
    Layer,
    Numerics,
    Run,
    Scene,
    Sinusoid,
    Support,
    Table,
    TipLoad,
    Tissue,
)
from tests.consistency.scenes import NEEDLE
from tests.references import entry_motion, hub_motion

OUTPUTS = 50
LONGEST = 1.0  # s
FINENESS = {"entry": ((18, 4), (24, 8)), "hub": ((26, 4), (36, 8))}  # degrees and steps per output: coarse truth, fine truth
PERIODS = 400.0  # steps per second and unit of fineness at least: fast vibrations of short needles


def random_scene(seed):
    """Return a scene: entry or hub, layers, damping, guides, moving and swinging forces, holds, releases, 1 mm/s to 3 m/s."""
    random = np.random.default_rng(seed)
    kind = str(random.choice(["entry", "hub"]))
    insertion, duration = _insertion(random)
    support = {}
    if kind == "hub":
        support["guides"] = _guides(random)
        if random.random() < 0.25:
            frequency, phase = float(random.uniform(1.0, 40.0)), float(random.uniform(0, 6))
            support["hub_angle"] = Sinusoid(amplitude=0.01, frequency=frequency, phase=phase)
    return Scene(
        needle=NEEDLE,
        support=Support(kind=kind, **support),
        tissue=Tissue(layers=_layers(random)),
        insertion=insertion,
        loads=_loads(random, kind, duration),
        initial=_initial(random),
        run=Run(duration=duration),
        numerics=Numerics(analysis="dynamic" if random.random() < 0.5 else "auto", output_step=duration / OUTPUTS),
    )


def _logarithmic(random, low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _insertion(random):
    start = float(random.uniform(0.04, 0.1))
    speed, way = _logarithmic(random, 1e-3, 3.0), float(random.uniform(0.005, 0.08))
    duration = min(way / speed, LONGEST)
    way = speed * duration
    choice = random.random()
    if choice < 0.2:
        return Insertion(kind="hold", initial_depth=start), _logarithmic(random, 0.01, 0.3)
    if choice < 0.6:
        return Insertion(kind="speed", initial_depth=start, speed=speed, final_depth=start + way), 1.2 * duration
    if choice < 0.8:  # in, a hold, half out again
        times, inner = [0.0, 0.4 * duration, 0.6 * duration, duration], start + way
        return Insertion(kind="profile", depth=Table(time=times, value=[start, inner, inner, start + way / 2])), duration
    turning = Sinusoid(mean=start + way / 2, amplitude=-way / 2, frequency=0.5 / duration, phase=np.pi / 2)
    return Insertion(kind="profile", depth=turning), duration


def _layers(random):
    edges = [0.0, *np.sort(random.uniform(0.03, 0.16, int(random.integers(0, 3)))).tolist()]
    layers = []
    for number, edge in enumerate(edges):
        damping = _logarithmic(random, 0.5, 50.0) if random.random() < 0.5 else 0.0
        end = {"end": edges[number + 1]} if number + 1 < len(edges) else {}
        layers.append(Layer(start=edge, foundation_modulus=_logarithmic(random, 300.0, 5e4), damping=damping, **end))
    return tuple(layers)


def _force(random, duration):
    choice, size = random.random(), _logarithmic(random, 0.02, 0.5)
    if choice < 0.5:
        return size
    if choice < 0.85:
        frequency = _logarithmic(random, 0.5 / duration, min(20.0 / duration, 200.0) + 0.6 / duration)
        amplitude, phase = size * float(random.uniform(0.1, 1.0)), float(random.uniform(0, 6))
        return Sinusoid(mean=size, amplitude=amplitude, frequency=frequency, phase=phase)
    return Table(time=[0.0, 0.3 * duration, 0.6 * duration], value=[0.5 * size, 0.5 * size, size])


def _loads(random, kind, duration):
    loads = [TipLoad(force=_force(random, duration))]
    if kind == "hub" and random.random() < 0.5:
        loads.append(LateralLoad(position=float(random.uniform(-0.03, -0.003)), force=_force(random, duration)))
    return tuple(loads)


def _guides(random):
    if random.random() < 0.5:
        return ()
    return (Guide(position=float(random.uniform(-0.03, -0.003)), stiffness=_logarithmic(random, 50.0, 5e3)),)


def _initial(random):
    choice = random.random()
    if choice < 0.8:
        return Initial()
    return Initial(shape="straight") if choice < 0.9 else Initial(shape="tip-displaced", tip_deflection=1e-3)


def true_tips(scene, times):
    """Return the tips [m] by an independent solver, and their own uncertainty relative to the largest."""
    solve = entry_motion if scene.support.kind == "entry" else hub_motion
    duration, found = float(times[-1]), []
    for degree, fineness in FINENESS[scene.support.kind]:
        steps = max(fineness * OUTPUTS / duration, fineness * PERIODS)
        found.append(solve(scene, duration, times, degree=degree, steps_per_second=steps).tip_deflection)
    coarse, fine = found
    return fine, float(np.max(np.abs(coarse - fine)) / np.max(np.abs(fine)))
