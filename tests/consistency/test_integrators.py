"""The study of integrators (docs/integrators.md): kept rows are found again, and the prototypes have the orders they should."""

import csv
from pathlib import Path

import numpy as np
import pytest

from benchmarks import one_matrix
from benchmarks.integrator_cases import cases, miss
from benchmarks.integrators import timed
from benchmarks.one_matrix_run import Prototype
from fem_needle import FiniteElementNeedle
from fem_needle.dynamics.grid import time_grid
from fem_needle.scene import Insertion, Layer, Sinusoid, TipLoad
from tests.consistency.scenes import scene_of
from tests.references import entry_motion

KEPT = Path(__file__).parents[2] / "benchmarks" / "results" / "integrators.csv"
pytestmark = pytest.mark.slow  # the prototypes are compiled anew in every process
METHODS = ("Gauss", "Radau IIA", "SDIRK", "RODAS")


@pytest.fixture(scope="module", autouse=True)
def compiled():
    one_matrix.prepare()


@pytest.mark.parametrize("method", METHODS)
def test_kept_rows(method):
    case = next(case for case in cases() if case.name == "entry, viscous")
    with KEPT.open(encoding="utf-8") as file:
        kept = [row for row in csv.DictReader(file) if (row["case"], row["method"]) == (case.name, method)]
    for row in kept[:2]:
        found = timed(case, method, float(row["step"]))
        assert found.steps == int(row["steps"])
        assert found.error == pytest.approx(float(row["error"]), rel=1e-3)


@pytest.mark.parametrize(("method", "order"), [("SDIRK", 4.0), ("RODAS", 4.0), (0.0, 3.0), (1.0, 4.0)])
def test_orders_of_the_prototypes(method, order):
    """One element of a growing needle that moves smoothly, against steps of the shortest kind: neither kinks nor stiff modes."""
    glide = Insertion(kind="profile", depth=Sinusoid(mean=0.1, amplitude=-0.0015, frequency=300.0, phase=np.pi / 2))
    swing = Sinusoid(mean=0.1, amplitude=0.05, frequency=400.0, phase=np.pi / 2)
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=20.0),)
    needle = FiniteElementNeedle(scene_of("entry", glide, layers, [TipLoad(force=swing)], duration=1.28e-3), elements=1)

    def tip(way, step):
        return Prototype(needle, way).run(time_grid(needle, step, 1.28e-3)).states[:, 0, -2]

    true = tip(1.0, 2.5e-7)
    errors = [miss(tip(method, step), true) for step in (4e-5, 2e-5, 1e-5)]
    assert np.log2(errors[1] / errors[2]) > order - 0.4


def test_a_fine_step_is_true():
    """An entry needle in one tissue on 12 elements: what the study measures is not the mesh."""
    case = next(case for case in cases() if case.name == "entry, elastic")
    times = np.linspace(0.0, 0.025, 3)
    true = entry_motion(case.scene, 0.025, times, degree=24, steps_per_second=3.2e4).tip_deflection
    found = Prototype(case.needle, "SDIRK").run(time_grid(case.needle, 2e-5, case.output)).states[:2, 0, -2]
    assert miss(found, true[1:]) < 1e-5
