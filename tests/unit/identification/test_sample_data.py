"""The sample files: what is shipped is what the makers make, and gives back what it was made of."""

import numpy as np
import pytest

from fem_needle import SceneError
from fem_needle.identification import (
    identify_bending,
    identify_friction,
    identify_stiffness,
    read_measurements,
    sample_names,
    sample_path,
)
from fem_needle.identification.sample_data import GRAVITY, TRUTH, made_sample


@pytest.mark.parametrize("name", TRUTH)
def test_a_sample_is_made_anew_as_it_is_shipped(name, tmp_path):
    path = tmp_path / "made.csv"
    path.write_text(made_sample(name), encoding="utf-8")
    made, shipped = read_measurements(path), read_measurements(sample_path(name))
    assert made.names == shipped.names
    assert path.read_text(encoding="utf-8").splitlines()[0] == sample_path(name).read_text(encoding="utf-8").splitlines()[0]
    for column in made.names:  # a last digit may fall on the other side where arithmetic rounds otherwise
        assert made[column] == pytest.approx(shipped[column], abs=1.1e-4), column
    assert sum(np.count_nonzero(made[column] != shipped[column]) for column in made.names) <= 0.01 * made.size


def test_friction():
    found, truth = read_measurements(sample_path("friction"), {"depth": "m", "push_force": "N"}), TRUTH["friction"]
    fit = identify_friction(found["time"], found["depth"], found["push_force"], mass=truth["mass"])
    for name in ("coulomb", "viscous"):
        low, high = fit.fit.estimate(name).interval(0.999)
        assert low < truth[name] < high, name
    assert fit.coulomb.standard_error < 0.01


def test_stiffness():
    found = read_measurements(sample_path("stiffness"))
    moved, forces = (np.column_stack([found[f"{what}_{axis}"] for axis in "xz"]) for what in ("displacement", "force"))
    fit = identify_stiffness(moved, forces, noise_in="displacement")
    for name, value in TRUTH["stiffness"].items():
        low, high = fit.combination({name: 1.0}).interval(0.999)
        assert low < value < high, name
    assert fit.curl.interval(0.999)[0] < 0.0 < fit.curl.interval(0.999)[1]


def test_bending():
    found = read_measurements(sample_path("bending"), {"length": "m", "mass": "kg", "tip_deflection": "m"})
    fit = identify_bending(found["length"], GRAVITY * found["mass"], found["tip_deflection"])
    low, high = fit.stiffness.interval(0.999)
    assert low < TRUTH["bending"]["bending_stiffness"] < high
    assert fit.contradictions(0.999) == ()


def test_names():
    assert set(TRUTH) <= set(sample_names())
    with pytest.raises(SceneError, match=r"allowed .*bending"):
        sample_path("torsion")
