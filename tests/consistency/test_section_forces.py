"""Moments and shear forces: closed forms on coarse meshes, free ends, and the balance with what a run says of its supports."""

import numpy as np
import pytest

from fem_needle import load_scene, run_scene
from fem_needle.closed_loop.steering import steer
from fem_needle.exact.statics import exact_static
from fem_needle.scene import Scene

FORCE = 0.25
GEL = {"start": 0.0, "foundation_modulus": 8e3}


def scene(**changes) -> Scene:
    data = {
        "needle": {"length": 0.2, "youngs_modulus": 200e9, "outer_diameter": 1.27e-3, "inner_diameter": 1e-3, "density": 8000.0},
        "support": {"kind": "hub"},
        "tissue": {"layers": [GEL]},
        "insertion": {"kind": "speed", "initial_depth": 0.05, "speed": 0.005, "final_depth": 0.12},
        "loads": [{"kind": "tip", "force": FORCE}],
        "numerics": {"output_step": 2.0},
    }
    return Scene.from_dict(data | changes)


def test_a_free_tip_has_no_moment_and_its_force_as_shear():
    for rest_line in ("straight", "cut-path"):
        run = run_scene(scene(tissue={"layers": [GEL], "rest_line": rest_line}))
        np.testing.assert_array_equal(run.bending_moment[:, -1], 0.0)
        np.testing.assert_allclose(run.shear_force[:, -1], -FORCE, rtol=1e-14)


@pytest.mark.parametrize("elements", [2, 6, 40])
@pytest.mark.parametrize("support", ["hub", "entry"])
def test_closed_forms(support, elements):
    """The moment is as good as the deflection on any mesh: two orders better than EI w'' is."""
    guides = [{"position": -0.03, "stiffness": "rigid"}] if support == "hub" else []
    loads = [{"kind": "tip", "force": FORCE}] + [{"kind": "lateral", "position": -0.01, "force": 0.4}] * (support == "hub")
    given = scene(support={"kind": support} | ({"guides": guides} if guides else {}), loads=loads)
    run = run_scene(given, elements=elements, analysis="static")
    allowed = {2: 2e-2, 6: 2e-4, 40: 2e-7}[elements]
    for row in (0, len(run.time) - 1):
        depth = float(run.depth[row])
        exact = exact_static(given, depth)
        places = run.arc_length[run.arc_length > (0.2 - depth + 1e-9 if support == "entry" else -1.0)]
        # At a point force the shear has two values.
        clear = [y for y in (-0.03, -0.01) if support == "hub"]
        places = places[np.all(np.abs(places[:, None] - (0.2 - depth) - np.array([clear])) > 1e-9, axis=1)] if clear else places
        here = np.isin(run.arc_length, places)
        for found, right in ((run.bending_moment, exact.bending_moment), (run.shear_force, exact.shear_force)):
            expected = right(places)
            assert np.max(np.abs(found[row][here] - expected)) < allowed * np.max(np.abs(expected))


def cut_path(name: str) -> Scene:
    return load_scene(name).with_values({"tissue.rest_line": "cut-path", "loads.0.bevel_coefficient": 1e-6})


@pytest.mark.parametrize(
    ("given", "least"),
    [
        (load_scene("three-layers"), 1e-10),
        (cut_path("three-layers"), 1e-7),
        (load_scene("brachytherapy"), 1e-10),
        (load_scene("liver-push"), 1e-10),
        (load_scene("release"), 1e-8),
        (load_scene("three-layers").with_values({"model.kind": "assumed-modes", "model.modes": 3}), 1e-10),
    ],
)
def test_what_acts_beyond_the_hub_is_what_the_hub_takes(given, least):
    """Loads, guides, tissue, viscosity and inertia, summed from the tip, end at the force and moment of the clamp."""
    run = run_scene(given)
    rows = slice(1, None)  # at the start the rates are those of the scene, not of a step
    for along, clamp in ((run.shear_force[:, 0], run.hub_force), (-run.bending_moment[:, 0], run.hub_moment)):
        assert np.max(np.abs(along - clamp)[rows]) < least * np.max(np.abs(clamp))


@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("model", ["fem", "assumed-modes"])
def test_the_inertia_of_a_growing_needle(kinematics, model):
    """Just below the surface the section forces are those of the clamp there, at 5 m/s."""
    given = load_scene("bench-m").with_values(
        {"insertion.speed": 5.0, "model.kinematics": kinematics, "model.kind": model, "numerics.tolerance": 1e-4}
    )
    run = run_scene(given.with_values({"numerics.output_step": given.duration / 5, "numerics.output_points": 2001}))
    for row in range(1, len(run.time)):
        first = int(np.argmax(run.arc_length > 0.2 - run.depth[row]))
        outside = run.arc_length[first] - (0.2 - run.depth[row])
        clamp = run.hub_moment[row] - run.hub_force[row] * outside  # carried to the first station
        assert -run.bending_moment[row, first] == pytest.approx(clamp, abs=2e-3 * np.max(np.abs(run.hub_moment)))
        assert run.shear_force[row, first] == pytest.approx(run.hub_force[row], abs=5e-3 * np.max(np.abs(run.hub_force)))


def test_lateral_and_axial_forces_of_a_result_balance():
    run = run_scene(load_scene("brachytherapy").with_value("tissue.layers.0.cutting_force", 0.5))
    assert run.summary["analysis"] == "quasi-static"
    lateral = run.tip_force + run.hub_force + run.tissue_force + run.guide_force.sum(axis=1) + run.lateral_force.sum(axis=1)
    assert np.max(np.abs(lateral[1:])) < 1e-12 * np.max(np.abs(run.hub_force))
    axial = run.push_force - run.friction_force - run.cutting_force + run.axial_force
    assert np.max(np.abs(axial[1:])) < 1e-9 * np.max(run.push_force)
    assert np.max(run.cutting_force) == pytest.approx(0.5)


def test_stress_is_that_of_the_outer_fiber():
    run = run_scene(scene())
    inertia = np.pi / 64 * (1.27e-3**4 - 1e-3**4)
    np.testing.assert_allclose(run.bending_stress, run.bending_moment * 0.635e-3 / inertia, rtol=1e-12)
    bare = {"length": 0.2, "bending_stiffness": 0.0157, "mass_per_length": 0.004}
    assert run_scene(scene(needle=bare)).bending_stress is None


def test_a_loop_says_what_it_commanded():
    run = steer(load_scene("steering"))
    commanded = run.signals["command_lateral_force"]
    known = np.isfinite(commanded)
    assert np.any(commanded[known] != 0.0)
    np.testing.assert_allclose(run.lateral_force[known, 0], commanded[known], rtol=0, atol=1e-12)
