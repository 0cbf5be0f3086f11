import numpy as np
import pytest

from fem_needle import ComputationError, FiniteElementNeedle, load_scene, run_scene, simulate, trajectory
from fem_needle.dynamics.engine import DYNAMIC, Engine
from fem_needle.dynamics.grid import TimeGrid, output_times, time_grid
from fem_needle.dynamics.names import FAILED
from fem_needle.scene import Friction, Guide, Insertion, Layer, Sinusoid, Table, TipLoad
from tests.consistency.scenes import GEL, LAYERS, held, moving, profile, scene_of

SHORT = scene_of("entry", moving(0.5, 0.04, 0.09), LAYERS, duration=0.1)


def plant(scene=SHORT, elements=4):
    return FiniteElementNeedle(scene, elements=elements)


class Watcher:
    """Remembers what it was told."""

    def __init__(self, stop_at=None):
        self.chosen, self.fractions, self.times, self.stop_at = [], [], [], stop_at

    def begin(self, plant, choice):
        self.chosen.append(choice)

    def progress(self, fraction):
        self.fractions.append(fraction)
        if self.stop_at is not None and fraction >= self.stop_at:
            raise KeyboardInterrupt

    def samples(self, block):
        self.times.extend(block.time.tolist())


@pytest.mark.parametrize(
    ("duration", "step", "expected"),
    [(1.0, 0.25, [0, 0.25, 0.5, 0.75, 1]), (1.0, 0.4, [0, 0.4, 0.8, 1]), (0.3, 0.1, [0, 0.1, 0.2, 0.3]), (1.0, 1.0, [0, 1])],
)
def test_output_times(duration, step, expected):
    times = output_times(duration, step)
    assert times == pytest.approx(expected)
    assert times[-1] == duration


def test_steps_land_on_outputs_and_kinks():
    grid = TimeGrid(outputs=(0.0, 0.5, 1.0), landings=(0.3,), time_step=0.1)
    assert list(grid.intervals()) == [(0.0, 0.3, 3), (0.3, 0.5, 2), (0.5, 1.0, 5)]
    assert grid.steps == 10


def test_an_output_beside_a_landing_is_moved_onto_it():
    """50 mm is reached at 0.02 s up to round-off; no step of 1e-17 s."""
    grid = time_grid(plant(), 1e-3, 0.01)
    lengths = [end - start for start, end, _ in grid.intervals()]
    assert min(lengths) > 1e-6


@pytest.mark.parametrize("analysis", ["static", "quasi-static", "dynamic"])
def test_samples_lie_at_the_output_times(analysis):
    run = simulate(plant(), time_step=1e-3, analysis=analysis, output_step=0.03)
    assert run.time == pytest.approx([0.0, 0.03, 0.06, 0.09, 0.1])
    assert run.depth == pytest.approx(0.04 + 0.5 * run.time)
    assert run.speed[:-1] == pytest.approx(np.full(4, 0.5))
    assert run.summary["stop_reason"] == "duration"


def test_a_run_is_repeated_to_the_last_digit():
    one, other = (simulate(plant(), time_step=1e-3, analysis="dynamic", output_step=0.05) for _ in range(2))
    for name in ("tip_deflection", "boundary_energy", "push_force"):
        assert np.array_equal(getattr(one, name), getattr(other, name))


def test_a_plant_remembers_nothing():
    """A run does not depend on what the plant did before."""
    used = plant()
    simulate(used, time_step=1e-3, analysis="dynamic", output_step=0.05)
    again = simulate(used, time_step=1e-3, analysis="static", output_step=0.05)
    fresh = simulate(plant(), time_step=1e-3, analysis="static", output_step=0.05)
    assert np.array_equal(again.tip_deflection, fresh.tip_deflection)


def test_observer():
    watcher = Watcher()
    run = simulate(plant(), time_step=1e-3, analysis="static", output_step=0.02, observer=watcher)
    assert watcher.times == run.time.tolist()
    assert watcher.fractions == sorted(watcher.fractions)
    assert watcher.fractions[-1] == 1.0
    assert watcher.chosen[0]["analysis"] == "static"
    assert watcher.chosen[0]["output_times"] == tuple(run.time)


@pytest.mark.parametrize("time_step", [1e-3, "auto"])
def test_an_interrupt_keeps_what_was_computed(time_step, monkeypatch):
    monkeypatch.setattr("fem_needle.dynamics.engine.NUMBERS_OF_A_CALL", 200)  # an interrupt waits for the end of a call
    watcher = Watcher(stop_at=0.5)
    run = simulate(plant(), time_step=time_step, analysis="dynamic", output_step=0.01, observer=watcher)
    assert run.summary["stop_reason"] == "interrupted"
    assert 3 <= len(run.time) < 11
    assert np.all(np.isfinite(run.tip_deflection))


def needle_that_fails(after=0.05):
    """A needle under a force that no number holds from some time [s] on."""
    force = Table(time=[0.0, after, after + 1e-6], value=[0.1, 0.1, 1.7e308])
    return plant(plant().scene.model_copy(update={"loads": (TipLoad(force=force), TipLoad(force=force))}))


SIX = pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04, 0.05])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("analysis", ["static", "dynamic"])
def test_a_failure_says_where_and_keeps_what_was_computed(analysis):
    watcher = Watcher()
    with pytest.raises(ComputationError, match=r"time 0\.05.* s, depth 0\.065.* m failed: .* not finite") as caught:
        simulate(needle_that_fails(), time_step=1e-2, analysis=analysis, output_step=0.01, observer=watcher)
    assert caught.value.partial.time == SIX
    assert watcher.times == SIX


def fail_after(monkeypatch, after):
    """Let steps with inertia fail that end after some time [s], but not those of pilots, whose method is Radau's."""
    advance = Engine.advance

    def failing(self, intervals, **named):
        if self.kind != DYNAMIC or self.method.nodes[-1] == 1.0 or intervals[-1, 1] <= after:
            return advance(self, intervals, **named)
        return FAILED, advance(self, intervals[intervals[:, 1] <= after], **named)[1]

    monkeypatch.setattr(Engine, "advance", failing)


def test_a_refined_run_that_fails_shows_what_it_has(monkeypatch):
    fail_after(monkeypatch, 0.05)
    watcher = Watcher()
    with pytest.raises(ComputationError, match="not finite") as caught:
        simulate(plant(), time_step="auto", analysis="dynamic", output_step=0.01, observer=watcher)
    assert len(watcher.times) > 1 and set(watcher.times) <= set(caught.value.partial.time)
    assert watcher.times[-1] == caught.value.partial.time[-1] <= 0.05
    assert len(watcher.chosen) == 1


def test_a_refined_run_that_fails_before_its_first_sample_has_nothing_to_show(monkeypatch):
    monkeypatch.setattr(Engine, "advance", lambda self, intervals, **named: (FAILED, ()))
    watcher = Watcher()
    with pytest.raises(ComputationError, match="not finite") as caught:
        simulate(plant(), time_step="auto", analysis="dynamic", output_step=0.01, observer=watcher)
    assert caught.value.partial is None and watcher.times == []


def test_settings_of_run_scene_override_those_of_the_scene():
    scene = SHORT.with_values({"numerics.elements": 9, "numerics.time_step": 1e-3})
    run = run_scene(scene, elements=5, time_step=2e-3, analysis="static", output_step=0.02, degree=3)
    assert {name: run.summary[name] for name in ("elements", "degree", "analysis")} == {
        "elements": 5,
        "degree": 3,
        "analysis": "static",
    }
    assert run.summary["time_step"] == pytest.approx(2e-3)
    assert run.scene.numerics.elements == 5


def test_progress_is_complete_where_a_run_ends_before_its_time():
    watcher = Watcher()
    push = Insertion(kind="force", initial_depth=0.04, final_depth=0.05, push_force=1.0)
    scene = scene_of("entry", push, GEL, friction=Friction(viscous=10.0), duration=1.0)
    run = simulate(plant(scene), time_step=1e-3, analysis="quasi-static", output_step=0.01, observer=watcher)
    assert run.summary["stop_reason"] == "final-depth" and run.time[-1] < 0.9
    assert watcher.fractions[-2] < 0.9 and watcher.fractions[-1] == 1.0
    whole = Watcher()
    simulate(plant(), time_step=1e-3, analysis="static", output_step=0.01, observer=whole)
    assert whole.fractions.count(1.0) == 1


def test_final_depth_is_the_reason_where_the_scene_ends_by_itself():
    scene = scene_of("entry", moving(0.5, 0.04, 0.05), duration=None)
    assert simulate(plant(scene), time_step=1e-3, analysis="static").summary["stop_reason"] == "final-depth"


def test_a_tolerance_that_is_not_reached_is_told(monkeypatch):
    monkeypatch.setattr("fem_needle.refined_run.MOST_RUNS", 3)
    scene = scene_of("entry", held(0.1), GEL, [TipLoad(force=Sinusoid(amplitude=0.1, frequency=40.0))], duration=0.02)
    run = simulate(plant(scene), analysis="dynamic", output_step=0.01, time_step="auto", tolerance=1e-10)
    told = run.summary["warnings"]
    assert ["was not reached" in text for text in told] == [True, False]
    assert "the energy balance lacks" in told[1]


@pytest.mark.parametrize(("modulus", "is_missed"), [(500.0, False), (1e6, True)])
def test_elements_that_miss_the_tolerance_are_told(modulus, is_missed):
    scene = load_scene("bench-m").with_value("tissue.layers.0.foundation_modulus", modulus)
    run = run_scene(scene, elements=2, analysis="static", output_step=0.4)
    assert (run.summary["error_estimate"] > 1e-3) is is_missed
    assert (run.summary["warnings"] == ["the tolerance 0.001 was not reached with elements = 2: see error_estimate"]) is is_missed


@pytest.mark.parametrize(
    ("stiffness", "radius", "is_advised"), [("rigid", 1.0, True), ("rigid", 0.8, False), (500.0, 1.0, False)]
)
def test_energies_that_miss_under_rigid_guides_advise_damping(stiffness, radius, is_advised):
    support = {"guides": [Guide(position=-0.01, stiffness=stiffness)]}
    scene = scene_of("hub", held(0.1), GEL, support=support, numerics={"spectral_radius": radius}, duration=0.01)
    run = simulate(plant(scene), time_step=1e-3, analysis="dynamic", output_step=1e-3)
    assert trajectory.energy_warnings(run) == []
    run.series["energy_residual"] = run.energy_residual + run.bending_energy
    (warning,) = trajectory.energy_warnings(run)
    assert ("spectral_radius = 0.8 calms rigid guides" in warning) is is_advised


@pytest.mark.parametrize(("analysis", "damping"), [("static", 0.0), ("quasi-static", 0.0), ("quasi-static", 50.0)])
def test_forces_on_a_needle_without_inertia_sum_to_zero_under_rigid_guides(analysis, damping):
    """However long the steps: a guide's force is that of the instant. What viscosity takes at the start is an extrapolation."""
    layers = (Layer(foundation_modulus=5e3, damping=damping),)
    support = {"guides": [Guide(position=-0.0123), Guide(position=-0.04, stiffness=500.0)]}
    scene = scene_of("hub", moving(0.05, 0.05, 0.1), layers, [TipLoad(force=0.1)], support=support, duration=None)
    run = simulate(plant(scene), time_step=0.1, analysis=analysis, output_step=0.1)
    forces = [run.hub_force, run.tissue_force, *run.guide_force.T, np.full(run.time.shape, 0.1)]
    assert np.max(np.abs(sum(forces)[1 if damping else 0 :])) < 1e-9
    assert np.ptp(run.guide_force[:, 0]) > 0.01


def test_reversal_holds_and_reinsertion():
    scene = scene_of("entry", profile([0.0, 0.02, 0.04, 0.06], [0.05, 0.06, 0.06, 0.05]), GEL, duration=0.06)
    run = simulate(plant(scene), time_step=5e-4, analysis="static", output_step=0.01)
    assert run.depth == pytest.approx([0.05, 0.055, 0.06, 0.06, 0.06, 0.055, 0.05])
    assert run.tip_deflection[[0, 1, 2]] == pytest.approx(run.tip_deflection[[6, 5, 4]], rel=1e-10)


def test_a_needle_without_tissue_or_loads_stays_where_it_is():
    scene = scene_of("hub", moving(1.0, 0.05, 0.1), (), (), duration=0.05)
    run = simulate(plant(scene), time_step=1e-3, analysis="dynamic")
    assert not np.any(run.tip_deflection)
    assert run.summary["relative_energy_residual"] == 0.0
