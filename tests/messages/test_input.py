"""Messages about wrong input that no other test meets: what is said names the value and what is allowed."""

import meshio
import numpy as np
import pytest

from fem_needle import (
    FiniteElementNeedle,
    SceneError,
    Simulation,
    load_scene,
    mesh_reader,
    parse_scene,
    simulate,
    simulate_many,
    steer,
)
from fem_needle.closed_loop.repeating import repeat
from fem_needle.errors import SuspiciousValueWarning
from fem_needle.figures import shapes
from fem_needle.identification.fit import identify
from fem_needle.identification.least_squares import weighted_least_squares
from fem_needle.identification.measurements import Measurements
from fem_needle.identification.stiffness import identify_stiffness
from fem_needle.mesh_file import checked_positions
from fem_needle.scene import Insertion, TipLoad
from fem_needle.scene.table_file import read_text
from fem_needle.scene_file import MOST_KEYS
from reduced_model import mode_basis
from tests.consistency.scenes import GEL, held, moving, scene_of

GLIDING = scene_of("entry", moving(0.5, 0.04, 0.14), duration=None)
PUSHED = scene_of("hub", Insertion(kind="force", initial_depth=0.1, push_force=1.0), duration=0.01)
STILL = scene_of("entry", held(0.1), duration=0.01)
TIMES = np.array([0.0, 0.1, 5.0])


def stepped(duration):
    return Simulation(FiniteElementNeedle(STILL, elements=2), time_step=1e-3).step(duration=duration)


def stepped_beyond_the_end():
    """A push that cannot move the needle: it is stuck at once, and there is no further step."""
    scene = PUSHED.with_values({"friction.coulomb": 5.0})
    loop = Simulation(FiniteElementNeedle(scene, elements=2), time_step=1e-3)
    for _ in range(10):
        loop.step()


def fitted(measured, **options):
    scene = GLIDING.with_value("numerics.elements", 2)
    return identify(scene, ["tissue.layers.0.foundation_modulus"], Measurements(measured), **options)


def pushes_and_tips():
    return {"time": TIMES[:2], "push_force": np.ones(2), "tip_deflection": np.ones(2)}


CASES = {
    "parameters of different lengths": (
        lambda: simulate_many(GLIDING, {"tissue.layers.0.cutting_force": [1.0, 2.0], "friction.coulomb": [1.0]}),
        r"parameters: as many values each \(got \[1, 2\]; allowed one number of them\)",
    ),
    "some runs lead away": (
        lambda: simulate_many(GLIDING, {"insertion.initial_depth": [0.05, 0.15]}),
        r"insertion\.final_depth: is not where the speed leads \(got 0\.14; allowed",
    ),
    "some runs go nowhere": (
        lambda: simulate_many(GLIDING, {"insertion.speed": [0.5, -0.5]}),
        r"insertion\.final_depth: is not where the speed leads \(got 0\.14; allowed",
    ),
    "no repetitions": (lambda: repeat(load_scene("steering"), 0), r"repetitions: too few \(got 0; allowed 1 or more\)"),
    "no duration": (lambda: stepped(0.0), r"duration: out of range \(got 0\.0; allowed above 0 s\)"),
    "endless duration": (lambda: stepped(np.inf), r"duration: out of range \(got inf"),
    "a run that has ended": (stepped_beyond_the_end, r"the run has ended at time .* s, depth 0\.1 m: stuck"),
    "a skew covariance": (
        lambda: weighted_least_squares(np.eye(3, 2) + 1.0, np.ones(3), ("a", "b"), variances=np.eye(3) + np.eye(3, k=1) * 0.3),
        "variances: a covariance matrix must be symmetric",
    ),
    "deviations of one column": (
        lambda: fitted(pushes_and_tips(), deviations={"push_force": 1.0}),
        r"deviations: of every column or of none \(missing tip_deflection\)",
    ),
    "forces and deflections": (lambda: fitted(pushes_and_tips()), "deviations: must be given where forces and deflections"),
    "times outside the run": (
        lambda: fitted({"time": TIMES, "push_force": np.ones(3)}),
        r"times outside the run \(got 0 to 5 s; allowed 0 to 0\.2 s, the run's\)",
    ),
    "a compliance of nothing": (
        lambda: identify_stiffness(np.zeros((8, 2)), EIGHT, noise_in="displacement"),
        "the compliance matrix cannot be inverted: some force moves nothing",
    ),
    "positions that are words": (lambda: checked_positions(["a", "b"]), "is not a list of numbers"),
    "positions that are not finite": (lambda: checked_positions([0.0, np.nan, 0.2]), "holds a position that is not finite"),
    "an empty scene": (lambda: parse_scene(" \n"), "scene: is empty"),
    "shapes at no depth": (
        lambda: shapes(simulate(FiniteElementNeedle(STILL, elements=2), time_step=1e-3), []),
        "depths: got none; allowed one or more, m",
    ),
    "a scene of too many tables": (
        lambda: parse_scene("[[a]]\n" * (MOST_KEYS // 2 + 1)),
        rf"scene: has {2 * (MOST_KEYS // 2 + 1)} tables and lists \(allowed up to {MOST_KEYS}\)",
    ),
    "a basis of no name": (
        lambda: mode_basis(FiniteElementNeedle(STILL, elements=2), 2, "half-length"),
        "basis: got 'half-length'; allowed 'full-length', 'inserted-length'",
    ),
}
EIGHT = np.column_stack((np.cos(np.arange(8.0)), np.sin(np.arange(8.0))))


@pytest.mark.parametrize("name", CASES)
def test_wrong_input_is_told(name):
    act, said = CASES[name]
    with pytest.raises(SceneError, match=said):
        act()


def test_a_file_that_cannot_be_read_says_why(tmp_path, monkeypatch):
    path = tmp_path / "speed.csv"
    path.write_text("time [s],speed [m/s]\n")

    def refuse(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(path), "read_bytes", refuse)
    with pytest.raises(ValueError, match=r"'speed\.csv' cannot be read: Permission denied"):
        read_text(path)


def test_a_loop_passes_on_what_its_model_warns_of():
    """Static corrections in tissue so stiff that they lose their digits."""
    stiff = (GEL[0].model_copy(update={"foundation_modulus": 1e8}),)
    scene = scene_of("entry", held(0.1), stiff, [TipLoad(force=0.1)], duration=1e-3).with_values(
        {
            "model": {"kind": "assumed-modes", "modes": 2, "static_corrections": True},
            "numerics.time_step": 5e-4,
            "numerics.output_step": 1e-3,
            "numerics.analysis": "static",
        }
    )
    with pytest.warns(SuspiciousValueWarning, match="lose their digits"):
        steer(scene)


def test_a_mesh_of_too_many_points(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_reader, "MOST_POINTS", 2)
    path = tmp_path / "three.vtu"
    meshio.Mesh(np.eye(3), [("line", [[0, 1], [1, 2]])]).write(path)
    with pytest.raises(ValueError, match=r"it holds 3 points \(allowed up to 2\)"):
        mesh_reader.contents(path)
