import numpy as np
import pytest

from fem_needle.closed_loop.repetitions import STREAM, scattered
from fem_needle.scene import Layer, Sinusoid, Table
from tests.consistency.closed_loop_scenes import loop_scene
from tests.consistency.scenes import moving

LAYERS = (
    Layer(start=0.0, end=0.05, foundation_modulus=5e3, damping=2.0),
    Layer(start=0.05, foundation_modulus=2e4),
)
SCENE = loop_scene(moving(0.01, 0.05, 0.1), layers=LAYERS).with_values(
    {"scatter.modulus": 0.2, "scatter.entry_angle": 0.03, "scatter.speed": 0.1, "run.seed": 7}
)


def draws(repetition):
    return np.random.default_rng([7, repetition, STREAM]).standard_normal(3)


def test_repetition_zero_is_the_scene():
    assert scattered(SCENE, 0) is SCENE


def test_without_scatter_all_are():
    plain = loop_scene()
    assert scattered(plain, 5) is plain


def test_what_is_drawn():
    """One factor for all that is elastic and viscous, a line through the entry point, a factor of the speed."""
    found, (modulus, angle, speed) = scattered(SCENE, 3), draws(3)
    factor = np.exp(0.2 * modulus)
    assert [layer.foundation_modulus for layer in found.tissue.layers] == pytest.approx([5e3 * factor, 2e4 * factor])
    assert [layer.damping for layer in found.tissue.layers] == pytest.approx([2.0 * factor, 0.0])
    assert found.support.hub_angle == pytest.approx(0.03 * angle)
    assert found.support.hub_deflection + 0.15 * found.support.hub_angle == pytest.approx(0.0, abs=1e-18)
    assert found.insertion.speed == pytest.approx(0.01 * np.exp(0.1 * speed))
    assert (found.insertion.first_depth, found.insertion.final_depth) == (0.05, 0.1)


def test_a_tip_spring_is_as_stiff_as_the_rest():
    tissue = {"kind": "tip-spring", "tip_stiffness": 10.0}
    scene = loop_scene(moving(0.01, 0.05, 0.1), layers=(), tissue=tissue).with_values({"scatter.modulus": 0.2, "run.seed": 7})
    assert scattered(scene, 3).tissue.tip_stiffness == pytest.approx(10.0 * np.exp(0.2 * draws(3)[0]))


def test_repetitions_differ_and_repeat():
    assert scattered(SCENE, 2) == scattered(SCENE, 2)
    assert scattered(SCENE, 2) != scattered(SCENE, 3)
    assert scattered(SCENE.with_value("run.seed", 8), 2) != scattered(SCENE, 2).with_value("run.seed", 8)


def test_one_scatter_more_leaves_the_others_draws():
    alone = scattered(SCENE.with_values({"scatter.modulus": 0.0, "scatter.entry_angle": 0.0}), 3)
    assert alone.insertion.speed == scattered(SCENE, 3).insertion.speed
    assert alone.tissue == SCENE.tissue and alone.support == SCENE.support


def test_tables_and_sinusoids_are_moved_and_scaled():
    swaying = SCENE.with_values({"support.hub_angle": {"mean": 0.01, "amplitude": 0.002, "frequency": 3.0}})
    swaying = swaying.with_value("support.hub_deflection", {"time": [0.0, 1.0], "value": [0.0, 1e-3]})
    speeds = {"time": [0.0, 1.0, 5.0], "value": [0.01, 0.02, 0.02]}
    swaying = swaying.with_values({"insertion.speed": speeds, "insertion.final_depth": None, "run.duration": 1.0})
    found, (_, angle, speed) = scattered(swaying, 3), draws(3)
    assert isinstance(found.support.hub_angle, Sinusoid) and isinstance(found.support.hub_deflection, Table)
    assert found.support.hub_angle.mean == pytest.approx(0.01 + 0.03 * angle)
    assert (found.support.hub_angle.amplitude, found.support.hub_angle.frequency) == (0.002, 3.0)
    assert list(found.support.hub_deflection.values) == pytest.approx([-0.15 * 0.03 * angle, 1e-3 - 0.15 * 0.03 * angle])
    factor = np.exp(0.1 * speed)
    assert list(found.insertion.speed.values) == pytest.approx([0.01 * factor, 0.02 * factor, 0.02 * factor])
