"""Scenes in sentences and numbers as they are written."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fem_needle import load_scene
from fem_needle.report.numbers import duration, instant, millimeters, number, quantity, ratio, tidy, varying, with_unit
from fem_needle.report.shared import values_section
from fem_needle.report.study_parts import share
from fem_needle.report.words import layer_grids, scene_words
from fem_needle.scene import (
    Friction,
    Guide,
    Initial,
    Insertion,
    LateralLoad,
    Layer,
    Needle,
    Sinusoid,
    Support,
    Table,
    TipLoad,
    Tissue,
)
from fem_needle.scene.listing import entries
from fem_needle.shipped import shipped_names
from tests.unit.scene.examples import hub_scene

NARROW = "\u00a0"


def plain(text):
    return text.replace(NARROW, " ")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (-0.0, "0"), (1.0, "1"), (2.91967, "2.92"), (25600.0, "25600"), (123456.7, "123500"), (0.001, "0.001"),
        (-5.0, "−5"), (2.8e-7, "2.8 × 10⁻⁷"), (-1.5e12, "−1.5 × 10¹²"), (float("nan"), "none"), (None, "none"),
        (float("inf"), "infinite"), (float("-inf"), "minus infinite"), (True, "yes"), (7, "7"), ("auto", "auto"),
        (999999.9, "1000000"), (100.0, "100"),
    ],
)  # fmt: skip
def test_numbers(value, text):
    assert plain(number(value)) == text


def test_quantities_are_in_mm_n_s_and_degrees():
    assert plain(millimeters(0.18)) == "180 mm"
    assert plain(millimeters(4.6e-29)) == "0 mm" and plain(millimeters(-2e-14)) == "−2 × 10⁻¹¹ mm"
    assert plain(quantity(np.pi, "rad")) == "180 deg"
    assert plain(quantity(0.0256, "N m^2")) == "25600 N mm²"
    assert plain(quantity(520.0, "N/m^2")) == "0.52 kN/m²"
    times = (2.0, 3e-3, 4e-6, 5e-9, 0.0, None)
    assert [plain(duration(value)) for value in times] == ["2 s", "3 ms", "4 µs", "5 ns", "0 s", "none"]
    assert [plain(ratio(value)) for value in (0.0123, 1e-3, 2.54e-5, None, float("inf"))] == [
        "1.2 %", "0.1 %", "2.5 × 10⁻⁵", "none", "none",
    ]  # fmt: skip
    assert with_unit("none", "N") == "none"


def test_values_that_vary():
    assert plain(varying(Sinusoid(mean=0.1, amplitude=0.05, frequency=30.0), "N")) == "0.1 ± 0.05 N at 30 Hz"
    assert plain(varying(Table(time=[0.0, 1.0, 2.0], value=[0.0, 0.03, 0.01]), "m")) == "0 to 30 mm over time (3 points)"


def test_dates():
    assert instant("2026-11-22T21:14:33+00:00") == "2026-11-22 21:14:33 UTC"


def test_powers_in_sentences():
    assert plain(tidy("moves by 2.8e-07 (allowed 2.5e-04), x1e-3, 4e2")) == "moves by 2.8 × 10⁻⁷ (allowed 2.5 × 10⁻⁴), x1e-3, 4e2"


ROD = Needle(length=0.3, youngs_modulus=2e11, outer_diameter=1e-3, density=8e3)
MOVED = Support(kind="hub", hub_deflection=0.002, hub_angle=0.1)
SPRING = Support(kind="hub", guides=[Guide(position=-0.01, stiffness=300.0)])
PROFILE = Insertion(kind="profile", depth=Table(time=[0, 1], value=[0.0, 0.1]))
BEVEL = TipLoad(bevel_coefficient=2e-4, direction=-0.5)
CASES = [
    ({}, "Needle", "1.27 mm outside and 1 mm inside. Its bending stiffness is 15720 N mm², its mass per length 3.851 g/m"),
    ({"needle": ROD}, "Needle", "300 mm long, 1 mm diameter, solid"),
    ({}, "Support", "outside the tissue, so that its whole length bends. A rigid guide holds it 30 mm before the skin"),
    ({"support": Support(kind="entry")}, "Support", "clamped where it enters the tissue, so that only the inserted part bends"),
    ({"support": MOVED}, "Support", "moved sideways by 2 mm. The hub is turned by 5.73 deg"),
    ({"support": SPRING}, "Support", "spring of 0.3 N/mm holds it 10 mm before"),
    (
        {"support": Support(kind="hub", hub_rotation="free", hub_rotational_inertia=1e-5, hub_torque=0.002)},
        "Support",
        "turns freely, with a moment of inertia of 1 × 10⁻⁵ kg m² and a torque of 2 N mm",
    ),
    ({}, "Tissue", "one layer of springs that resist sideways motion along the inserted length. They are at rest on"),
    ({"tissue": Tissue()}, "Tissue", "There is no tissue"),
    ({"tissue": Tissue(kind="tip-spring", tip_stiffness=520.0)}, "Tissue", "one spring of 0.52 N/mm that travels with the tip"),
    (
        {"tissue": Tissue(rest_line="cut-path", stiffness_factor=1.5, layers=[Layer(foundation_modulus=1.0, damping=2.0)])},
        "Tissue",
        "sideways motion along the inserted length. They are at rest on the path that the tip has "
        "cut. Its stiffness is multiplied by 1.5",
    ),
    ({}, "Insertion", "inserted from 20 mm to 160 mm at 10 mm/s, whatever force that takes. The run lasts up to 14 s"),
    ({"insertion": Insertion(kind="hold", initial_depth=0.1), "run": {"duration": 1.0}}, "Insertion", "held 100 mm deep"),
    ({"insertion": PROFILE}, "Insertion", "0 to 100 mm over time (2 points)"),
    (
        {"insertion": Insertion(kind="force", initial_depth=0.02, final_depth=0.1, push_force=3.0), "run": {"duration": 1.0}},
        "Insertion",
        "A push of 3 N drives it in from 20 mm, until it is 100 mm deep; its depth follows",
    ),
    ({"friction": Friction(coulomb=0.5, coulomb_per_length=10.0)}, "Friction", "0.5 N against the motion, 0.01 N/mm along the"),
    ({}, "Loads", "A force of 0.1 N acts sideways at the tip"),
    ({"loads": ()}, "Loads", "No lateral force is applied"),
    ({"loads": [LateralLoad(position=-0.01, force=0.2)]}, "Loads", "0.2 N acts sideways 10 mm before the skin"),
    ({"loads": [BEVEL]}, "Loads", "200 mm² times the modulus there, times −0.5 for the direction"),
    ({}, "Start", "starts in equilibrium"),
    ({"initial": Initial(shape="straight")}, "Start", "starts straight"),
    ({"initial": Initial(shape="tip-displaced", tip_deflection=1e-3)}, "Start", "tip displaced by 1 mm"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "topic", "said"), CASES)
def test_a_part_in_words(changes, topic, said):
    assert said in plain(dict(scene_words(hub_scene(**changes)))[topic])


def test_parts_that_say_nothing_are_not_there():
    assert {"Friction", "Control"} & dict(scene_words(hub_scene())).keys() == set()


def test_a_loop_in_words():
    told = plain(dict(scene_words(load_scene("steering")))["Control"])
    assert told.startswith("The scene wants the tip 0 mm off the axis at a depth of 100 mm. Controller: incremental; it commands")
    assert "Sensor tip-imaging: a reading every 0.15 s, with noise of 0.1 mm." in told
    actuated = dict(scene_words(load_scene("thesis-inverse-dynamics")))["Control"]
    assert "inverse-dynamics, fully-actuated; it acts on the depth and on every coordinate of the needle." in actuated


def test_columns_of_layers_without_a_value_are_left_out():
    layers = [Layer(start=0.05, foundation_modulus=2e4, cutting_force=0.9), Layer(name="fat", end=0.05, foundation_modulus=5e3)]
    [grid] = layer_grids(hub_scene(tissue=Tissue(layers=layers)))
    assert grid.headers == ("layer", "from", "to", "foundation modulus", "cutting force")
    assert [tuple(map(plain, row)) for row in grid.rows] == [
        ("fat", "0 mm", "50 mm", "5 kN/m²", "0 N"),
        ("layer 0", "50 mm", "no far side", "20 kN/m²", "0.9 N"),
    ]


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_scene_has_sentences_and_all_its_values(name):
    scene = load_scene(name)
    for _, text in scene_words(scene):
        assert re.fullmatch(r"[A-Z].*\.", text) and not re.search(r"None|nan|\binf\b|Sinusoid|Table\(|\[", text), text
    shown = {row[0] for grid in values_section(scene).grids for row in grid.rows}
    parts = {"target", "controller", "actuators", "scatter", "title"}
    assert {path for path, _, _ in entries(scene) if path.partition(".")[0] not in parts} <= shown


SHARES = [(0.274, "27 %"), (1.2e-4, "0.012 %"), (3e-9, "below 0.001 %"), (0.0, "0 %"), (None, "none")]


@pytest.mark.parametrize(("value", "said"), SHARES)
def test_shares_of_a_comparison_are_percentages_throughout(value, said):
    assert plain(share(value)) == said
