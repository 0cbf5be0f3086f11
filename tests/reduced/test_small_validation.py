"""Pages of what moves, made small: their numbers are those of the committed pages, their words follow from the numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

from fem_needle.exact import exact_static
from fem_needle.identification import spread
from fem_needle.statics import solve_static
from reduced_model.identification import friction
from reduced_model.thesis_data import TABLE_I
from reduced_model.validation import energy, insertion, pictures, released, signs, transients, tube_at_rest
from reduced_model.validation.cases import CORRECTED, TWO, TWO_INSERTED
from tests.house.source import ROOT
from tests.reduced.small_pages import Drawn, remember_apart, tables

PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
COMMITTED = [row for rows in tables(PAGE) for row in rows]


def is_committed(row):
    """Whether a row, maybe with fewer columns, is one of the committed page."""
    return any(row.items() <= other.items() for other in COMMITTED)


def test_a_needle_let_go(monkeypatch):
    remember_apart(monkeypatch, released, "_runs")
    monkeypatch.setattr(released, "SWINGS", (1,))
    monkeypatch.setattr(released, "CASES", (released.CASES[2], released.CASES[7]))
    drawn = Drawn(monkeypatch, released)
    found = released.section()
    frequencies, swings = tables(found.markdown)
    assert all(is_committed(row) for row in (*frequencies, *swings))
    assert [row["2 modes in phase: swings"] for row in frequencies] == ["all", "71"]
    assert found.conclusions[0].count("71 (18 gauge tube, `hub`, 5 kN/m^2, 100 mm)") == 2  # of one both most and fewest
    found.pictures[released.PICTURE]()
    (panel,) = drawn.panels
    assert [curve.label for curve in panel.curves] == ["elements", "2 modes", "5 modes"]
    assert all(curve.values[0] == pytest.approx(1.0) for curve in panel.curves)  # mm


def test_a_needle_that_goes_in(monkeypatch):
    """The slow half is the committed one; the fast half takes few steps here."""
    remember_apart(monkeypatch, insertion, "insertions")
    few = {"analysis": "dynamic", "time_step": 8e-3, "output_step": 8e-3}
    monkeypatch.setattr(insertion, "STEPS", insertion.STEPS | {insertion.FAST: few})
    monkeypatch.setattr(insertion, "CHOICES", (TWO, TWO_INSERTED, CORRECTED))
    monkeypatch.setattr(insertion, "CASES", {name: case for name, case in insertion.CASES.items() if "hub" in name})
    drawn = Drawn(monkeypatch, pictures)
    found = insertion.section()
    slow, fast = tables(found.markdown)[0]
    assert is_committed(slow)
    assert fast["2 of the inserted length"] == "as 2 modes"
    assert f"Inserted at 0.01 m/s two modes miss the tip by {slow['2 modes']} to {slow['2 modes']} %" in found.conclusions[0]
    assert found.conclusions[1].endswith(f"with static corrections by {fast['2 and corrections']} % at most.")
    found.pictures[insertion.PICTURE]()
    assert [panel.title for panel in drawn.panels] == ["two modes at 0.01 m/s", "two modes at 3 m/s"]
    assert np.max(drawn.panels[0].curves[0].values) == pytest.approx(float(slow["2 modes"]), rel=0.01)


def test_the_printed_equations_lose_energy_whatever_the_step(monkeypatch):
    remember_apart(monkeypatch, energy, "pushed")
    coarse = energy.Push("as-printed", energy.SPRING, energy.THESIS_START, 2e-4)
    (printed,) = (row for row in COMMITTED if row.get("variant") == "`as-printed`")
    assert energy.largest_drift(coarse) == pytest.approx(float(printed["drift"]), rel=0.05)
    assert energy.pushed(coarse).speed[-1] == pytest.approx(float(printed["speed at 180 mm [m/s]"]), rel=1e-3)


def a_push(push):
    """A run that loses what is said here: everything is zero but the lateral energy, which begins with 2 J."""
    loss = {"as-printed": 1.0, "corrected": 0.5}.get(push.variant, 4e6 * push.step**2 if push.start < 0.05 else 0.0)
    nothing = np.zeros(3)
    return SimpleNamespace(
        scene=energy.push_scene(push),
        kinetic_energy=np.array([2.0, 2.0 - loss, 2.0]),
        bending_energy=nothing,
        tissue_energy=nothing,
        speed=nothing,
        push_work=nothing,
        load_work=nothing,
        tip_deflection=np.array([5e-4, -2e-3, 1e-3]),
        depth=np.array([0.02, 0.1, 0.18]),
    )


def test_energy_of_a_push_in_words(monkeypatch):
    monkeypatch.setattr(energy, "pushed", a_push)
    drawn = Drawn(monkeypatch, energy)
    found = energy.section()
    rows = tables(found.markdown)[0]
    assert [row["drift"] for row in rows] == ["0.5", "0.25", "0.0002", "0.25", "0.0008", "0.0002", "< 1e-08"]
    assert {(row["largest tip [mm]"], row["tip at 180 mm [mm]"]) for row in rows} == {("2.00", "1.00")}
    assert "half the step divides it by 4." in found.text
    (said,) = found.conclusions
    assert "keeps it to 0.0002 of the lateral energy, `corrected` changes it by 25 % and `as-printed` by 50 %" in said
    found.pictures[energy.PICTURE]()
    assert [curve.values[1] for curve in drawn.panels[0].curves] == pytest.approx([-0.5, -0.25, -2e-4])
    assert drawn.axes.get_xlim()[0] == 20.0  # mm


def an_effect(scene):
    """Inertia by the speed (0.9 % at 1 m/s), a tenth of it in motion; viscosity adds; slow ramps do nothing."""
    (layer,) = scene.tissue.layers
    if not isinstance(scene.loads[0].force, float):
        return transients.Effect(0.0 if scene.run.duration > 0.06 else 0.3, 0.3, 0.0095)
    if scene.insertion.kind == "profile":
        table = scene.insertion.depth
        inertia = 9e-3 * np.diff(table.values)[1] / np.diff(table.time)[1]
    else:
        inertia = 9e-4 * scene.insertion.speed
    return transients.Effect(inertia, inertia + 1e-3 * layer.damping, 0.0095)


def test_transients_in_words(monkeypatch):
    remember_apart(monkeypatch, transients, "insertion_effect", "ramp_effect")
    monkeypatch.setattr(transients, "_effect", an_effect)
    drawn = Drawn(monkeypatch, pictures)
    found = transients.section()
    rest, motion, everything, ramps = tables(found.markdown)
    speeds = [f"{speed:g} m/s" for speed in transients.SPEEDS]
    assert [rest[0][speed] for speed in speeds] == ["< 0.001", "0.009", "0.09", "0.9", "4.5"]
    assert [motion[0][speed] for speed in speeds] == ["< 0.001", "< 0.001", "0.009", "0.09", "0.45"]
    assert [row["0.001 m/s"] for row in everything[:3]] == ["< 0.001", "0.1", "10"]
    assert list(ramps[0].values()) == ["0.5", "30", "30", "30", "< 0.001", "< 0.001"]
    # 9 needles, at 4 and 3 speeds fast enough to be compared
    assert "from rest, at once, it bounds 27 of the 36 cells above 0.001 %, the largest measured effect is 4.7" in found.text
    assert "already in motion, it bounds 27 of the 27 cells above 0.001 %, the largest measured effect is 0.5" in found.text
    (said,) = found.conclusions
    assert "within 1 % up to 1 m/s from rest and up to 5 m/s in motion" in said
    assert "inertia moves the tip by at most 0.09 %" in said
    assert "inertia and viscosity together make 10 %" in said
    assert "changes within 10 ms or less" in said
    found.pictures[transients.PICTURE]()
    assert [len(panel.curves) for panel in drawn.panels] == [6, 6]
    assert drawn.axes.get_xscale() == "log"


def test_viscosity_is_a_transient_that_inertia_is_not(monkeypatch):
    remember_apart(monkeypatch, transients, "insertion_effect")
    monkeypatch.setattr(transients, "ELEMENTS", 2)
    monkeypatch.setattr(transients, "SAMPLES", 10)
    found = transients.insertion_effect(transients.FROM_REST, 5e3, 100.0, 0.1)
    assert found.all_transients > 50.0 * found.inertia > 0.0
    assert found.inertia <= found.bound


def an_experiment(true, estimate, break_away):
    errors = np.array([0.002, 0.01])
    ends = np.stack((estimate - 2 * errors, estimate + 2 * errors), axis=1)
    fit = SimpleNamespace(standard_errors=errors, intervals=lambda: ends)
    values = (SimpleNamespace(value=value) for value in estimate)
    return SimpleNamespace(coulomb=next(values), viscous=next(values), fit=fit, break_away=(true[0] - break_away, true[0]))


def test_friction_in_words(monkeypatch):
    """Two experiments: of each friction one interval misses, the other does not."""
    true = np.array([[0.5, 0.3], [0.6, 0.4]])
    estimates = true + np.array([[0.005, 0.0], [0.001, 0.03]])
    fits = tuple(an_experiment(*one) for one in zip(true, estimates, (0.01, 0.03), strict=True))
    found = SimpleNamespace(
        fits=fits, true=true, errors=estimates - true, coulomb=spread(estimates[:, 0]), viscous=spread(estimates[:, 1])
    )
    monkeypatch.setattr(friction, "repetitions", lambda: found)
    text = friction.section().text
    coulomb, viscous = tables(text)[0]
    assert (coulomb["mean"], viscous["mean"]) == ("0.553", "0.365")
    assert coulomb["thesis: mean"] == f"{TABLE_I.coulomb:g}"
    assert "errs by 3.6 mN and 0.021 N s/m (root mean square)" in text
    assert "standard errors are 2.0 mN and 0.010 N s/m, and the 95 % intervals hold the truth in 1 and 1 of 2" in text
    assert "is 20 mN below mu_s" in text


def test_sign_changes_drawn(monkeypatch):
    """Branches are drawn apart, the exact one is shaded where the tip moves against the force."""
    monkeypatch.setattr(signs, "PICTURE_MODULI", np.array([1e3, 5e4]))
    depths = {1e3: {"exact": (0.19,)}, 5e4: {"exact": (0.03, 0.13)}}
    monkeypatch.setattr(
        signs, "sign_changes", lambda modulus, labels: signs.SignChanges(modulus, dict.fromkeys(labels, ()) | depths[modulus])
    )
    drawn = Drawn(monkeypatch, signs)
    signs._picture()
    exact, *others = drawn.panels[0].curves
    np.testing.assert_array_equal(exact.across, [1.0, 50.0, np.nan, 50.0, np.nan])  # kN/m^2
    np.testing.assert_allclose(exact.values, [190.0, 30.0, np.nan, 130.0, np.nan])  # mm
    assert all(np.all(np.isnan(curve.values)) for curve in others)
    (shaded,) = drawn.axes.collections
    assert {tuple(point) for point in shaded.get_paths()[0].vertices} >= {(1.0, 190.0), (1.0, 196.0), (50.0, 30.0), (50.0, 130.0)}


def test_errors_at_rest_drawn(monkeypatch):
    monkeypatch.setattr(tube_at_rest, "PICTURE_MODULI", (5e4,))
    monkeypatch.setattr(tube_at_rest, "CURVE_POINTS", 3)
    drawn = Drawn(monkeypatch, pictures)
    tube_at_rest._picture()
    assert [panel.title for panel in drawn.panels][-1] == "clamped at the hub, force at the skin"
    (curve,) = drawn.panels[0].curves
    ends = np.array([tube_at_rest.SHALLOW, tube_at_rest.HUB_REACH])
    np.testing.assert_allclose(curve.across[[0, -1]], (5e4 / (4 * tube_at_rest.TUBE.bending_stiffness)) ** 0.25 * ends)
    scene = tube_at_rest._scene(next(iter(tube_at_rest.LOADS)), 5e4)
    error = solve_static(TWO.plant(scene), depth=ends[1]).tip_deflection / exact_static(scene, ends[1]).tip_deflection - 1.0
    assert curve.values[-1] == pytest.approx(100.0 * abs(error), rel=1e-6)
