"""Linear models and gains about a cut path: against the runs that cut it, and against what they do when they are pushed."""

import numpy as np
import pytest

from fem_needle import linearize, load_scene, run_scene
from fem_needle.analysis.depth_gains import depth_gains, tip_gains
from fem_needle.control.model_response import model_response
from fem_needle.linear.slow_cut import slow_cut
from fem_needle.models import build_plant

CUT = {"tissue.rest_line": "cut-path", "numerics.elements": 16, "numerics.analysis": "quasi-static", "numerics.tolerance": 1e-5}


def bevel(name, **changes):
    scene = load_scene(name).with_values(CUT | changes)
    for index in range(len(scene.tissue.layers)):
        scene = scene.with_value(f"tissue.layers.{index}.damping", 0.0)
    return scene


LAYERS = bevel("three-layers", **{"loads.0.bevel_coefficient": 1e-6, "loads.1.force": 0.0, "numerics.output_step": 0.1})
GEL = bevel("misra-2010")


MODES = GEL.with_value("model.kind", "assumed-modes")


@pytest.fixture(scope="module", params=[GEL, LAYERS, MODES], ids=["gel", "layers", "modes"])
def cut(request):
    scene = request.param
    return build_plant(scene), run_scene(scene)


def test_the_slow_path_is_that_of_the_run(cut):
    plant, run = cut
    last = len(run.time) - 1
    path, own = slow_cut(plant, float(run.depth[last])), run.samples.path_at(last)
    places = np.linspace(0.0, run.depth[last], 300)
    assert np.max(np.abs(path.value(places) - own.value(places))) < 2e-5 * np.max(np.abs(run.tip_deflection))


def test_operating_points_and_pushes_are_those_of_the_run(cut):
    plant, run = cut
    for row in (len(run.time) // 2, len(run.time) - 20):
        depth = float(run.depth[row])
        for path in (None, run.samples.path_at(row)):
            point = linearize(plant, depth=depth, path=path).operating_point
            assert point.tip_deflection == pytest.approx(run.tip_deflection[row], rel=5e-5)
            assert point.push_force == pytest.approx(-run.axial_force[row], rel=2e-4, abs=1e-7)


def test_the_gain_of_depth_is_the_slope_of_the_run(cut):
    plant, run = cut
    row = len(run.time) - 20
    slope = np.gradient(run.tip_deflection, run.depth, edge_order=2)[row]
    assert tip_gains(plant, float(run.depth[row]))[-1] == pytest.approx(slope, rel=2e-3)


def test_a_push_of_the_finger_after_the_insertion_moves_the_tip_by_the_gain():
    """The path that is there stays where it is: the needle turns in it as in springs that rest on a straight line."""
    end = (GEL.insertion.final_depth - GEL.insertion.initial_depth) / GEL.insertion.speed
    finger = {"kind": "lateral", "position": -0.005, "force": {"time": [0.0, end + 1.0, end + 2.0], "value": [0.0, 0.0, 0.02]}}
    scene = GEL.with_values({"loads": [*GEL.to_dict()["loads"], finger], "run.duration": end + 2.0})
    run = run_scene(scene)
    moved = run.tip_deflection[-1] - np.interp(end + 0.5, run.time, run.tip_deflection)
    gain = tip_gains(build_plant(scene), float(run.depth[-1]))[0]
    assert moved / 0.02 == pytest.approx(gain, rel=1e-3)


def test_small_vibrations_about_a_path_are_those_about_a_straight_line():
    plant, straight = (build_plant(GEL.with_value("tissue.rest_line", line)) for line in ("cut-path", "straight"))
    depth = 0.1
    one, other = (linearize(each, depth=depth, axial="held") for each in (plant, straight))
    np.testing.assert_allclose(one.natural_frequencies, other.natural_frequencies, rtol=1e-9)
    assert abs(one.operating_point.tip_deflection) > 3 * abs(other.operating_point.tip_deflection)


def test_the_axial_row_is_the_rate_of_the_axial_force():
    """Along the insertion A changes as the frozen model says while the path goes on under the tip."""
    plant = build_plant(GEL)
    depth, step = 0.1, 1e-4
    path = slow_cut(plant, depth + step)
    model = linearize(plant, depth=depth, path=path).second_order
    rest = [linearize(plant, depth=place, path=path).operating_point for place in (depth - step, depth + step)]
    moved = (rest[1].coordinates - rest[0].coordinates)[plant.prescribed :] / (2 * step)
    free = -np.linalg.solve(model.stiffness[1:, 1:], model.stiffness[1:, 0])
    np.testing.assert_allclose(free, moved, atol=1e-5 * np.max(np.abs(moved)))
    pushed = (rest[1].push_force - rest[0].push_force) / (2 * step)
    assert float(model.stiffness[0] @ np.concatenate([[1.0], free])) == pytest.approx(pushed, rel=1e-5)


def test_tissue_is_straight_over_the_first_depth_also_where_the_needle_is_drawn_back_first():
    back = {"kind": "profile", "depth": {"time": [0.0, 4.0, 20.0], "value": [0.06, 0.03, 0.11]}}
    scene = GEL.with_values({"insertion": back, "run.duration": 20.0})
    run, path = run_scene(scene), slow_cut(build_plant(scene), 0.11)
    own = run.samples.path_at(len(run.time) - 1)
    assert path.edges[0] == own.edges[0] == 0.06
    places = np.linspace(0.0, 0.11, 200)
    assert np.max(np.abs(path.value(places) - own.value(places))) < 2e-5 * np.max(np.abs(run.tip_deflection))


def test_what_a_controller_knows_of_the_tip_has_the_path():
    plant = build_plant(LAYERS)
    response = model_response(plant, "lateral_force", depths=(0.02, 0.1))
    run = run_scene(LAYERS)
    row = int(np.argmin(np.abs(run.depth - 0.08)))
    depth = float(run.depth[row])
    assert response.output(depth, 0.0) == pytest.approx(run.tip_deflection[row], rel=2e-4)
    assert response.gain(depth) == pytest.approx(tip_gains(plant, depth)[0], rel=1e-3)


def test_gains_over_the_depth_need_one_path():
    plant = build_plant(GEL)
    depths = np.array([0.06, 0.09, 0.12])
    np.testing.assert_allclose(depth_gains(plant, depths).gains, [tip_gains(plant, depth) for depth in depths], rtol=1e-3)
