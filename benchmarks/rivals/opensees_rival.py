"""OpenSeesPy: elastic beam-columns with consistent mass, the tissue as springs at the nodes.

S is its static analysis; D its transient one by average acceleration with a linear algorithm, released from that state. It has no
member that grows: M is a new model with its static solution at each output, without inertia.

On Linux it needs libblas and liblapack of the system.
"""

from typing import ClassVar

import numpy as np

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.methods import Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

try:
    import openseespy.opensees as ops
except RuntimeError as error:  # it raises this where its library cannot be loaded
    raise ImportError(f"{error} (libblas and liblapack are needed)") from error

PACKAGE = "openseespy"


def build(beam: GrowingBeam, depth: float, elements: int) -> int:
    """Make the model of the inserted part and return the node of the tip."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    positions = np.linspace(0.0, depth, elements + 1)
    for number, y in enumerate(positions.tolist()):
        ops.node(number, y, 0.0)
    ops.fix(0, 1, 1, 1)
    ops.geomTransf("Linear", 1)
    for number in range(elements):
        properties = (1.0, beam.bending_stiffness, 1.0, 1)  # area, E, second moment of area, transformation
        ops.element("elasticBeamColumn", number + 1, number, number + 1, *properties, "-mass", beam.mass_per_length, "-cMass")
    spring = beam.foundation_modulus * depth / elements
    ops.uniaxialMaterial("Elastic", 1, spring)
    ops.uniaxialMaterial("Elastic", 2, spring / 2)
    for number in range(1, elements + 1):
        ground = elements + number
        ops.node(ground, float(positions[number]), 0.0)
        ops.fix(ground, 1, 1, 1)
        ops.fix(number, 1, 0, 0)
        ops.element("zeroLength", 2 * elements + number, ground, number, "-mat", 2 if number == elements else 1, "-dir", 2)
    return elements


def rest(tip: int, force: float) -> float:
    """Solve the static problem under a tip force [N] and return the tip deflection [m]."""
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(tip, 0.0, force, 0.0)
    ops.system("BandSPD")
    ops.numberer("RCM")
    ops.constraints("Plain")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static", "-noWarnings")
    ops.analyze(1)
    return float(ops.nodeDisp(tip, 2))


def released(beam: GrowingBeam, elements: int, first: float, steps: int, between: int, length: float) -> np.ndarray:
    """Let the shape under a tip force go and return the tip at the outputs."""
    tip = build(beam, beam.first_depth, elements)
    force = first / rest(tip, 1.0)
    tip = build(beam, beam.first_depth, elements)
    tips = [rest(tip, force)]
    ops.remove("loadPattern", 1)
    ops.wipeAnalysis()
    ops.setTime(0.0)
    ops.system("BandSPD")
    ops.numberer("RCM")
    ops.constraints("Plain")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.algorithm("Linear", "-factorOnce")
    ops.analysis("Transient", "-noWarnings")
    for _ in range(steps // between):
        ops.analyze(between, length)
        tips.append(ops.nodeDisp(tip, 2))
    return np.array(tips)


class OpenSees(Method):
    """OpenSeesPy with springs at the nodes."""

    name = "OpenSeesPy"
    limited = "D: at most 50 000 steps; M: a new static model at each output, no inertia"
    choices: ClassVar = {
        "S": over((10, 20, 40, 80)),
        "D": over((20, 40, 80), time_steps=(2e-5, 5e-6, 2e-6)),
        "M": over((10, 20, 40)),
    }

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole program: building the model is part of each answer."""
        beam, elements = growing_beam(case.scene), setting.elements or 1
        if case.name == "D":
            steps = setting.steps(case) or 1
            between, length = steps // (len(case.times) - 1), case.duration / steps
            first = float(case.scene.initial.tip_deflection or 0.0)
            return lambda: released(beam, elements, first, steps, between, length)
        return lambda: np.array([at_rest(beam, time, elements) for time in case.times.tolist()])


def at_rest(beam: GrowingBeam, time: float, elements: int) -> float:
    """Return the static tip [m] at a time [s]."""
    return rest(build(beam, beam.first_depth + beam.speed * time, elements), beam.tip_force(time))


METHODS: tuple[Method, ...] = (OpenSees(),)
