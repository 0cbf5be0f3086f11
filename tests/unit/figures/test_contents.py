"""Pictures show the numbers of the run, in the units that they name."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from fem_needle import SceneError, Trajectory, load_scene, run_scene
from fem_needle.figures import courses, energies, shapes, tip_path, waterfall
from fem_needle.figures.common import deflection_unit
from fem_needle.figures.course_figure import Panel, draw_panel
from fem_needle.figures.tissue import bands_of
from fem_needle.pictures import crowded
from tests.unit.figures.runs import run_named

SIZES = {"J": 1.0, "mJ": 1e-3, "µJ": 1e-6, "nJ": 1e-9, "pJ": 1e-12, "N": 1.0, "mN": 1e-3, "µN": 1e-6, "mm": 1e-3}


def lines(axes):
    return {str(line.get_label()): line for line in axes.lines}


def panel(figure, title):
    return next(axes for axes in figure.axes if axes.get_title(loc="left").startswith(title))


def si(axes, name):
    """Return a curve in SI by the unit that its axis names."""
    [unit] = re.findall(r"\[(\S+)\]", axes.get_ylabel())
    return SIZES[unit] * np.asarray(lines(axes)[name].get_ydata())


def test_a_shape_is_the_needle_at_its_depth_in_millimeters():
    run = run_named("hub")
    curves = lines(shapes(run, [0.03, 0.06]).axes[1])
    for depth in (0.03, 0.06):
        row = int(np.argmin(np.abs(run.depth - depth)))
        line = curves[f"{1e3 * run.depth[row]:.4g} mm deep"]
        np.testing.assert_allclose(line.get_xdata(), 1e3 * (run.arc_length - 0.2 + run.depth[row]), atol=1e-12)
        np.testing.assert_allclose(line.get_ydata(), 1e3 * run.station_deflection[row], atol=1e-15)


def test_under_entry_a_shape_goes_through_the_clamp():
    line = lines(shapes(run_named("entry"), [0.1]).axes[1])["100 mm deep"]
    places, deflections = line.get_data()
    assert 0.0 in places
    assert np.all(deflections[places <= 0.0] == 0.0)
    assert places[-1] == pytest.approx(100.0)


@pytest.mark.parametrize("name", ["entry", pytest.param("cut path", marks=pytest.mark.slow)])
def test_the_magnification_is_that_of_the_drawn_axes(name):
    figure = shapes(run_named(name))
    figure.draw_without_rendering()
    axes = figure.axes[1]
    origin, across, up = axes.transData.transform([(0, 0), (1, 0), (0, 1)])
    [told] = re.findall(r"magnified (\S+) times", figure.axes[0].get_title(loc="left"))
    assert float(told) == pytest.approx((up[1] - origin[1]) / (across[0] - origin[0]), rel=0.05)
    assert up[1] > origin[1] and across[0] > origin[0]  # positive deflections up, insertion to the right


@pytest.mark.parametrize("depths", [[0.5], [0.05, -0.01], [float("nan")], []])
def test_depths_that_the_run_has_not_are_refused(depths):
    with pytest.raises(SceneError, match=r"depths: .*allowed"):
        shapes(run_named("hub"), depths)


def test_layers_are_named_with_their_moduli():
    found = [text.get_text() for text in shapes(run_named("hub")).findobj(match=Text)]
    texts = " ".join(" ".join(found).split())
    assert "prostate region, 20 kN/m²" in texts and "fat and muscle, 5 kN/m²" in texts


def test_guide_hub_target_force_and_cut_path_are_drawn():
    _, labels = shapes(run_named("loop")).axes[1].get_legend_handles_labels()
    assert {"guide on a spring", "hub", "target", "lateral force"} <= set(labels)
    run = run_named("cut path")
    cut = lines(shapes(run).axes[1])["path that the tip cut"]
    np.testing.assert_allclose(cut.get_ydata(), 1e3 * run.path_deflection)


def test_two_kinds_of_guides_have_two_markers_and_two_names():
    guides = [{"position": -0.01}, {"position": -0.02, "stiffness": 300.0}, {"position": -0.03}]
    run = run_named("hub")
    drawn = lines(shapes(replace(run, scene=run.scene.with_values({"support.guides": guides}))).axes[1])
    rigid, spring = drawn["rigid guide"], drawn["guide on a spring"]
    assert (rigid.get_xdata().tolist(), spring.get_xdata().tolist()) == ([-10.0, -30.0], [-20.0])
    assert rigid.get_marker() != spring.get_marker() and rigid.get_color() != spring.get_color()


def test_layers_without_names_have_their_numbers_in_the_scene():
    """Layers may stand in any order; ``tissue.layers.N`` counts them from 0."""
    layers = [{"start": 0.05, "foundation_modulus": 2e4}, {"end": 0.05, "foundation_modulus": 5e3}]
    scene = run_named("hub").scene.with_values({"tissue.layers": layers})
    bands = bands_of(scene, 0.0, 100.0)
    found = [(band.start, *(text.replace("\u00a0", " ") for text in (band.text, band.note))) for band in bands]
    assert found == [(0.0, "layer 1, 5 kN/m²", "1: 5 kN/m²"), (50.0, "layer 0, 20 kN/m²", "0: 20 kN/m²")]


def test_the_path_of_the_tip_is_its_deflection_over_its_place():
    run = run_named("back")
    line = lines(tip_path(run).axes[1])["tip"]
    np.testing.assert_allclose(line.get_xdata(), 1e3 * run.depth)
    np.testing.assert_allclose(line.get_ydata(), 1e3 * run.tip_deflection)


def test_a_held_tip_is_drawn_over_the_time():
    run, [axes] = run_named("hold"), tip_path(run_named("hold")).axes
    assert (axes.get_xlabel(), axes.get_title(loc="left")) == ("time [s]", "Tip, held 100 mm deep")
    np.testing.assert_array_equal(lines(axes)["tip"].get_xdata(), run.time)


def test_dots_of_the_path_are_the_readings_of_the_loop():
    run = run_named("loop")
    dots = lines(tip_path(run).axes[1])["latest measurement"].get_ydata()
    readings = 1e3 * run.signals["measurement_tip_deflection"]
    assert len(dots) > 3 and set(dots) <= set(readings)


def test_courses_are_the_series():
    run, figure = run_named("hub"), courses(run_named("hub"))
    axial, lateral = panel(figure, "Axial"), panel(figure, "Lateral")
    np.testing.assert_allclose(si(panel(figure, "Tip"), "deflection"), run.tip_deflection, rtol=1e-12)
    np.testing.assert_allclose(si(axial, "push"), run.push_force, rtol=1e-12)
    np.testing.assert_allclose(si(axial, "friction"), run.friction_force, rtol=1e-12)
    for name, values in (("tissue", run.tissue_force), ("hub", run.hub_force), ("guide", run.guide_force[:, 0])):
        np.testing.assert_allclose(si(lateral, name), values, rtol=1e-12)


def test_forces_along_the_axis_balance_and_a_needle_that_rests_has_no_friction_of_motion():
    """push = inertia + friction + cutting - A; a straight needle has no A, and this one of 2 g is hardly accelerated."""
    layers = [{"name": "skin", "start": 0.004, "foundation_modulus": 5e3, "cutting_force": 0.5, "puncture_force": 2.0}]
    push = {"time": [0.0, 2.0], "value": [0.0, 4.0]}
    values = {"tissue.layers": layers, "loads": [], "insertion.push_force": push, "numerics.output_step": 0.02}
    run = run_scene(load_scene("liver-push").with_values(values))
    axes = panel(courses(run), "Axial")
    shown = {name: si(axes, name) for name in ("push", "friction", "cutting", "hold at rest")}
    resting = np.isfinite(shown["hold at rest"])
    assert np.any(resting) and np.all(run.speed[resting] == 0.0) and np.all(np.isnan(shown["friction"][resting]))
    np.testing.assert_allclose(shown["hold at rest"][resting], run.push_force[resting], rtol=1e-9)
    advancing = run.speed > 0.0
    assert set(np.round(shown["cutting"][advancing], 9)) == {0.0, 0.5} and np.count_nonzero(advancing) > 10
    gap = np.abs(run.push_force - shown["friction"] - shown["cutting"])[advancing & (run.depth > 0.006)]
    assert len(gap) > 10 and np.median(gap) < 0.01 * np.max(run.push_force)


def test_a_curve_that_turns_very_often_is_thin_and_not_dashed():
    assert crowded(np.sin(np.linspace(0.0, 800.0, 4000))) and not crowded(np.sin(np.linspace(0.0, 80.0, 4000)))
    run, axes = run_named("hub"), Figure().subplots()
    fast = np.sin(400.0 * np.linspace(0.0, 1.0, 2000))
    slow = replace(run, time=np.linspace(0.0, 1.0, 2000))
    draw_panel(axes, Panel("Two", "force [N]", {"one": fast, "other": np.ones(2000)}), slow)
    drawn = lines(axes)
    assert (drawn["one"].get_linestyle(), drawn["other"].get_linestyle()) == ("-", "--")
    assert drawn["one"].get_linewidth() < drawn["other"].get_linewidth()
    draw_panel(axes, Panel("Two", "force [N]", {"first": np.ones(2000), "second": fast}), slow)
    assert lines(axes)["second"].get_linestyle() == "-"


def test_energies_that_are_round_off_are_zero():
    run = run_named("hub")
    noise = run.series | {"load_work": np.full(len(run.time), 1e-16 * np.max(run.bending_energy))}
    works = panel(energies(replace(run, series=noise)), "Lateral works")
    assert "loads" not in lines(works)
    residual = run.series | {"energy_residual": np.full(len(run.time), 1e-16 * np.max(run.bending_energy))}
    assert "lateral" in panel(energies(replace(run, series=residual)), "Residuals").get_title(loc="left")


def test_courses_show_the_command_of_a_loop():
    run = run_named("loop")
    axes = panel(courses(run), "Command: lateral force")
    np.testing.assert_allclose(si(axes, "lateral force"), run.signals["command_lateral_force"])


def test_energies_are_the_ledger_and_name_what_is_zero():
    run = run_named("hub")
    figure = energies(run)
    stored, works = panel(figure, "Stored"), panel(figure, "Lateral works")
    np.testing.assert_allclose(si(stored, "bending"), run.bending_energy, rtol=1e-12)
    np.testing.assert_allclose(si(works, "loads"), run.load_work, rtol=1e-12)
    assert "hub" not in lines(works) and not np.any(run.hub_work)
    assert panel(energies(run_named("still")), "Stored").get_title(loc="left") == "Stored, lateral: zero throughout"


def test_energies_that_a_loop_of_old_left_out_are_said_to_be_missing():
    loop = run_named("loop")
    works = {name: np.full(len(loop.time), np.nan) for name in ("load_work", "hub_work", "tissue_work", "tissue_dissipation")}
    missing = replace(loop, series=loop.series | works | {"boundary_energy": works["hub_work"]})
    assert panel(energies(missing), "Lateral works").get_title(loc="left") == "Lateral works: not computed"


def test_the_waterfall_is_the_deflection_over_arc_length_and_time():
    run = run_named("hub")
    left, right = waterfall(run).axes[:2]
    [cells] = [one for one in right.collections if one.get_array() is not None]
    np.testing.assert_allclose(np.reshape(cells.get_array(), run.station_deflection.shape), 1e3 * run.station_deflection)
    low, high = cells.get_clim()
    assert (-low, high) == (high, pytest.approx(1e3 * np.max(np.abs(run.station_deflection))))
    skin = lines(right)["skin"]
    np.testing.assert_allclose(skin.get_xdata(), 1e3 * (0.2 - run.depth))
    assert left.get_ylabel() == "time [s]"


@pytest.mark.parametrize("name", ["hub", "hold"])
def test_both_halves_of_the_waterfall_have_the_same_times_and_no_ticks_beyond_the_run(name):
    run = run_named(name)
    left, right = waterfall(run).axes[:2]
    assert left.get_ylim() == right.get_ylim() and left.get_ylabel() == right.get_ylabel() == "time [s]"
    for axes in (left, right):
        ticks = axes.get_yticks()
        assert len(ticks) > 2 and run.time[0] <= min(ticks) and max(ticks) <= run.time[-1]


def test_the_waterfall_says_how_many_samples_are_stacked():
    run = run_named("hub")
    assert waterfall(run).axes[0].get_title(loc="left") == "Stacked"
    many = replace(run, time=np.linspace(0.0, 1.0, 400), station_deflection=np.resize(run.station_deflection, (400, 3)),
                   arc_length=run.arc_length[:3], series={name: np.resize(v, 400) for name, v in run.series.items()})  # fmt: skip
    assert waterfall(many).axes[0].get_title(loc="left") == "Stacked: 24 of 400 samples"


def test_the_largest_deflection_of_a_run_is_among_the_shapes():
    run = run_named("hub")
    row = int(np.argmax(np.max(np.abs(run.station_deflection), axis=1)))
    assert f"{1e3 * run.depth[row]:.4g} mm deep" in lines(shapes(run).axes[1])


def test_tiny_deflections_have_a_unit_in_which_numbers_need_no_power_of_ten():
    """A run made a hundred thousand times as flat: nanometers in all pictures, magnified by as much more."""
    run = run_named("hub")
    shapes_small = 1e-5 * run.station_deflection
    flat = replace(run, station_deflection=shapes_small, series=run.series | {"tip_deflection": shapes_small[:, -1]})
    assert deflection_unit(run) == (1e3, "mm") and deflection_unit(flat) == (1e9, "nm")
    for figure in (shapes(flat), tip_path(flat), courses(flat), waterfall(flat)):
        figure.draw_without_rendering()
        labels = " ".join(axes.get_ylabel() for axes in figure.axes)
        assert "[nm]" in labels
        assert [axes.yaxis.get_offset_text().get_text() for axes in figure.axes] == [""] * len(figure.axes)
    told = [float(re.findall(r"magnified (\S+) times", shapes(one).axes[0].get_title(loc="left"))[0]) for one in (run, flat)]
    assert told[1] == pytest.approx(1e5 * told[0], rel=0.05)
    tip = lines(tip_path(flat).axes[1])["tip"]
    np.testing.assert_allclose(tip.get_ydata(), 1e9 * flat.tip_deflection)


def test_long_titles_have_two_lines_and_lose_no_words():
    title = load_scene("liver-push").title
    run = run_named("interrupted")
    shown = courses(replace(run, scene=run.scene.with_values({"title": title}))).get_suptitle()
    assert " ".join(shown.split()).startswith(title) and shown.count("\n") == 1 and "(interrupted at " in shown


def test_the_bar_of_the_stacked_curves_has_the_length_that_it_tells():
    run = run_named("hub")
    left = waterfall(run).axes[0]
    bar, name = left.texts
    size = float(name.get_text().removesuffix(" mm"))
    curve = next(line for line in left.lines if line.get_ydata()[0] == run.time[8] and len(line.get_xdata()) > 2)
    stretch = (curve.get_ydata()[-1] - run.time[8]) / (1e3 * run.tip_deflection[8])
    assert bar.xy[1] - bar.xyann[1] == pytest.approx(size * stretch)


def test_a_loaded_run_gives_the_same_picture(tmp_path):
    run = run_named("hub")
    run.save(tmp_path / "run")
    loaded = Trajectory.load(tmp_path / "run")
    for draw in (shapes, tip_path):
        first, second = (draw(one).axes[1].lines for one in (run, loaded))
        for line, other in zip(first, second, strict=True):
            np.testing.assert_allclose(line.get_ydata(), other.get_ydata(), atol=1e-12)
