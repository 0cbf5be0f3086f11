"""Parts of a run: vibrations are followed where they matter, passed over elsewhere, and need no steps in a last hold."""

from itertools import pairwise

import numpy as np
import pytest

from fem_needle import load_scene, run_scene
from fem_needle.dynamics.parts import COSINES, FOLLOWED, PASSED_OVER
from tests.references.entry import entry_motion

TOLERANCE = 1e-3
SHARE = 0.3  # of the difference of two truths: what the finer one may miss
STRUCK = {"time": [0.0, 0.5, 0.501], "value": [0.1, 0.1, 0.15]}
KNOCKED = {"time": [0.0, 0.3, 0.3005, 0.32, 0.3205], "value": [0.1, 0.1, 0.15, 0.15, 0.1]}
IN_AND_HELD = {"kind": "speed", "speed": 0.05, "initial_depth": 0.02, "final_depth": 0.06}


def scene(force, damping, duration, **values):
    changed = {"insertion": IN_AND_HELD, "tissue.layers.0.damping": damping, "loads.0.force": force, "run.duration": duration}
    return load_scene("thesis").with_values(changed | {"numerics.tolerance": TOLERANCE} | values)


CASES = {
    "struck and held, undamped": (scene(STRUCK, 0.0, 0.6, **{"insertion.final_depth": 0.03}), [PASSED_OVER, FOLLOWED, COSINES]),
    "stopped and held, undamped": (
        scene(0.1, 0.0, 0.3, **{"insertion.speed": 0.2, "numerics.tolerance": 1e-4}), [FOLLOWED, COSINES],
    ),
    "knocked, damped": (scene(KNOCKED, 5.0, 0.6, **{"insertion.speed": 0.01}), [PASSED_OVER, FOLLOWED, PASSED_OVER]),
}  # fmt: skip


def true_tips(tested, times):
    """Return the tips of a spectral solver, and their own uncertainty relative to the largest."""
    coarse, fine = (
        entry_motion(tested, float(times[-1]), times, degree=degree, steps_per_second=steps).tip_deflection
        for degree, steps in ((9, 15000), (12, 30000))
    )
    return fine, SHARE * np.max(np.abs(coarse - fine)) / np.max(np.abs(fine))


@pytest.mark.parametrize("name", CASES)
def test_parts_give_the_tip_of_an_independent_solver_and_close_the_ledger(name):
    tested, hows = CASES[name]
    run = run_scene(tested)
    truth, uncertainty = true_tips(tested, run.time)
    error = np.max(np.abs(run.tip_deflection - truth)) / np.max(np.abs(truth))
    assert [part["how"] for part in run.summary["parts"]] == hows
    assert uncertainty < 0.2 * tested.numerics.tolerance
    assert error <= tested.numerics.tolerance + uncertainty
    assert error <= run.summary["error_estimate"] + uncertainty
    assert run.summary["relative_energy_residual"] < 1e-4


def test_parts_join_without_gaps_and_say_what_inertia_does():
    run = run_scene(CASES["knocked, damped"][0])
    parts = run.summary["parts"]
    assert parts[0]["begin"] == 0.0
    assert parts[-1]["end"] == run.time[-1]
    assert all(before["end"] == after["begin"] for before, after in pairwise(parts))
    assert parts[1]["begin"] == pytest.approx(0.3)
    assert "moves the tip by up to" in parts[1]["reason"]


def test_steps_that_a_part_does_not_need_are_not_taken():
    late, early = (run_scene(scene({"time": [0.0, at, at + 1e-3], "value": [0.1, 0.1, 0.15]}, 0.0, 2.0)) for at in (1.8, 0.85))
    assert early.summary["steps"] < 1.5 * late.summary["steps"]  # the hold behind it costs none


def test_a_given_step_is_taken_throughout():
    run = run_scene(CASES["struck and held, undamped"][0], time_step=1e-3, analysis="dynamic")
    assert [part["how"] for part in run.summary["parts"]] == [FOLLOWED]
    assert run.summary["steps"] >= 600
