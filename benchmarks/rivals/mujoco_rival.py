"""MuJoCo: a mass on a slide joint at each node, the tissue as the joints' springs, bending as springs of fixed tendons.

A fixed tendon whose length is w[i-1] - 2 w[i] + w[i+1] is the curvature by finite differences, of second order; this takes fewer
and longer steps than a chain of links on hinges, because no link is stiff in itself. Its integrators are explicit in stiffness: a
step must be shorter than 2 / (largest frequency). It has no statics: S is relaxed with damping close to critical.
"""

from typing import ClassVar

import mujoco
import numpy as np

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.methods import Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

PACKAGE = "mujoco"
STABLE = 0.9  # of the longest stable step of the explicit integrator, 2 / largest frequency
SETTLED = 14.0  # time constants of the relaxation: e^-14 is 1e-6


def lowest_frequency(beam: GrowingBeam) -> float:
    """Return about the lowest natural frequency at the first depth [rad/s]."""
    bending = beam.bending_stiffness * (3.516 / beam.first_depth**2) ** 2
    return float(np.sqrt((bending + beam.foundation_modulus) / beam.mass_per_length))


def longest_step(beam: GrowingBeam, elements: int) -> float:
    """Return a stable step [s]: the largest frequency of finite differences is 4 / h^2 sqrt(EI / rho A)."""
    size = beam.first_depth / elements
    return STABLE * 2 * size**2 / 4 / float(np.sqrt(beam.bending_stiffness / beam.mass_per_length))


def description(beam: GrowingBeam, elements: int, step: float, rate: float) -> str:
    """Return the model in MJCF; ``rate`` [1/s] damps every node."""
    size = beam.first_depth / elements
    bodies, tendons = [], []
    for node in range(1, elements + 1):
        share = size / 2 if node == elements else size
        mass = beam.mass_per_length * share
        spring = f'stiffness="{beam.foundation_modulus * share}" damping="{rate * mass}"'
        joint = f'<joint name="w{node}" type="slide" axis="0 0 1" {spring}/>'
        inertia = f'<inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/>'
        bodies.append(f'<body pos="{node * size} 0 0">{inertia}{joint}</body>')
    stiffness = beam.bending_stiffness / size**3
    for node in range(elements):
        weights = {1: 2.0} if node == 0 else {node - 1: 1.0, node: -2.0, node + 1: 1.0}
        parts = "".join(f'<joint joint="w{other}" coef="{weight}"/>' for other, weight in weights.items() if other)
        spring = stiffness / 2 if node == 0 else stiffness
        tendons.append(f'<fixed stiffness="{spring}" springlength="0">{parts}</fixed>')
    flags = '<flag contact="disable" constraint="disable" gravity="disable"/>'
    option = f'<compiler boundmass="0" boundinertia="0"/><option timestep="{step}" integrator="implicitfast">{flags}</option>'
    return f"<mujoco>{option}<worldbody>{''.join(bodies)}</worldbody><tendon>{''.join(tendons)}</tendon></mujoco>"


def relaxed(beam: GrowingBeam, elements: int, force: float) -> np.ndarray:
    """Return the deflections [m] at rest under a tip force [N]."""
    step, rate = longest_step(beam, elements), 2 * lowest_frequency(beam)
    model = mujoco.MjModel.from_xml_string(description(beam, elements, step, rate))
    data = mujoco.MjData(model)
    data.qfrc_applied[-1] = force
    mujoco.mj_step(model, data, nstep=int(SETTLED / (rate / 2) / step))
    return np.array(data.qpos)


def released(model: mujoco.MjModel, first: np.ndarray, outputs: int, between: int) -> np.ndarray:
    """Return the tips [m] at the outputs after a shape is let go."""
    data = mujoco.MjData(model)
    data.qpos[:] = first
    tips = [data.qpos[-1]]
    # Its semi-implicit steps have positions at full and velocities at half steps: half a kick to start with.
    mujoco.mj_forward(model, data)
    data.qvel[:] = -0.5 * model.opt.timestep * data.qacc
    for _ in range(outputs):
        mujoco.mj_step(model, data, nstep=between)
        tips.append(data.qpos[-1])
    return np.array(tips)


class MuJoCo(Method):
    """MuJoCo with slide joints and fixed tendons."""

    name = "MuJoCo"
    limited = "no M: its bodies do not grow; D: steps are stable up to 2 / (largest frequency)"
    choices: ClassVar = {"S": over((10, 20, 40, 80)), "D": over((10, 20, 40, 80))}

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the relaxation with the model's compilation, or the steps of a compiled model."""
        beam, elements = growing_beam(case.scene), setting.elements or 1
        if case.at_rest:
            return lambda: relaxed(beam, elements, beam.tip_force(0.0))[-1:]
        shape = relaxed(beam, elements, 1.0)
        first = shape * float(case.scene.initial.tip_deflection or 0.0) / shape[-1]
        output = float(case.times[1] - case.times[0])
        between = int(np.ceil(output / longest_step(beam, elements)))
        model = mujoco.MjModel.from_xml_string(description(beam, elements, output / between, 0.0))
        return lambda: released(model, first, len(case.times) - 1, between)


METHODS: tuple[Method, ...] = (MuJoCo(),)
