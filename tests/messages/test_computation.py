"""Messages about computations that fail, which no other test meets; where only a broken machine would tell, it is broken here."""

from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import numpy as np
import pytest

from fem_needle import (
    ComputationError,
    FiniteElementNeedle,
    NeedleError,
    SceneError,
    Trajectory,
    load_scene,
    mesh_file,
    refined_run,
    run_scene,
    simulate_many,
    study_files,
)
from fem_needle.banded import SingularMatrixError
from fem_needle.batch import many
from fem_needle.benchmark import goal_measurements
from fem_needle.closed_loop import repeating
from fem_needle.closed_loop.kernel import LoopEngine
from fem_needle.closed_loop.simulation import Simulation
from fem_needle.comparison.runs import shape_at
from fem_needle.dynamics.names import FAILED
from fem_needle.identification import sample_tips
from fem_needle.scene import Insertion, LateralLoad, TipLoad
from fem_needle.statics import solve_static
from reduced_model.identification import bending
from tests.consistency.scenes import BUZZ, held, moving, scene_of

GLIDING = scene_of("entry", moving(0.5, 0.04, 0.05), loads=(TipLoad(force=BUZZ),), duration=0.02)
PUSHED = scene_of("hub", Insertion(kind="force", initial_depth=0.1, push_force=1.0), duration=0.01)


def failing(error):
    def fail(*given, **named):
        raise error

    return fail


def test_a_run_of_many_that_fails(monkeypatch):
    monkeypatch.setattr(many, "simulate", failing(ComputationError("time 0 s, depth 0.04 m failed: not finite")))
    with pytest.raises(ComputationError, match=r"run 0: time 0 s, depth 0\.04 m failed: not finite"):
        simulate_many(GLIDING.with_value("numerics.elements", 2), {"needle.bending_stiffness": [1.0, 2.0]}, time_step=1e-3)


def test_a_compiled_loop_without_a_finite_answer_says_where(monkeypatch):
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.1)]
    plant = FiniteElementNeedle(scene_of("hub", moving(0.5, 0.04, 0.05), loads=loads, duration=0.02), elements=2)
    loop = Simulation(plant, time_step=1e-3, analysis="dynamic", output_step=0.01)
    monkeypatch.setattr(LoopEngine, "go", lambda *given: FAILED)
    with pytest.raises(ComputationError, match=r"time 0 s, depth 0\.04 m failed: the deflection is not finite"):
        loop.step({"lateral_force": 0.2}, 5e-3)


def test_equilibria_without_a_solution(monkeypatch):
    plant = FiniteElementNeedle(scene_of("entry", held(0.1)), elements=2)
    monkeypatch.setattr("fem_needle.statics._solve_supported", failing(SingularMatrixError("zero pivot")))
    with pytest.raises(ComputationError, match=r"no static solution at time 0 s, depth 0\.1 m: zero pivot; check stiffnesses"):
        solve_static(plant, depth=0.1)


def test_a_process_that_dies(monkeypatch):
    class Dead:
        def __init__(self, *given, **named):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *given):
            return False

        submit = failing(BrokenProcessPool())

    monkeypatch.setattr(repeating, "ProcessPoolExecutor", Dead)
    with pytest.raises(ComputationError, match="a process ended without an answer: it was killed, or memory was short"):
        repeating.repeat(load_scene("steering"), 3, processes=2)


def test_shapes_of_a_loaded_run_have_no_model(tmp_path):
    run = run_scene(scene_of("entry", held(0.1), duration=0.01), elements=2, analysis="static", output_step=5e-3)
    with pytest.raises(ComputationError, match="a run that was loaded from files has no model"):
        shape_at(Trajectory.load(run.save(tmp_path / "run")), 0, np.array([0.2]))


def test_rounding_that_outgrows_a_tolerance():
    """Of a run that would need more and more steps: the chosen mesh's round-off, as a random walk, is beyond what is allowed."""
    job = SimpleNamespace(chosen=SimpleNamespace(round_off=1e-9))
    search = SimpleNamespace(job=job, allowed=1e-7, tolerance=2e-7)
    with pytest.raises(ComputationError, match=r"tolerance = 2e-07 needs about 1e\+06 steps, .* ask for 2\.0e-06 or more"):
        refined_run._refuse_rounding(search, 1e6)
    refined_run._refuse_rounding(search, 1e3)


def test_a_study_that_cannot_be_written(tmp_path, monkeypatch, command_line):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study_files, "write_atomically", failing(OSError(28, "No space left on device")))
    status, _, err = command_line("converge", "bench-s", "--out", "study")
    assert status == 1
    assert "study: cannot be written: [Errno 28] No space left on device" in err


def test_a_mesh_of_bad_lines(monkeypatch):
    points = np.zeros((3, 3))
    with pytest.raises(SceneError, match="holds lines that do not have two nodes each"):
        mesh_file._check_kinds(points, ["line"], np.zeros((2, 3), dtype=int))
    monkeypatch.setattr(mesh_file, "MAXIMUM_ELEMENTS", 4)
    with pytest.raises(SceneError, match=r"holds 5 lines \(allowed up to 4\)"):
        mesh_file._check_kinds(points, ["line"], np.zeros((5, 2), dtype=int))


def test_a_mesh_file_that_the_system_refuses():
    with pytest.raises(SceneError, match=r"cannot be read: .*(too long|null)"):
        mesh_file.read_mesh("m" * 5000 + ".vtu")


def test_a_sample_without_equilibria(monkeypatch):
    monkeypatch.setattr(sample_tips, "static_problem", lambda *given: None)
    with pytest.raises(ComputationError, match="sample: its equilibria are not known"):
        sample_tips.made_tips()


def test_a_power_law_of_one_load():
    with pytest.raises(ComputationError, match="a power law needs several loads and lengths"):
        bending._power_law(SimpleNamespace(power_law=None))


# Goals of the benchmark that cannot be measured.


def test_no_random_scene_gave_an_answer(monkeypatch):
    example = SimpleNamespace(scene=None, tips=np.ones(3))
    monkeypatch.setattr(goal_measurements, "random_scene", lambda seed: example)
    monkeypatch.setattr(goal_measurements, "whole_run", lambda scene: failing(NeedleError("too long")))
    with pytest.raises(NeedleError, match="none of 2 scenes gave an answer in time"):
        goal_measurements.hit_rate.__wrapped__(2)


def test_goals_that_need_rows_that_are_not_there():
    with pytest.raises(NeedleError, match="no fixed setting keeps a tolerance that was run"):
        goal_measurements.cost_of_tolerance(())


def test_a_command_that_fails_while_it_is_timed():
    with pytest.raises(NeedleError, match=r"(?s)the process failed: .*No such option"):
        goal_measurements.time_of_command("--no-such-option")
