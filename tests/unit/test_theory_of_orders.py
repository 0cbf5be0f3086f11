"""Which order a study is told to expect, and where there is no theory."""

import pytest

from fem_needle import FiniteElementNeedle
from fem_needle.convergence.theoretical_order import theoretical_order
from fem_needle.scene import Insertion, LateralLoad, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import GEL, LAYERS, held, moving, scene_of

PUSHED = scene_of("hub", Insertion(kind="force", initial_depth=0.1, push_force=1.0))
LET_GO = scene_of("entry", held(0.1), initial={"shape": "tip-displaced", "tip_deflection": 1e-3})
FINGER = scene_of("hub", held(0.1), loads=[TipLoad(force=0.1), LateralLoad(position=-0.01, force=0.1)])
SPRING = scene_of("entry", held(0.1), (), tissue={"kind": "tip-spring", "tip_stiffness": 50.0})


def elements(scene, degree=4):
    return FiniteElementNeedle(scene, elements=4, degree=degree)


def modes(scene, **settings):
    return AssumedModeNeedle(scene, modes=2, **settings)


CASES = {
    "cut path": (elements(scene_of("entry", held(0.1), tissue={"rest_line": "cut-path"})), "elements", "static", None, "path"),
    "tip spring": (elements(SPRING), "elements", "static", None, "a tip spring"),
    "push": (elements(PUSHED), "time-step", "dynamic", None, "a needle that is pushed"),
    "modes over elements": (modes(FINGER), "elements", "static", None, "no theory for this model over elements"),
    "modes under a finger": (modes(FINGER), "modes", "static", None, "under a tip force alone"),
    "modes": (modes(scene_of("hub", held(0.1))), "modes", "static", 3.0, "N^-3"),
    "steps": (elements(scene_of("hub", moving(1.0, 0.1, 0.11))), "time-step", "dynamic", 4.0, "collocation of order 4"),
    "creep": (elements(scene_of("hub", moving(1.0, 0.1, 0.11))), "time-step", "quasi-static", 3.0, "collocation of order 3"),
    "steps of a release": (elements(LET_GO), "time-step", "dynamic", 1.2, "out of phase"),
    "elements of a release": (elements(LET_GO), "elements", "dynamic", 2.25, "out of phase"),
    "quartics": (elements(scene_of("entry", held(0.1), GEL)), "elements", "static", 6.0, "2 (degree - 1) = 6"),
    "cubics": (elements(scene_of("entry", held(0.1), LAYERS), 3), "elements", "static", 4.0, "2 (degree - 1) = 4"),
    "a layer that ends in an element": (elements(scene_of("entry", held(0.13), LAYERS)), "elements", "static", 5.0, "less one"),
    "layers that are passed": (elements(scene_of("hub", moving(1.0, 0.1, 0.11))), "elements", "static", 5.0, "less one"),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_expected(name):
    plant, over, analysis, order, said = CASES[name]
    found = theoretical_order(plant, over, analysis, (4, 8))
    assert said in " ".join(str(value) for value in vars(found).values())
    assert found.order == (None if order is None else pytest.approx(order))
