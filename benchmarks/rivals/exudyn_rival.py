"""Exudyn: ANCF cable elements with springs at the nodes, and its GenericODE2 with the matrices of cubic Hermite elements.

S is its static solver; D its implicit second-order integrator as average acceleration (Newmark) from that state, on one thread.
Neither object grows: M is a new model with its static solution at each output, without inertia, with own matrices.
"""

from dataclasses import replace
from typing import ClassVar

import exudyn as exu
import exudyn.itemInterface as interface  # noqa: N813
import numpy as np
from exudyn.beams import GenerateStraightLineANCFCable2D

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.library_elements import assembled
from fem_needle.benchmark.methods import Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

PACKAGE = "exudyn"
AXIAL_STIFFNESS = 1e5  # N: as stiff as needed for a straight needle
FORCE = 0.1  # N, of S: bends the shape that is let go


class Model:
    """A system, its variable of the tip's deflection and the load that bends it.

    Parameters
    ----------
    first
        Coordinates at the start; None: straight.
    """

    def __init__(self, beam: GrowingBeam, depth: float, elements: int, force: float, first: np.ndarray | None) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.force, self.first = force, first
        self.tip = self.build(beam, depth, elements)
        self.system.Assemble()
        if first is not None:
            self.system.systemData.SetODE2Coordinates(first, exu.ConfigurationType.Initial)

    def build(self, beam: GrowingBeam, depth: float, elements: int) -> tuple[int, int]:
        """Add nodes and objects; return the tip's node and coordinate."""
        raise NotImplementedError

    def rest(self) -> np.ndarray:
        """Return the coordinates at rest."""
        settings = exu.SimulationSettings()
        settings.solutionSettings.writeSolutionToFile = False
        settings.staticSolver.verboseMode = 0
        self.system.SolveStatic(settings)
        return np.array(self.system.systemData.GetODE2Coordinates())

    def released(self, duration: float, steps: int, outputs: int) -> np.ndarray:
        """Return the tips [m] at the outputs after the first shape is let go."""
        node, coordinate = self.tip
        settings = exu.SimulationSettings()
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = duration / outputs
        settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = duration, steps
        settings.timeIntegration.generalizedAlpha.useNewmark = True
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.verboseMode = 0
        sensor = {"nodeNumber": node, "storeInternal": True, "outputVariableType": exu.OutputVariableType.Coordinates}
        number = self.system.AddSensor(interface.SensorNode(**sensor))
        self.system.Assemble()
        self.system.systemData.SetODE2Coordinates(self.first, exu.ConfigurationType.Initial)
        self.system.SolveDynamic(settings)
        return np.array(self.system.GetSensorStoredData(number))[:, 1 + coordinate]


class Cable(Model):
    """ANCF cable elements."""

    def build(self, beam: GrowingBeam, depth: float, elements: int) -> tuple[int, int]:
        """Add a line of cables, fixed at its start, and a spring at every node."""
        template = interface.ObjectANCFCable2D(
            physicsMassPerLength=beam.mass_per_length,
            physicsBendingStiffness=beam.bending_stiffness,
            physicsAxialStiffness=AXIAL_STIFFNESS,
            useReducedOrderIntegration=1,
        )
        ends = {"positionOfNode0": [0, 0, 0], "positionOfNode1": [depth, 0, 0], "numberOfElements": elements}
        line = GenerateStraightLineANCFCable2D(
            self.system, **ends, cableTemplate=template, fixedConstraintsNode0=[1, 1, 0, 1], fixedConstraintsNode1=[0, 0, 0, 0]
        )
        nodes = line[0]
        ground = self.system.AddNode(interface.NodePointGround())
        fixed = self.system.AddMarker(interface.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        for node in nodes[1:]:
            spring = beam.foundation_modulus * depth / elements / (2 if node == nodes[-1] else 1)
            moving = self.system.AddMarker(interface.MarkerNodeCoordinate(nodeNumber=node, coordinate=1))
            ends = {"markerNumbers": [fixed, moving], "stiffness": spring}
            self.system.AddObject(interface.ObjectConnectorCoordinateSpringDamper(**ends))
        self.system.AddLoad(interface.LoadCoordinate(markerNumber=moving, load=self.force))
        return nodes[-1], 1


class OwnMatrices(Model):
    """Matrices of cubic elements, assembled by scikit-fem, clamped unknowns left out."""

    def build(self, beam: GrowingBeam, depth: float, elements: int) -> tuple[int, int]:
        """Add one node with all unknowns and one object with all matrices."""
        _, (mass, _, stiffness) = assembled(replace(beam, speed=0.0), elements, depth)
        free = slice(2, None)
        size = mass.shape[0] - 2
        node = self.system.AddNode(
            interface.NodeGenericODE2(
                referenceCoordinates=[0.0] * size,
                initialCoordinates=[0.0] * size,
                initialCoordinates_t=[0.0] * size,
                numberOfODE2Coordinates=size,
            )
        )
        matrices = {"massMatrix": mass.toarray()[free, free], "stiffnessMatrix": stiffness.toarray()[free, free]}
        load = np.zeros(size)
        load[size - 2] = self.force
        self.system.AddObject(interface.ObjectGenericODE2(nodeNumbers=[node], forceVector=load, **matrices))
        return node, size - 2


class Exudyn(Method):
    """Exudyn with one of its objects."""

    model: type[Model]
    offset: int

    def tip(self, model: Model, coordinates: np.ndarray) -> float:
        """Return the tip's deflection [m] among all coordinates."""
        return float(coordinates[-1 - self.offset])

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole program; on D from the shape at rest on."""
        beam, elements = growing_beam(case.scene), setting.elements or 1
        if case.name == "D":
            unit = self.model(beam, beam.first_depth, elements, FORCE, None)
            shape = unit.rest()
            first = shape * float(case.scene.initial.tip_deflection or 0.0) / self.tip(unit, shape)
            steps, outputs = setting.steps(case) or 1, len(case.times) - 1
            return lambda: self.model(beam, beam.first_depth, elements, 0.0, first).released(case.duration, steps, outputs)
        places = [(beam.first_depth + beam.speed * time, beam.tip_force(time)) for time in case.times.tolist()]
        return lambda: np.array([self._rest(beam, depth, force, elements) for depth, force in places])

    def _rest(self, beam: GrowingBeam, depth: float, force: float, elements: int) -> float:
        model = self.model(beam, depth, elements, force, None)
        return self.tip(model, model.rest())


class ExudynCable(Exudyn):
    """Exudyn with ANCF cables."""

    name = "Exudyn, ANCF cable"
    limited = "no M: its nodes do not move along the needle; D: at most 20 000 steps"
    model, offset = Cable, 2
    choices: ClassVar = {"S": over((5, 10, 20, 40)), "D": over((10, 20, 40), time_steps=(5e-5, 2e-5, 5e-6))}


class ExudynMatrices(Exudyn):
    """Exudyn with own matrices."""

    name = "Exudyn, own matrices"
    limited = "M: a new static model at each output, no inertia"
    model, offset = OwnMatrices, 1
    choices: ClassVar = {
        "S": over((1, 2, 4, 8)),
        "D": over((8, 16, 24), time_steps=(5e-5, 1e-5, 2e-6)),
        "M": over((2, 4)),
    }


METHODS: tuple[Method, ...] = (ExudynCable(), ExudynMatrices())
