"""Stations that are not on the needle."""

import numpy as np
import pytest

from fem_needle import SceneError, load_scene, run_scene, solve_static
from fem_needle.exact import exact_static
from fem_needle.limits import stations_on
from fem_needle.models import build_plant
from fem_needle.trajectory import Trajectory


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    scene = load_scene("thesis").with_values({"insertion.final_depth": 0.03, "numerics.elements": 2})
    run, folder = run_scene(scene), tmp_path_factory.mktemp("run")
    run.save(folder)
    rest = solve_static(build_plant(scene), depth=0.03)
    return {"run": run, "loaded run": Trajectory.load(folder), "rest": rest, "exact": exact_static(scene, 0.03)}


@pytest.mark.parametrize("name", ["run", "loaded run", "rest", "exact"])
@pytest.mark.parametrize(
    ("station", "said"),
    [
        (100.0, r"got 100 m; allowed 0, the hub, to 0\.2 m, the tip; 100 mm would be 0\.1"),
        (-1.0, "got -1 m"),
        (np.nan, "got nan"),
    ],
)
def test_a_station_beside_the_needle_is_refused(known, name, station, said):
    with pytest.raises(SceneError, match=said):
        known[name].deflection(np.array([0.1, station]))


@pytest.mark.parametrize("name", ["run", "loaded run", "rest", "exact"])
def test_the_ends_are_on_the_needle_even_by_rounding(known, name):
    ends = known[name].deflection(np.array([-1e-17, 0.2 * (1 + 1e-12)]))
    assert np.allclose(ends, known[name].deflection(np.array([0.0, 0.2])))


def test_stations_keep_their_shape():
    assert stations_on(0.1, 0.2).shape == ()
    assert stations_on([[0.1, 0.2]], 0.2).shape == (1, 2)
