"""Plain random scenes for studies of automatic settings; `random_kinds` has the other kinds."""

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

OUTPUTS = 50
LONGEST = 1.0  # s


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


def logarithmic(random, low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _insertion(random):
    start = float(random.uniform(0.04, 0.1))
    speed, way = logarithmic(random, 1e-3, 3.0), float(random.uniform(0.005, 0.08))
    duration = min(way / speed, LONGEST)
    way = speed * duration
    choice = random.random()
    if choice < 0.2:
        return Insertion(kind="hold", initial_depth=start), logarithmic(random, 0.01, 0.3)
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
        damping = logarithmic(random, 0.5, 50.0) if random.random() < 0.5 else 0.0
        end = {"end": edges[number + 1]} if number + 1 < len(edges) else {}
        layers.append(Layer(start=edge, foundation_modulus=logarithmic(random, 300.0, 5e4), damping=damping, **end))
    return tuple(layers)


def tip_force(random, duration):
    choice, size = random.random(), logarithmic(random, 0.02, 0.5)
    if choice < 0.5:
        return size
    if choice < 0.85:
        frequency = logarithmic(random, 0.5 / duration, min(20.0 / duration, 200.0) + 0.6 / duration)
        amplitude, phase = size * float(random.uniform(0.1, 1.0)), float(random.uniform(0, 6))
        return Sinusoid(mean=size, amplitude=amplitude, frequency=frequency, phase=phase)
    return Table(time=[0.0, 0.3 * duration, 0.6 * duration], value=[0.5 * size, 0.5 * size, size])


def _loads(random, kind, duration):
    loads = [TipLoad(force=tip_force(random, duration))]
    if kind == "hub" and random.random() < 0.5:
        loads.append(LateralLoad(position=float(random.uniform(-0.03, -0.003)), force=tip_force(random, duration)))
    return tuple(loads)


def _guides(random):
    if random.random() < 0.5:
        return ()
    return (Guide(position=float(random.uniform(-0.03, -0.003)), stiffness=logarithmic(random, 50.0, 5e3)),)


def _initial(random):
    choice = random.random()
    if choice < 0.8:
        return Initial()
    return Initial(shape="straight") if choice < 0.9 else Initial(shape="tip-displaced", tip_deflection=1e-3)
