"""The whole scene: checks between the parts, values by path, plain data."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fem_needle.errors import SceneError
from fem_needle.scene import Guide, Insertion, LateralLoad, Layer, Model, Run, Scene, Support, Table, TipLoad, Tissue
from tests.unit.scene.examples import entry_data, hub_scene, scene_data

SINUSOID = {"mean": 0.0, "amplitude": 0.01, "frequency": 1.0}


def mistakes_of(data: dict[str, Any]) -> tuple[str, ...]:
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(data)
    return caught.value.mistakes


def test_the_duration_is_that_of_the_insertion_or_the_run():
    assert hub_scene().duration == pytest.approx(14.0)
    assert hub_scene(run=Run(duration=3.0)).duration == 3.0


def test_python_construction_raises_a_value_error_with_the_meeting_depth():
    with pytest.raises(ValueError, match=r"hub meets the guide at the depth 0.17 m .*allowed above -0.02 m"):
        hub_scene(insertion=Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.18))


@pytest.mark.parametrize(
    ("final_depth", "position", "possible"),
    [(0.16, -0.04, False), (0.16, -0.0399, True), (0.2, 0.0, False), (0.199, 0.0, True)],
)
def test_the_hub_stays_before_a_lateral_force(final_depth, position, possible):
    insertion = Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=final_depth)
    changes = {"support": Support(kind="hub"), "insertion": insertion, "loads": [LateralLoad(position=position, force=1.0)]}
    if possible:
        hub_scene(**changes)
    else:
        with pytest.raises(ValueError, match="hub meets the lateral force"):
            hub_scene(**changes)


def test_a_run_that_stops_before_the_meeting_is_possible():
    insertion = Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.18)
    hub_scene(insertion=insertion, run=Run(duration=14.9))
    with pytest.raises(ValueError, match="hub meets"):
        hub_scene(insertion=insertion, run=Run(duration=15.1))


@pytest.mark.parametrize(
    ("position", "possible"),
    [(-0.01, True), (0.0, True), (1e-9, False), (0.02, False), (0.03, True), (0.0399, True), (0.04, False), (0.06, True)],
)
def test_guides_and_forces_lie_outside_the_tissue(position, possible):
    """Layers 0 to 30 mm and 40 to 60 mm; on the needle all the time (70 mm deep)."""
    layers = [Layer(end=0.03, foundation_modulus=1.0), Layer(start=0.04, end=0.06, foundation_modulus=1.0)]
    common = {
        "tissue": Tissue(layers=layers),
        "insertion": Insertion(kind="hold", initial_depth=0.07),
        "run": Run(duration=1.0),
    }
    guide = {"support": Support(kind="hub", guides=[Guide(position=position)])}
    force = {"support": Support(kind="hub"), "loads": [LateralLoad(position=position, force=1.0)]}
    for changes in (guide, force):
        if possible:
            hub_scene(**common, **changes)
        else:
            with pytest.raises(ValueError, match=f"inside the tissue .got {position:g}; allowed at most"):
                hub_scene(**common, **changes)


def test_a_guide_beyond_the_tissue_is_on_the_needle_all_the_time():
    tissue = Tissue(layers=[Layer(end=0.03, foundation_modulus=1.0)])
    support = Support(kind="hub", guides=[Guide(position=0.05)])
    insertion = Insertion(kind="profile", depth=Table(time=[0, 1, 2], value=[0.1, 0.06, 0.1]))
    hub_scene(tissue=tissue, support=support, insertion=insertion)
    lower = Insertion(kind="profile", depth=Table(time=[0, 1, 2], value=[0.1, 0.04, 0.1]))
    with pytest.raises(ValueError, match=r"not always on the needle .*at most 0.04 m"):
        hub_scene(tissue=tissue, support=support, insertion=lower)


@pytest.mark.parametrize(
    ("insertion", "message"),
    [
        ({"kind": "hold", "initial_depth": 0.21}, "insertion.initial_depth: deeper than the needle is long"),
        ({"kind": "speed", "initial_depth": 0.1, "speed": 1, "final_depth": 0.3}, "insertion.final_depth: deeper"),
        # The integral of the speed rises by 0.15 in the first second, then falls.
        (
            {"kind": "speed", "initial_depth": 0.1, "speed": {"time": [0, 1, 1.5], "value": [0.3, 0, -0.5]}},
            "insertion.speed: the depth leaves the needle in the run (reaches 0.25; allowed 0 to 0.2 m",
        ),
        ({"kind": "speed", "initial_depth": 0.1, "speed": {"time": [0, 1], "value": [-0.3, 0]}}, "reaches -0.05"),
        ({"kind": "profile", "depth": {"time": [0, 1, 2], "value": [0.1, 0.21, 0.1]}}, "insertion.depth: "),
        # 0.1 + 0.2/pi (1 - cos(2 pi t)) / 2 reaches 0.1 + 0.2/pi = 0.1637; 0.4/pi more is too deep.
        ({"kind": "speed", "initial_depth": 0.1, "speed": SINUSOID | {"amplitude": 0.4}}, "reaches 0.227323954"),
    ],
)
def test_the_depth_stays_on_the_needle(insertion, message):
    (line,) = mistakes_of(entry_data(insertion=insertion))
    assert message in line


def test_a_depth_may_end_at_the_length_to_rounding():
    speed = {"time": [0.0, 1.0], "value": [0.1, 0.1]}
    for start in (0.1, 0.1 + 1e-14):
        Scene.from_dict(entry_data(insertion={"kind": "speed", "initial_depth": start, "speed": speed}))


@pytest.mark.parametrize(
    "insertion",
    [
        {"kind": "hold", "initial_depth": 0.1},
        {"kind": "profile", "depth": 0.1},
        {"kind": "speed", "initial_depth": 0.1, "speed": SINUSOID},
        {"kind": "profile", "depth": SINUSOID | {"mean": 0.1}},
    ],
)
def test_an_insertion_without_an_end_needs_a_duration(insertion):
    Scene.from_dict(entry_data(insertion=insertion))
    (line,) = mistakes_of(entry_data(insertion=insertion, run={}))
    assert line.startswith("run.duration: is required")


def test_a_push_needs_a_final_depth_or_a_duration():
    push = {"kind": "force", "initial_depth": 0.1, "push_force": "1 N"}
    Scene.from_dict(entry_data(insertion=push))
    Scene.from_dict(entry_data(insertion=push | {"final_depth": 0.15}, run={}))
    (line,) = mistakes_of(entry_data(insertion=push, run={}))
    assert line.startswith("run.duration: is required")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"final_depth": 0.1}, "insertion.final_depth: a push ends deeper than it began (got 0.1; allowed above initial"),
        ({"final_depth": 0.05}, "insertion.final_depth: a push ends deeper"),
        ({"final_depth": 0.21}, "insertion.final_depth: deeper than the needle is long"),
        ({"initial_depth": 0.21}, "insertion.initial_depth: deeper than the needle is long"),
    ],
)
def test_where_a_push_may_end(changes, message):
    push = {"kind": "force", "initial_depth": 0.1, "push_force": 1.0}
    assert message in mistakes_of(entry_data(insertion=push | changes))[0]


def test_what_has_history_or_motion_is_not_static():
    static = {"numerics": {"analysis": "static"}}
    push = {"kind": "force", "initial_depth": 0.1, "push_force": 1.0}
    cut = {"rest_line": "cut-path", "layers": [{"foundation_modulus": 520.0}]}
    lines = mistakes_of(entry_data(insertion=push, tissue=cut, **static))
    assert [line.split("(")[0].strip() for line in lines] == [
        "numerics.analysis: a push needs motion",
        "numerics.analysis: a cut path needs history",
    ]


def test_entry_has_no_lateral_force_and_hub_no_fixed_frame():
    load = {"kind": "lateral", "position": -0.01, "force": 1.0}
    assert "loads.0.kind" in mistakes_of(entry_data(loads=[load]))[0]
    Scene.from_dict(entry_data(model={"kinematics": "fixed-frame"}))
    with pytest.raises(ValueError, match="fixed-frame"):
        hub_scene(model=Model(kinematics="fixed-frame"))


def test_nothing_inserted_cannot_be_displaced():
    shape = {"shape": "tip-displaced", "tip_deflection": 1e-3}
    Scene.from_dict(entry_data(initial=shape))
    (line,) = mistakes_of(entry_data(initial=shape, insertion={"kind": "hold", "initial_depth": 0.0}))
    assert line.startswith("initial.shape: nothing inserted")


def test_all_mistakes_at_once_each_with_its_path():
    data = entry_data(
        needle={"lenght": 0.2, "bending_stiffness": "2 mm", "mass_per_length": -1.0},
        tissue={"layers": [{"foundation_modulus": float("nan")}, {"foundation_modulus": "1 kPa", "dampng": 1}]},
        loads=[{"kind": "tip", "forse": 1}, {"kind": "side"}, {"force": 1}, 3],
        extra=1,
        numerics={"elements": True, "time_step": "auto?", "output_points": 1},
        insertion="fast",
    )
    del data["support"]
    expected = {
        "needle.lenght: unknown key; did you mean 'length'?",
        "needle.length: is required",
        "needle.bending_stiffness: expected bending stiffness in N m^2, not length "
        "(got '2 mm'; allowed 1e-10 to 1e+06 N m^2)",
        "needle.mass_per_length: out of range (got -1; allowed above 0 kg/m)",
        "tissue.layers.0.foundation_modulus: is not finite (got nan; allowed 0 to 1e+12 N/m^2)",
        "tissue.layers.1.dampng: unknown key; did you mean 'damping'?",
        "loads.0.forse: unknown key; did you mean 'force'?",
        "loads.1: kind is not a choice (got 'side'; allowed 'tip', 'lateral')",
        "loads.2: needs a kind (allowed 'tip' or 'lateral')",
        "numerics.elements: is not a number (got True; allowed whole number, 1 to 1e+06 or 'auto')",
        "numerics.time_step: is not an allowed word (got 'auto?'; allowed above 0 s or 'auto')",
        "numerics.output_points: out of range (got 1; allowed whole number, 2 to 100001)",
        "insertion: is not a table of keys (got 'fast')",
        "support: is required",
    }
    found = set(mistakes_of(data))
    assert expected <= found
    assert len(found) == len(expected) + 2  # loads.3 and extra
    assert any(line.startswith("loads.3: ") for line in found)
    assert any(line.startswith("extra: unknown key") for line in found)


def test_cross_checks_come_all_at_once():
    lines = mistakes_of(
        hub_scene().to_dict()
        | {"model": {"kinematics": "fixed-frame"}, "loads": [{"kind": "lateral", "position": 0.01, "force": 1}]}
    )
    assert [line.split(":")[0] for line in lines] == ["loads.0.position", "model.kinematics"]


@pytest.mark.parametrize("data", [None, [], "x", 3])
def test_what_is_no_table_of_keys(data):
    assert mistakes_of(data) == (f"scene: is not a table of keys (got {data!r})",)


@pytest.mark.parametrize(
    ("path", "value", "read"),
    [
        ("tissue.layers.0.foundation_modulus", 800.0, lambda scene: scene.tissue.layers[0].foundation_modulus == 800.0),
        ("tissue.layers.gel.foundation_modulus", "0.8 kPa", lambda scene: scene.tissue.layers[0].foundation_modulus == 800.0),
        ("numerics.elements", 40, lambda scene: scene.numerics.elements == 40),
        ("loads.0.force", Table(time=[0, 1], value=[0, 1]), lambda scene: isinstance(scene.loads[0].force, Table)),
        ("loads", (), lambda scene: scene.loads == ()),
        ("tissue.layers.0.end", "50 mm", lambda scene: scene.tissue.layers[0].end == 0.05),
        ("support.guides.0.stiffness", 1e3, lambda scene: scene.support.guides[0].stiffness == 1e3),
        ("title", "other", lambda scene: scene.title == "other"),
    ],
)
def test_with_value_changes_one_value(path, value, read):
    scene = hub_scene()
    changed = scene.with_value(path, value)
    assert read(changed)
    assert not read(scene)


def test_with_value_recomputes_what_follows():
    scene = hub_scene()
    changed = scene.with_value("needle.youngs_modulus", 100e9)
    assert changed.needle.bending_stiffness == pytest.approx(scene.needle.bending_stiffness / 2)
    assert changed.with_value("needle.youngs_modulus", 200e9) == scene


def test_with_value_none_removes_a_key():
    scene = hub_scene().with_value("tissue.layers.0.end", 0.05)
    assert scene.with_value("tissue.layers.0.end", None) == hub_scene()


def test_several_values_at_once_may_pass_through_the_impossible():
    values = {"insertion.kind": "hold", "insertion.speed": None, "insertion.final_depth": None, "run.duration": 1}
    assert hub_scene().with_values(values).insertion.kind == "hold"


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("tisue.layers.0.damping", "tisue.layers.0.damping: unknown key; did you mean 'tissue'?"),
        ("tissue.layers.0.dampin", "did you mean 'damping'?"),
        ("tissue.layers.1.damping", "no entry '1' (allowed gel)"),
        ("tissue.layers.bone.damping", "no entry 'bone' (allowed gel)"),
        ("tissue.layers.-1.damping", "no entry '-1'"),
        ("loads.7.force", "no entry '7' (allowed 0)"),
        ("needle.length.unit", "nothing inside a single value"),
        ("", "unknown key"),
        ("needle", "needle: is not a table of keys (got 1)"),
    ],
)
def test_with_value_on_an_unknown_path(path, message):
    with pytest.raises(SceneError) as caught:
        hub_scene().with_value(path, 1.0)
    assert message in str(caught.value)


def test_with_value_checks_again():
    with pytest.raises(SceneError, match="hub meets the guide"):
        hub_scene().with_value("insertion.final_depth", 0.19)


def test_plain_data_has_what_was_given_and_no_more():
    data = hub_scene().to_dict()
    assert set(data) == {"needle", "support", "tissue", "insertion", "loads"}
    assert set(data["needle"]) == {"length", "youngs_modulus", "outer_diameter", "inner_diameter", "density"}
    assert data["loads"] == [{"kind": "tip", "force": 0.1}]


@given(scene_data())
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_plain_data_lose_nothing(data):
    scene = Scene.from_dict(data)
    assert Scene.from_dict(scene.to_dict()) == scene
    assert Scene.from_dict(scene.to_dict(complete=True)) == scene


PATHS = st.sampled_from(
    [
        ("needle",), ("needle", "length"), ("needle", "density"), ("support", "kind"), ("support", "guides"),
        ("support", "hub_angle"), ("tissue",), ("tissue", "layers"), ("tissue", "stiffness_factor"), ("insertion",),
        ("insertion", "kind"), ("insertion", "speed"), ("insertion", "depth"), ("insertion", "initial_depth"), ("loads",),
        ("initial", ), ("initial", "shape"), ("run", "duration"), ("model",), ("numerics", "elements"), ("title",),
        ("format_version",), ("friction",), ("unknown",), ("numerics", "unknown"),
        ("sensors",), ("controller",), ("controller", "kind"), ("controller", "gains"), ("controller", "input"), ("target",),
        ("actuators",), ("actuators", "speed"), ("scatter",),
    ]
)  # fmt: skip
KEYS = st.sampled_from(["time", "value", "unit", "mean", "amplitude", "frequency", "phase", "file", "column", "kind", "x"])
LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.binary(max_size=3),
    st.sampled_from(["auto", "rigid", "1 mm", "3 N", "hub", "entry", "tip", "1e999 m", "speed", 10**400]),
)  # fmt: skip
JUNK = st.recursive(
    LEAVES, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(KEYS, inner, max_size=4)), max_leaves=8
)


@given(scene_data(), PATHS, JUNK)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_junk_anywhere_is_a_scene_or_a_scene_error(data, path, junk):
    broken = dict(data)
    if len(path) == 2:
        broken[path[0]] = dict(broken.get(path[0], {})) | {path[1]: junk}
    else:
        broken[path[0]] = junk
    try:
        scene = Scene.from_dict(broken)
    except SceneError as error:
        assert error.mistakes
        assert all(": " in line for line in error.mistakes)
    else:
        assert Scene.from_dict(scene.to_dict()) == scene


def test_several_tip_loads_are_allowed():
    assert len(hub_scene(loads=[TipLoad(force=1.0), TipLoad(bevel_coefficient=1e-5)]).loads) == 2
