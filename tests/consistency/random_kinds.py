"""Kinds of random scenes that the plain ones do not have: bevel, cut path, push, guides; and which kind a seed announces."""

import numpy as np

from fem_needle.scene import (
    Friction,
    Guide,
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
from tests.consistency.random_scenes import OUTPUTS, logarithmic, random_scene, tip_force

SPECIAL = ("bevel", "cut-path", "push", "guides")
KINDS = ("plain", *SPECIAL)
FIRST_SPECIAL, ANNOUNCED = 200, 500  # seeds below the first are plain; those below the second are the announced ones


def kind_of(seed):
    """Return the kind that a seed announces."""
    if seed < FIRST_SPECIAL:
        return "plain"
    return SPECIAL[seed % len(SPECIAL)] if seed < ANNOUNCED else KINDS[seed % len(KINDS)]


def scene_of_seed(seed):
    """Return the scene of a seed, of the kind that it announces."""
    kind = kind_of(seed)
    if kind == "plain":
        return random_scene(seed)
    makers = {"bevel": _bevel, "cut-path": _cut_path, "push": _push, "guides": _guides}
    return makers[kind](np.random.default_rng([seed, KINDS.index(kind)]), random_scene(seed))


def _with(scene, **parts):
    return Scene(**({name: getattr(scene, name) for name in type(scene).model_fields} | parts))


def _depths(scene):
    """Shallowest and deepest depth."""
    return scene.insertion.depth_range(scene.duration)


def _bevel(random, scene):
    """A tip force that follows the layer at the tip, which passes one border at least where it moves; half of them turned."""
    low, high = _depths(scene)
    others = random.uniform(low, max(high, low + 0.01)), random.uniform(0.02, 0.17, random.integers(0, 3))
    edges = sorted({0.0, float(others[0]), *others[1].tolist()})
    layers = [
        Layer(
            start=edge,
            foundation_modulus=logarithmic(random, 300.0, 5e4),
            damping=logarithmic(random, 0.5, 50.0) if random.random() < 0.5 else 0.0,
            **({"end": after} if after else {}),
        )
        for edge, after in zip(edges, [*edges[1:], None], strict=True)
    ]
    turns = {}
    if random.random() < 0.5:
        frequency = float(random.uniform(0.5, 3.0)) / scene.duration
        turns["direction"] = Sinusoid(amplitude=1.0, frequency=frequency, phase=float(random.uniform(0, 6)))
    loads = [TipLoad(bevel_coefficient=logarithmic(random, 1e-6, 1e-5), **turns)]
    return _with(scene, tissue=Tissue(layers=layers), loads=loads)


def _cut_path(random, scene):
    """A tissue that rests on the path of the tip: in; in, a hold and out; in, out and in again beyond."""
    speed, way, start = logarithmic(random, 5e-3, 2.0), float(random.uniform(0.01, 0.07)), float(random.uniform(0.04, 0.1))
    duration = min(way / speed, 1.0)
    inner, choice = start + speed * duration, random.random()
    if choice < 0.5:
        insertion, whole = Insertion(kind="speed", initial_depth=start, speed=speed, final_depth=inner), 1.2 * duration
    else:
        between = 0.4 * start + 0.6 * inner
        depths = [start, between, between, start] if choice < 0.75 else [start, between, 0.5 * (start + between), inner]
        whole = 1.5 * duration
        insertion = Insertion(kind="profile", depth=Table(time=[0.0, 0.4 * whole, 0.6 * whole, whole], value=depths))
    loads = [TipLoad(force=tip_force(random, whole))]
    if random.random() < 0.4:
        loads = [TipLoad(bevel_coefficient=logarithmic(random, 1e-6, 1e-5))]
    tissue = Tissue(layers=scene.tissue.layers, rest_line="cut-path")
    numerics = Numerics(analysis=scene.numerics.analysis, output_step=whole / OUTPUTS)
    return _with(scene, tissue=tissue, insertion=insertion, loads=loads, run=Run(duration=whole), numerics=numerics)


def _push(random, scene):
    """A push from rest against friction, cutting and a membrane: even, rising from nothing, or to and fro."""
    drive, speed = float(random.uniform(0.3, 2.0)), logarithmic(random, 0.01, 2.0)
    way, start, choice = float(random.uniform(0.01, 0.06)), float(random.uniform(0.04, 0.1)), random.random()
    duration = max(min(way / speed, 1.0), 0.005)
    coulomb = float(random.uniform(0.05, 0.5))
    friction = Friction(coulomb=coulomb, viscous=drive / speed, coulomb_per_length=float(random.choice([0.0, 1.0])))
    edges, layers = [0.0, start + float(random.uniform(0.002, 0.05))], []
    for edge, after in zip(edges, [edges[1], None], strict=True):
        mechanics = {"foundation_modulus": logarithmic(random, 300.0, 5e4)}
        mechanics["damping"] = logarithmic(random, 0.5, 50.0) if random.random() < 0.5 else 0.0
        mechanics["cutting_force"] = float(random.uniform(0.0, 0.3)) * drive
        mechanics["puncture_force"] = float(random.uniform(0.0, 0.9)) * drive if edge else 0.0
        layers.append(Layer(start=edge, **mechanics, **({"end": after} if after else {})))
    force = drive + coulomb
    if choice > 0.75:
        force = Sinusoid(mean=0.3 * drive, amplitude=drive + coulomb, frequency=float(random.uniform(1.0, 4.0)) / duration)
    elif choice > 0.5:
        force = Table(time=[0.0, 0.5 * duration, duration], value=[0.0, force, force])
    loads = [TipLoad(force=logarithmic(random, 0.02, 0.5))]
    return _with(
        scene,
        support=Support(kind=scene.support.kind, guides=scene.support.guides),
        tissue=Tissue(layers=layers),
        insertion=Insertion(kind="force", initial_depth=start, push_force=force),
        loads=loads,
        friction=friction,
        run=Run(duration=duration),
        numerics=Numerics(analysis=scene.numerics.analysis, output_step=duration / OUTPUTS),
    )


def _guides(random, scene):
    """A hub with one or two guides, rigid or elastic, a force beside them, and a hub that moves from rest."""
    places = -np.sort(random.uniform(0.003, 0.03, 3))
    stiffness = ["rigid" if random.random() < 0.6 else logarithmic(random, 50.0, 5e3) for _ in range(2)]
    guides = [Guide(position=float(y), stiffness=k) for y, k in zip(places[: random.integers(1, 3)], stiffness, strict=False)]
    support, duration = {}, scene.duration
    if random.random() < 0.5:
        shape = {"frequency": float(random.uniform(0.5, 3.0)) / duration, "phase": np.pi / 2}  # begins at rest
        size = logarithmic(random, 1e-4, 2e-3)
        name, scale = ("hub_deflection", 1.0) if random.random() < 0.5 else ("hub_angle", 10.0)
        support[name] = Sinusoid(mean=scale * size, amplitude=-scale * size, **shape)
    loads = [TipLoad(force=tip_force(random, duration))]
    if random.random() < 0.6:
        loads.append(LateralLoad(position=float(places[2]), force=tip_force(random, duration)))
    return _with(scene, support=Support(kind="hub", guides=guides, **support), loads=loads)
