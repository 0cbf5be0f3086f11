"""Sample measurements that come with the package, one CSV file per experiment, and how each was made.

All are simulated, with seeded noise, and rounded as an instrument would: what they were made of is in `TRUTH`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.friction_experiment import NOISE, friction_run, with_noise
from fem_needle.identification.stiffness import eight_directions
from fem_needle.scene_file import load_scene

Array = NDArray[np.float64]

FOLDER = Path(__file__).parent / "samples"
SEED = 7
GRAVITY = 9.81  # m/s^2

# What the samples were made of, SI: 18 gauge tube; stiffness about that of the thesis' Table II at 1.1 N, without a curl.
TRUTH = {
    "friction": {"coulomb": 0.56, "viscous": 0.3, "mass": 2.032e-3},
    "stiffness": {"k_xx": 1260.0, "k_xz": -30.0, "k_zx": -30.0, "k_zz": 1010.0},
    "bending": {"bending_stiffness": 0.01572},
}


def sample_names() -> tuple[str, ...]:
    """Return the names of all sample files, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.csv")))


def sample_path(name: str) -> Path:
    """Return the file of a sample.

    Raises
    ------
    SceneError
        If there is none of that name.
    """
    if name not in sample_names():
        raise SceneError(f"sample: unknown (got {name!r}; allowed {', '.join(sample_names())})")
    return FOLDER / f"{name}.csv"


def made_sample(name: str) -> str:
    """Return the text of the sample "friction", "stiffness" or "bending", made anew."""
    return _MAKERS[name]()


def _friction() -> str:
    scene = load_scene("friction-ramp")
    measured = with_noise(friction_run(scene), NOISE, np.random.default_rng(SEED))
    columns = {"time [s]": measured["time"], "depth [mm]": 1e3 * measured["depth"], "push_force [N]": measured["push_force"]}
    return _csv(columns, (3, 3, 4))


def _stiffness() -> str:
    truth, random = TRUTH["stiffness"], np.random.default_rng(SEED)
    matrix = np.array(list(truth.values())).reshape(2, 2)
    forces = eight_directions(1.1, 3)
    moved = np.linalg.solve(matrix, forces.T).T + 3e-5 * random.standard_normal(forces.shape)
    columns = {
        "force_x [N]": forces[:, 0],
        "force_z [N]": forces[:, 1],
        "displacement_x [mm]": 1e3 * moved[:, 0],
        "displacement_z [mm]": 1e3 * moved[:, 1],
    }
    return _csv(columns, (4, 4, 3, 3))


def _bending() -> str:
    random = np.random.default_rng(SEED)
    lengths, masses = (grid.ravel() for grid in np.meshgrid([0.10, 0.12, 0.14, 0.16], [0.01, 0.02, 0.03]))
    deflections = masses * GRAVITY * lengths**3 / (3.0 * TRUTH["bending"]["bending_stiffness"])
    deflections = deflections * np.exp(0.02 * random.standard_normal(lengths.shape))
    columns = {"length [mm]": 1e3 * lengths, "mass [g]": 1e3 * masses, "tip_deflection [mm]": 1e3 * deflections}
    return _csv(columns, (0, 0, 2))


_MAKERS: Mapping[str, Callable[[], str]] = {"friction": _friction, "stiffness": _stiffness, "bending": _bending}


def _csv(columns: Mapping[str, Array], digits: tuple[int, ...]) -> str:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(f"{x + 0.0:.{n}f}" for x, n in zip(row, digits, strict=True)) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"
