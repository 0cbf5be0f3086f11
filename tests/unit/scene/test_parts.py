"""The parts of a scene, each on its own, built in Python."""

from math import pi

import numpy as np
import pytest
from pydantic import ValidationError

from fem_needle.errors import SceneError
from fem_needle.scene import (
    Controller,
    Friction,
    Guide,
    Initial,
    Insertion,
    LateralLoad,
    Layer,
    Model,
    Needle,
    Numerics,
    Run,
    Sinusoid,
    Support,
    Table,
    TipLoad,
    Tissue,
)


def test_a_tube_has_the_stiffness_and_mass_of_its_section():
    needle = Needle(length=0.2, youngs_modulus=200e9, outer_diameter=1.27e-3, inner_diameter=1e-3, density=8000.0)
    assert needle.bending_stiffness == pytest.approx(200e9 * pi / 64 * (1.27e-3**4 - 1e-3**4), rel=1e-14)
    assert needle.mass_per_length == pytest.approx(8000 * pi / 4 * (1.27e-3**2 - 1e-3**2), rel=1e-14)
    assert needle.radius == 1.27e-3 / 2


def test_a_section_by_numbers():
    needle = Needle(length=0.2, youngs_modulus=200e9, second_moment_of_area=1.28e-13, area=1.27e-6, density=8000.0)
    assert needle.bending_stiffness == pytest.approx(0.0256, rel=1e-14)
    assert needle.mass_per_length == pytest.approx(0.01016, rel=1e-14)
    assert pi * needle.radius**2 == pytest.approx(1.27e-6, rel=1e-14)


def test_a_needle_given_directly_has_no_known_radius():
    needle = Needle(length="200 mm", bending_stiffness="0.0256 N m^2", mass_per_length="10.16 g/m")
    assert (needle.length, needle.bending_stiffness, needle.mass_per_length) == (0.2, 0.0256, 0.01016)
    assert needle.radius is None


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"bending_stiffness": 0.01, "youngs_modulus": 1e9, "mass_per_length": 1.0}, "two ways"),
        ({"bending_stiffness": 0.01, "mass_per_length": 1.0, "density": 1.0}, "two ways"),
        ({"youngs_modulus": 1e11, "outer_diameter": 1e-3, "second_moment_of_area": 1e-13, "density": 1e3}, "two ways"),
        ({"youngs_modulus": 1e11, "outer_diameter": 1e-3, "area": 1e-6, "density": 1e3}, "two ways"),
        ({"youngs_modulus": 1e11, "mass_per_length": 1.0}, "too little"),
        ({"bending_stiffness": 1.0, "density": 1e3}, "too little"),
        ({"youngs_modulus": 1e11, "outer_diameter": 1e-3, "inner_diameter": 1e-3, "density": 1e3}, "no wall.*below outer"),
        ({"bending_stiffness": 1.0, "mass_per_length": 1.0, "inner_diameter": 1e-3}, "needs outer_diameter"),
        ({"youngs_modulus": 1e11, "outer_diameter": 1e-6, "density": 1e3}, "1e-10 to 1e.06 N m"),
    ],
)
def test_a_needle_in_two_ways_or_none_is_refused(keys, message):
    with pytest.raises(SceneError, match=message):
        Needle(length=0.2, **keys)


@pytest.mark.parametrize(
    ("part", "key", "allowed", "refused"),
    [
        (lambda x: Needle(length=x, bending_stiffness=1.0, mass_per_length=1.0), "length", (1e-4, 1e2), (9.9e-5, 100.1)),
        (lambda x: Needle(length=1.0, bending_stiffness=x, mass_per_length=1.0), "bending", (1e-10, 1e6), (9e-11, 1.1e6)),
        (lambda x: Needle(length=1.0, bending_stiffness=1.0, mass_per_length=x), "mass", (1e-300, 1e9), (0.0, -1.0)),
        (lambda x: Layer(foundation_modulus=x), "foundation_modulus", (0.0, 1e12), (-1.0, 1.1e12)),
        (lambda x: Layer(foundation_modulus=1.0, damping=x), "damping", (0.0,), (-1e-9,)),
        (lambda x: Layer(foundation_modulus=1.0, cutting_force=x), "cutting_force", (0.0,), (-1e-9,)),
        (lambda x: Layer(foundation_modulus=1.0, start=x), "start", (0.0,), (-1e-9,)),
        (lambda x: Layer(foundation_modulus=1.0, start=0.1, end=x), "end", (0.11,), (0.1, 0.05)),
        (lambda x: Layer(foundation_modulus=1.0, puncture_force=x), "puncture_force", (0.0,), (-1e-9,)),
        (lambda x: Tissue(kind="tip-spring", tip_stiffness=x), "tip_stiffness", (0.0,), (-1e-9,)),
        (lambda x: Support(kind="hub", hub_rotation="free", hub_rotational_inertia=x), "inertia", (1e-12,), (0.0, -1.0)),
        (lambda x: Guide(position=-0.1, stiffness=x), "stiffness", ("rigid", 1e-9), (0.0, -1.0, "loose")),
        (lambda x: Tissue(stiffness_factor=x), "stiffness_factor", (0.0,), (-0.1,)),
        (lambda x: Friction(coulomb=x), "coulomb", (0.0,), (-0.1,)),
        (lambda x: Run(duration=x), "duration", (1e-12, None), (0.0, -1.0)),
        (lambda x: Run(seed=x), "seed", (0, 7), (-1, 0.5)),
        (lambda x: Numerics(elements=x), "elements", (1, 1_000_000, "auto"), (0, 1_000_001, 1.5, 2.0, "many")),
        (lambda x: Numerics(degree=x), "degree", (3, 4), (2, 5)),
        (lambda x: Numerics(time_step=x), "time_step", (1e-9, "auto"), (0.0, -1.0, "fast")),
        (lambda x: Numerics(tolerance=x), "tolerance", (1e-10, 0.1), (9e-11, 0.11)),
        (lambda x: Numerics(absolute_tolerance=x), "absolute_tolerance", (1e-30,), (0.0,)),
        (lambda x: Numerics(spectral_radius=x), "spectral_radius", (0.0, 1.0, "auto"), (-0.1, 1.1, "none")),
        (lambda x: Numerics(output_step=x), "output_step", (1e-9, "auto"), (0.0,)),
        (lambda x: Numerics(output_points=x), "output_points", (2, 100_001), (1, 100_002)),
    ],
)
def test_hard_ranges(part, key, allowed, refused):
    for value in allowed:
        part(value)
    for value in (*refused, float("nan"), float("inf"), True, [1.0]):
        with pytest.raises(SceneError, match=key) as caught:
            part(value)
        assert "allowed" in str(caught.value)


def test_a_message_has_name_value_unit_and_range():
    with pytest.raises(SceneError) as caught:
        Needle(length="300 m", bending_stiffness=1.0, mass_per_length=1.0)
    assert "length: out of range (got '300 m'; allowed 0.0001 to 100 m)" in str(caught.value)


def test_a_mesh_file_needs_its_folder():
    with pytest.raises(SceneError):
        Numerics(mesh="file")


@pytest.mark.parametrize("variant", ["corrected", "as-printed"])
def test_the_variants_of_the_thesis_imply_a_fixed_frame(variant):
    assert Model(variant=variant).kinematics == "fixed-frame"
    assert Model(variant=variant, kinematics="fixed-frame").kinematics == "fixed-frame"
    with pytest.raises(SceneError, match="is fixed-frame"):
        Model(variant=variant, kinematics="material")


@pytest.mark.parametrize("number", [np.float64(0.25), np.float32(0.25), "250 mm", 0.25])
def test_any_real_number_is_stored_as_a_float(number):
    assert type(Guide(position=number).position) is float
    assert Guide(position=number).position == 0.25


def test_an_integer_is_stored_as_one():
    assert type(Numerics(elements=np.int64(4)).elements) is int


def test_parts_are_frozen_and_hashable():
    layer = Layer(foundation_modulus=1.0)
    with pytest.raises(ValidationError, match="frozen"):
        layer.damping = 2.0
    assert hash(layer) == hash(Layer(foundation_modulus=1.0))


def test_sequences_become_tuples():
    assert Tissue(layers=[Layer(foundation_modulus=1.0)]).layers == (Layer(foundation_modulus=1.0),)


@pytest.mark.parametrize(
    ("value", "stored"),
    [
        ({"time": [0, 1], "value": [0, 20], "unit": "mm"}, Table(time=[0, 1], value=[0.0, 0.02])),
        ({"time": [0, "500 ms"], "value": ["1 cm", 2]}, Table(time=[0, 0.5], value=[0.01, 2.0])),
        ({"amplitude": "1 mm", "frequency": 2}, Sinusoid(amplitude=1e-3, frequency=2.0)),
        (
            {"mean": 1, "amplitude": 1, "frequency": "1 kHz", "phase": "180 deg"},
            Sinusoid(mean=1.0, amplitude=1.0, frequency=1e3, phase=pi),
        ),
        ("3 mm", 0.003),
        (3, 3.0),
    ],
)
def test_values_that_vary_in_time(value, stored):
    assert Support(kind="hub", hub_deflection=value).hub_deflection == stored


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"time": [0, 1], "value": [0, 1], "unit": "N"}, "wrong unit.*length"),
        ({"time": [0, 1], "value": [0, 1], "unit": 3}, "wrong unit"),
        ({"time": [0, 1], "value": ["0 m", "1 N"]}, "value.1"),
        ({"time": [0, 1], "value": 3}, "value"),
        ({"amplitude": "1 N", "frequency": 2}, "amplitude"),
        ({"amplitude": 1, "frequency": 0}, "frequency"),
        ({"file": "a.csv", "column": "b"}, "needs a scene in a folder"),
        ({}, "time"),
        ([1, 2], "not a number"),
    ],
)
def test_wrong_values_that_vary_in_time(value, message):
    with pytest.raises(SceneError, match=message):
        Support(kind="hub", hub_deflection=value)


@pytest.mark.parametrize(
    "factor", [Table(time=[0, 1], value=[1.0, -0.1]), Sinusoid(mean=1.0, amplitude=-1.1, frequency=1.0)]
)
def test_the_stiffness_factor_is_never_negative(factor):
    with pytest.raises(SceneError, match=r"stiffness_factor: out of range \(got -0.1; allowed at least 0\)"):
        Tissue(stiffness_factor=factor)


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        ([Layer(foundation_modulus=1.0), Layer(start=0.1, foundation_modulus=1.0)], r"layers.1.start: .*overlap"),
        ([Layer(start=0.1, foundation_modulus=1.0), Layer(end=0.2, foundation_modulus=1.0)], r"layers.0.start: .*0.2 m"),
        (
            [Layer(name="a", end=0.1, foundation_modulus=1.0), Layer(name="a", start=0.1, foundation_modulus=1.0)],
            "names must differ",
        ),
    ],
)
def test_layers_overlap_or_share_a_name(layers, message):
    with pytest.raises(SceneError, match=message):
        Tissue(layers=layers)


def test_layers_may_touch_and_leave_gaps_in_any_order():
    Tissue(
        layers=[
            Layer(start=0.3, foundation_modulus=1.0),
            Layer(start=0.0, end=0.1, foundation_modulus=1.0),
            Layer(start=0.1, end=0.2, foundation_modulus=1.0),
        ]
    )


@pytest.mark.parametrize("keys", [{"hub_deflection": 1e-3}, {"hub_angle": "1 deg"}, {"guides": [Guide(position=-0.1)]}])
def test_nothing_outside_under_entry(keys):
    Support(kind="hub", **keys)
    with pytest.raises(SceneError, match=f"{next(iter(keys))}: .*no meaning under 'entry'"):
        Support(kind="entry", **keys)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"hub_rotation": "free"}, "hub_rotational_inertia: .*required"),
        ({"hub_rotation": "free", "hub_rotational_inertia": 1e-5, "hub_angle": 0.1}, "hub_angle: .*no prescribed angle"),
        ({"hub_torque": 0.1}, "hub_torque: .*no meaning on a fixed hub"),
        ({"hub_rotational_inertia": 1e-5}, "hub_rotational_inertia: .*no meaning on a fixed hub"),
        ({"hub_rotation": "loose"}, "hub_rotation"),
    ],
)
@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_what_a_free_hub_needs_and_a_fixed_one_does_not_have(kind, keys, message):
    with pytest.raises(SceneError, match=message):
        Support(kind=kind, **keys)


@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_a_free_hub(kind):
    free = Support(kind=kind, hub_rotation="free", hub_rotational_inertia="1e-5 kg m^2", hub_torque="2 N mm")
    assert (free.hub_rotational_inertia, free.hub_torque) == (1e-5, pytest.approx(2e-3))


def test_two_guides_at_one_place():
    with pytest.raises(SceneError, match="two guides at one place"):
        Support(kind="hub", guides=[Guide(position=-0.1), Guide(position=-0.1, stiffness=3.0)])


@pytest.mark.parametrize("keys", [{}, {"force": 1.0, "bevel_coefficient": 1.0}])
def test_a_tip_load_is_a_force_or_a_bevel(keys):
    with pytest.raises(SceneError, match="exactly one"):
        TipLoad(**keys)


def test_a_lateral_load_needs_a_force():
    with pytest.raises(SceneError, match="force"):
        LateralLoad(position=-0.1)


def test_tip_displaced_and_its_deflection_belong_together():
    assert Initial(shape="tip-displaced", tip_deflection="1 mm").tip_deflection == 1e-3
    with pytest.raises(SceneError, match="required by shape"):
        Initial(shape="tip-displaced")
    with pytest.raises(SceneError, match="no meaning with shape"):
        Initial(tip_deflection=1e-3)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kind": "hold"}, "initial_depth: .*required"),
        ({"kind": "speed", "initial_depth": 0.1}, "speed: .*required"),
        ({"kind": "speed", "speed": 0.1, "final_depth": 0.2}, "initial_depth: .*required"),
        ({"kind": "profile"}, "depth: .*required"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": 0.1}, "final_depth: .*required by a plain speed"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": -0.1, "final_depth": 0.2}, "not where the speed leads.*below"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": 0.1, "final_depth": 0.1}, "not where the speed leads.*above"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": 0.0, "final_depth": 0.1}, "does not move"),
        ({"kind": "hold", "initial_depth": 0.1, "speed": 0.1}, "speed: .*does not belong.*'hold'"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": 0.1, "depth": 0.1, "final_depth": 1.0}, "depth: .*not belong"),
        ({"kind": "profile", "depth": {"time": [0, 1], "value": [0.1, 0.2]}, "initial_depth": 0.15}, "starts elsewhere"),
        (
            {"kind": "speed", "initial_depth": 0.1, "speed": {"time": [0, 1], "value": [1, 0]}, "final_depth": 1.0},
            "final_depth: .*never reached",
        ),
    ],
)
def test_insertions_that_contradict_themselves(keys, message):
    with pytest.raises(SceneError, match=message):
        Insertion(**keys)


def test_when_an_insertion_ends():
    assert Insertion(kind="hold", initial_depth=0.1).end_time is None
    assert Insertion(kind="speed", initial_depth=0.1, speed=-0.05, final_depth=0.0).end_time == pytest.approx(2.0)
    assert Insertion(kind="profile", depth=Table(time=[0, 7], value=[0.1, 0.2])).end_time == 7.0
    assert Insertion(kind="speed", initial_depth=0.1, speed=Sinusoid(amplitude=0.1, frequency=1)).end_time is None


@pytest.mark.parametrize(
    ("make", "mistakes"),
    [
        (lambda: Layer(foundation_modulus=1.0, dampng=2), ("dampng: unknown key; did you mean 'damping'?",)),
        (
            lambda: Needle(length="200 mmm", bending_stiffness=1.0, mass_per_length=1.0),
            ("length: unknown unit 'mmm'; did you mean 'mm'? (got '200 mmm'; allowed 0.0001 to 100 m)",),
        ),
        (Layer, ("foundation_modulus: is required",)),
        (lambda: Guide(position="1 N", stiffness=-1.0), ("position: ", "stiffness: out of range (got -1; allowed above 0 N/m")),
        (lambda: Tissue(layers=[{"foundation_modulus": 1.0, "dampng": 1.0}]), ("layers.0.dampng: unknown key; did you mean",)),
    ],
)
def test_constructors_tell_what_files_tell(make, mistakes):
    with pytest.raises(SceneError) as caught:
        make()
    assert len(caught.value.mistakes) == len(mistakes)
    assert all(line.startswith(said) for line, said in zip(caught.value.mistakes, mistakes, strict=True)), caught.value.mistakes


@pytest.mark.parametrize(
    ("text", "millimeters"),
    [("18 G", 1.27), ("18G", 1.27), ("14 ga", 2.108), ("22-gauge", 0.7176), ("30 G", 0.3112), ("0.05 in", 1.27)],
)
def test_an_outer_diameter_may_be_a_gauge(text, millimeters):
    needle = Needle(length=0.2, outer_diameter=text, inner_diameter="0.1 mm", youngs_modulus="200 GPa", density=8000)
    assert needle.outer_diameter == pytest.approx(1e-3 * millimeters, rel=1e-15)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"outer_diameter": "99 G"}, r"outer_diameter: is no known gauge; known: 7 G to 30 G \(got '99 G'; allowed above 0 m"),
        ({"inner_diameter": "18 G", "outer_diameter": "2 mm"}, "inner_diameter: .*a gauge is known for an outer diameter alone"),
        ({"length": "0.01 mm"}, r"length: out of range \(got '0.01 mm'; allowed 0.1 to 100000 mm\)"),
        ({"length": "20000 in"}, "length: out of range .*allowed 0.00393701 to 3937.01 in"),
    ],
)
def test_messages_are_in_units_that_were_typed(keys, message):
    with pytest.raises(SceneError, match=message):
        Needle(**({"length": 0.2, "outer_diameter": 1e-3, "youngs_modulus": "200 GPa", "density": 8000} | keys))


@pytest.mark.parametrize("name", ["tip deflection", "Tip-Deflection", "tip_deflection", "image error"])
def test_names_are_understood_as_people_type_them(name):
    found = Controller(kind="pid", input="push force", output=name, gains={"proportional": "1 N/m"})
    assert (found.input, found.output) == ("push_force", "image_error" if "image" in name else "tip_deflection")
