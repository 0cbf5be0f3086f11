"""PyNiteFEA: members of a space frame, the tissue as spring supports at the nodes.

It has no time: M is a new model with its static solution at each output, without inertia.
"""

from typing import ClassVar

import numpy as np
from Pynite import FEModel3D

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.methods import Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

PACKAGE = "PyNiteFEA"


def rest(beam: GrowingBeam, depth: float, force: float, elements: int) -> float:
    """Return the static tip [m] of a new model under a tip force [N]."""
    model = FEModel3D()
    model.add_material("needle", beam.bending_stiffness, 1.0, 0.3, 1.0)
    model.add_section("needle", 1.0, 1.0, 1.0, 1.0)
    spring = beam.foundation_modulus * depth / elements
    for number, y in enumerate(np.linspace(0.0, depth, elements + 1).tolist()):
        model.add_node(f"N{number}", y, 0.0, 0.0)
        if number:
            model.add_member(f"M{number}", f"N{number - 1}", f"N{number}", "needle", "needle")
            model.def_support(f"N{number}", True, False, True, True, True, False)
            model.def_support_spring(f"N{number}", "DY", spring / 2 if number == elements else spring)
    model.def_support("N0", True, True, True, True, True, True)
    model.add_node_load(f"N{elements}", "FY", force)
    model.analyze_linear()
    return float(model.nodes[f"N{elements}"].DY["Combo 1"])


class PyNite(Method):
    """PyNiteFEA with springs at the nodes."""

    name = "PyNiteFEA"
    limited = "M: a new static model at each output, no inertia; no D and M2, it has no time"
    choices: ClassVar = {"S": over((10, 20, 40, 80)), "M": over((5, 10))}

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole program."""
        beam, elements = growing_beam(case.scene), setting.elements or 1
        places = [(beam.first_depth + beam.speed * time, beam.tip_force(time)) for time in case.times.tolist()]
        return lambda: np.array([rest(beam, depth, force, elements) for depth, force in places])


METHODS: tuple[Method, ...] = (PyNite(),)
