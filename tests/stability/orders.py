"""Measured orders of every integrator: ``python -m tests.stability.orders`` prints the table of docs/robustness.md.

Few coordinates, so that the steps resolve every vibration and the order of the method shows. Errors are those of all coordinates
at the end, against DOP853 on the assembled equations at a relative tolerance of 1e-12 (`assembled`), of tip and depth where
a loop is closed or the needle pushed. Only a cut path, which is no differential equation in the coordinates alone, is compared
with itself at half the step. Kinks lie off the grid of steps: it is the loop that lands on them. An error at one instant may pass
zero by chance between two steps; the motions and loads below end at instants where it does not.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fem_needle import FiniteElementNeedle, Simulation, simulate
from fem_needle.scene import Friction, Insertion, LateralLoad, Layer, Numerics, Sinusoid, Table, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import held, scene_of
from tests.stability.assembled import Assembled, Creeping, Pushed

DURATION = 1.28e-3
STEPS = (8e-5, 4e-5, 2e-5, 1e-5)
CASES = ("held, smooth", "held, kinked", "moving, smooth", "moving, kinked")
SMOOTH = Sinusoid(mean=0.1, amplitude=0.05, frequency=400.0, phase=np.pi / 2)
KINKED = Table(time=[0.0, 0.3 * DURATION, 0.55 * DURATION, DURATION], value=[0.1, 0.1, -0.2, -0.1])
GLIDE = Insertion(kind="profile", depth=Sinusoid(mean=0.1, amplitude=-0.0015, frequency=300.0, phase=np.pi / 2))  # 2.8 m/s
KINKS = [0.0, 0.3 * DURATION, 0.7 * DURATION, DURATION]
TURN = Insertion(kind="profile", depth=Table(time=KINKS, value=[0.1, 0.101, 0.099, 0.1]))  # 2.6 m/s in, 3.9 out, 2.6 in
MOTIONS = {"held": (held(0.1), held(0.1)), "moving": (GLIDE, TURN)}
# A gap, and a node of the hub's mesh that passes the skin on the way.
SOFT = (Layer(start=0.0, end=0.0437, foundation_modulus=5e3, damping=5.0), Layer(start=0.05, foundation_modulus=2e4, damping=5.0))
VISCOUS = (Layer(start=0.0, foundation_modulus=5e3, damping=20.0),)


@dataclass(frozen=True)
class Model:
    """A model of few coordinates and its support."""

    name: str
    support: str

    def plant(self, scene):
        """The plant of a scene."""
        if self.name == "modes":
            return AssumedModeNeedle(scene, modes=2)
        return FiniteElementNeedle(scene, elements=1 if self.support == "entry" else 2)


ELEMENTS, HUB, MODES, HUB_MODES = (Model(name, kind) for name in ("elements", "modes") for kind in ("entry", "hub"))


def scene_for(model, case, layers=SOFT, **numerics):
    """The scene of one case."""
    motion, kind = case.split(", ")
    load = KINKED if kind == "kinked" else SMOOTH
    loads = [TipLoad(force=load), *([LateralLoad(position=-0.005, force=load)] if model.support == "hub" else [])]
    insertion = MOTIONS[motion][kind == "kinked"]
    return scene_of(model.support, insertion, layers, loads, numerics=Numerics(**numerics), duration=DURATION)


def observed(errors, counts):
    """The order between the last two of the errors, by the numbers of steps."""
    return float(np.log(errors[-2] / errors[-1]) / np.log(counts[-1] / counts[-2]))


@cache
def reference(model, case, creeping=False):
    """Free coordinates at the end."""
    plant = model.plant(scene_for(model, case, VISCOUS if creeping else SOFT))
    return (Creeping if creeping else Assembled)(plant).moved(DURATION)


def stepped(model, case, creeping=False, **numerics):
    """Errors and numbers of steps of the collocation methods."""
    scene = scene_for(model, case, VISCOUS if creeping else SOFT, **numerics)
    plant, true = model.plant(scene), reference(model, case, creeping)
    analysis = "quasi-static" if creeping else "dynamic"
    errors, counts = [], []
    for step in STEPS:
        run = simulate(plant, time_step=step, analysis=analysis, output_step=DURATION)
        found = run.coordinates[-1, plant.prescribed :]
        errors.append(np.max(np.abs(found - true)) / np.max(np.abs(true)))
        counts.append(run.summary["steps"])
    return errors, counts


def pushed_scene(model, case, push=None):
    """A needle that slides in all the time."""
    motion, kind = case.split(", ")
    assert motion == "moving"
    smooth = Sinusoid(mean=3.0, amplitude=1.0, frequency=200.0)
    kinked = Table(time=[0.0, 0.3 * DURATION, 0.55 * DURATION, DURATION], value=[3.0, 3.0, 5.0, 2.0])
    insertion = Insertion(kind="force", initial_depth=0.1, push_force=push or (kinked if kind == "kinked" else smooth))
    friction = Friction(coulomb=0.5, viscous=0.3)
    return scene_of(model.support, insertion, VISCOUS, [TipLoad(force=2.0)], friction=friction, duration=DURATION)


@cache
def pushed_reference(model, case):
    """Way and tip at the end."""
    plant = model.plant(pushed_scene(model, case))
    whole = Pushed(plant)
    time, state, _ = whole.slid(DURATION)[-1]
    return np.array([state[-2] - 0.1, whole.tip(state, state[-2], time)])


def pushed(model, case):
    """Errors and numbers of steps of a push: first and last of three halvings, whose last errors are near the reference's own."""
    plant, true, errors, counts = model.plant(pushed_scene(model, case)), pushed_reference(model, case), [], []
    for step in STEPS:
        run = simulate(plant, time_step=step, analysis="dynamic", output_step=DURATION)
        errors.append(np.max(np.abs(np.array([run.depth[-1] - 0.1, run.tip_deflection[-1]]) / true - 1.0)))
        counts.append(run.summary["steps"])
    return errors[::3], counts[::3]


# A lateral force at a hub needle, or the push, commanded four times; the command holds until the next one.
COMMANDS = {"lateral_force": (0.1, 0.3, -0.2, 0.15), "push_force": (3.0, 5.0, 2.0, 4.0)}


class Commanded:
    """What is commanded in place of the scene's own force; steps of a command are kinks."""

    commanded = "lateral_force"

    def command(self, time):
        """The command that holds at a time."""
        return COMMANDS[self.commanded][min(int(4.0 * time / DURATION), 3)]

    def kinks(self, duration):
        """The scene's kinks and the instants of commands."""
        return sorted({*super().kinks(duration), *(part * DURATION / 4.0 for part in (1, 2, 3))})


class CommandedForce(Commanded, Assembled):
    """A commanded lateral force."""

    def forces(self, depth, time):
        """The loads with the commanded one."""
        found = super().forces(depth, time).copy()
        found[0] = self.command(time)
        return found


class CommandedPush(Commanded, Pushed):
    """A commanded push."""

    commanded, now = "push_force", 0.0

    def push(self, time):
        """The push of the piece that is being integrated."""
        return self.command(self.now)

    def _phase(self, start, *rest):
        self.now = start + 1e-9 * DURATION
        return super()._phase(start, *rest)


@cache
def loop_reference(model, case):
    """Free coordinates, or way and tip, under commands."""
    if case == "push":
        scene = pushed_scene(model, CASES[3], 3.0)
        whole = CommandedPush(model.plant(scene))
        time, state, _ = whole.slid(DURATION)[-1]
        return np.array([state[-2] - 0.1, whole.tip(state, state[-2], time)])
    whole = CommandedForce(model.plant(scene_for(model, case)))
    state = whole.moved(DURATION)
    return np.array([whole.tip(state, whole.law.depth(DURATION), DURATION)])


def looped(model, case, *, push=False):
    """Errors and numbers of steps of a commanded needle."""
    name = "push_force" if push else "lateral_force"
    scene = pushed_scene(model, case, 3.0) if push else scene_for(model, case)
    plant, true, errors, counts = model.plant(scene), loop_reference(model, "push" if push else case), [], []
    for step in STEPS[:3] if push else STEPS:
        loop = Simulation(plant, time_step=step, analysis="dynamic", output_step=DURATION)
        for value in COMMANDS[name]:
            loop.step({name: value}, DURATION / 4.0)
        found = np.array([loop.depth - 0.1, loop.tip_deflection] if push else [loop.tip_deflection])
        errors.append(np.max(np.abs(found / true - 1.0)))
        counts.append(loop.steps)
    return errors, counts





# A slow needle in its own path: quasi-static, and with inertia and viscosity.
PATH_STEPS = (0.2, 0.1, 0.05, 0.025, 0.0125)
FIRM = (Layer(start=0.0, foundation_modulus=5e4, damping=500.0),)


def cut(model, case):
    """Differences between successive steps, and numbers of steps, of a needle that cuts its path."""
    kinked = case.endswith("kinked")
    depth = Table(time=[0.0, 0.3, 0.7, 1.0], value=[0.05, 0.08, 0.07, 0.1] if kinked else [0.05, 0.065, 0.085, 0.1])
    insertion = Insertion(kind="profile", depth=depth)
    scene = scene_of(model.support, insertion, FIRM, duration=1.0, tissue={"rest_line": "cut-path"})
    plant, tips, counts = model.plant(scene), [], []
    for step in PATH_STEPS:
        run = simulate(plant, time_step=step, analysis="quasi-static", output_step=1.0)
        tips.append(run.tip_deflection[-1])
        counts.append(run.summary["steps"])
    return np.abs(np.diff(tips)), counts[:-1]


def rows():
    """Name, designed order and, for each of the cases, what gives errors and numbers of steps (None: there is no such case)."""

    def every(function, *given, **options):
        return [lambda case=case: function(*given, case, **options) for case in CASES]

    def only(function, *given, cases, **options):
        return [(lambda case=case: function(*given, case, **options)) if case in cases else None for case in CASES]

    lossy, radau = {"spectral_radius": 0.5}, {"spectral_radius": 0.0}
    inward = CASES[2:]
    return [
        *((f"collocation, radius 1 (Gauss), {name}", 4, every(stepped, model)) for name, model in NAMED.items()),
        *((f"collocation, radius 1/2, {name}", 3, every(stepped, model, **lossy)) for name, model in ENTRY.items()),
        *((f"collocation, radius 0 (Radau), {name}", 3, every(stepped, model, **radau)) for name, model in ENTRY.items()),
        *((f"creep (Radau), {name}", 3, every(stepped, model, creeping=True)) for name, model in ENTRY.items()),
        *((f"push: depth and tip, {name}", 4, only(pushed, model, cases=inward)) for name, model in NAMED.items()),
        ("commanded force, elements, hub", 4, only(looped, HUB, cases=CASES[1::2])),
        ("commanded force, modes, hub", 4, only(looped, HUB_MODES, cases=CASES[1::2])),
        ("commanded push, elements, hub", 4, only(looped, HUB, cases=CASES[3:], push=True)),
        *((f"cut path (Radau), {name}", 2, only(cut, model, cases=inward)) for name, model in ENTRY.items()),
    ]


NAMED = {"elements, entry": ELEMENTS, "elements, hub": HUB, "modes, entry": MODES}
ENTRY = {"elements, entry": ELEMENTS, "modes, entry": MODES}


def measured():
    """Name, designed order and observed orders (None: no such case) of every row."""
    return [(name, order, [None if give is None else observed(*give()) for give in cells]) for name, order, cells in rows()]


def table(found):
    """The rows as a table of a document."""
    lines = [f"| integrator | designed | {' | '.join(CASES)} |", "|---" * (len(CASES) + 2) + "|"]
    for name, order, values in found:
        lines.append(f"| {name} | {order} | {' | '.join('' if value is None else f'{value:.1f}' for value in values)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(measured()))
