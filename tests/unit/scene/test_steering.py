"""Target, sensors, controller, actuators and scatter of a scene."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest

from fem_needle.cli.settings import changed
from fem_needle.errors import SceneError
from fem_needle.scene import Actuator, Actuators, Controller, Gains, Scatter, Scene, Sensor, Target
from fem_needle.scene.listing import entries
from fem_needle.scene.signals import gain_units, limit_units
from fem_needle.scene.units import parse_unit
from fem_needle.scene_file import parse_scene, save_scene, scene_text
from tests.unit.scene.examples import entry_data, hub_scene

LATERAL = {"kind": "lateral", "position": "-35 mm", "force": 0.0}
TIP = {"kind": "tip-imaging"}
TISSUE = {"kind": "tissue-deformation", "decay_length": "10 mm"}
PID = {"kind": "pid"}


def loop_data(**changes: Any) -> dict[str, Any]:
    """Plain data of a hub scene with a lateral force, a tip image and a PID controller."""
    data = hub_scene().to_dict() | {"loads": [{"kind": "tip", "force": 0.1}, LATERAL], "sensors": [TIP], "controller": PID}
    return data | changes


def loop(**changes: Any) -> Scene:
    return Scene.from_dict(loop_data(**changes))


def everything() -> Scene:
    """A scene with every table of a closed loop, written with units."""
    return loop(
        target={"depth": "150 mm", "lateral": "2 mm"},
        sensors=[
            TIP | {"noise": "0.1 mm", "pixel_size": "0.2 mm", "period": "40 ms", "delay": "60 ms", "dropped_fraction": 0.02},
            TISSUE | {"marker_spacing": "5 mm"},
            {"kind": "base-force", "noise": "10 mN", "resolution": "1 mN"},
            {"kind": "base-moment", "noise": "1 N mm", "resolution": "0.5 N mm"},
            {"kind": "needle-shape", "stations": 21, "pixel_size": "0.1 mm"},
            {"kind": "encoder", "resolution": "10 um", "period": "1 ms"},
        ],
        controller=PID | {"period": "40 ms", "schedule": "model-gain", "gains": {"proportional": "0.02 N/mm"}},
        actuators={"lateral_force": {"minimum": "-2 N", "maximum": "2 N", "rate": "5 N/s"}, "hub_angle": {"maximum": "3 deg"}},
        scatter={"modulus": 0.2, "entry_angle": "1 deg", "speed": 0.1},
    )


def mistakes_of(**changes: Any) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loop(**changes)
    return list(caught.value.mistakes)


@pytest.mark.parametrize(
    ("changes", "mistakes"),
    [
        # Sensors.
        (
            {"sensors": [TIP | {"noise": "0.1 N"}]},
            ["sensors.0.noise: expected length in m, not force (got '0.1 N'; allowed a number of m)"],
        ),
        (
            {"sensors": [TIP, {"kind": "base-force", "resolution": "1 mm"}]},
            ["sensors.1.resolution: expected force in N, not length (got '1 mm'; allowed a number of N)"],
        ),
        ({"sensors": [TIP | {"noise": -1e-4}]}, ["sensors.0.noise: out of range (got -0.0001; allowed at least 0)"]),
        (
            {"sensors": [TIP | {"dropped_fraction": 1.0}]},
            ["sensors.0.dropped_fraction: out of range (got 1; allowed at least 0 and below 1)"],
        ),
        ({"sensors": [TIP | {"period": 0.0}]}, ["sensors.0.period: out of range (got 0; allowed above 0 s)"]),
        (
            {"sensors": [TIP | {"resolution": 1e-3}]},
            [
                "sensors.0.resolution: has no meaning for a sensor of kind 'tip-imaging' "
                "(got 0.001; allowed with base-force, base-moment, encoder)"
            ],
        ),
        (
            {"sensors": [TIP, {"kind": "encoder", "pixel_size": 1e-3, "decay_length": 0.01, "stations": 3}]},
            [
                "sensors.1.pixel_size: has no meaning for a sensor of kind 'encoder' "
                "(got 0.001; allowed with tip-imaging, tissue-deformation, needle-shape)",
                "sensors.1.decay_length: has no meaning for a sensor of kind 'encoder' (got 0.01; allowed with",
                "sensors.1.stations: has no meaning for a sensor of kind 'encoder' (got 3; allowed with needle-shape)",
            ],
        ),
        (
            {"sensors": [TIP, {"kind": "tissue-deformation"}]},
            ["sensors.1.decay_length: is required by kind 'tissue-deformation' (allowed above 0 m)"],
        ),
        ({"sensors": [TIP, TIP]}, ["sensors.1.kind: two sensors read the same (got 'tip-imaging' twice; allowed once)"]),
        ({"sensors": [TIP, {"kind": ["encoder"]}]}, None),
        ({"sensors": [TIP, 3]}, None),
        # Controller.
        (
            {"sensors": []},
            ["sensors: no sensor reads tip_deflection, which the controller needs (add one, such as kind = 'tip-imaging')"],
        ),
        (
            {"controller": PID | {"output": "image_error"}},
            ["sensors: no sensor reads tissue_displacement, which the controller needs"],
        ),
        (
            {"controller": {"kind": "proportional", "variant": "as-printed"}},
            ["sensors: no sensor reads tissue_deformation, which the controller needs"],
        ),
        ({"controller": {"kind": "inverse-dynamics"}}, ["sensors: no sensor reads depth, which the controller needs"]),
        ({"controller": PID | {"schedule": "model-gain"}}, ["sensors: no sensor reads depth, which the controller needs"]),
        (
            {"controller": {"kind": "inverse-dynamics", "schedule": "model-gain"}},
            ["controller.schedule: has no meaning here (got 'model-gain'; allowed 'none', or kind 'pid', "],
        ),
        (
            {"controller": {"kind": "proportional", "variant": "as-printed", "schedule": "model-gain"}},
            ["controller.schedule: has no meaning here"],
        ),
        ({"controller": {"kind": "none", "schedule": "model-gain"}}, ["controller.schedule: has no meaning here"]),
        (
            {"controller": PID | {"gains": {"increment": 0.1, "rate": 5.0}}},
            [
                "controller.gains.rate: does not belong to a controller of kind 'pid' "
                "(got 5; allowed proportional, integral, derivative, filter_time)",
                "controller.gains.increment: does not belong to a controller of kind 'pid'",
            ],
        ),
        (
            {"controller": {"gains": {"rate": 1.0}}},
            ["controller.gains.rate: does not belong to a controller of kind 'none' (got 1; allowed none)"],
        ),
        (
            {"controller": PID | {"gains": {"proportional": "20 N"}}},
            ["controller.gains.proportional: expected force per length in N/m, not force (got '20 N'; allowed a number of N/m)"],
        ),
        (
            {"controller": {"kind": "incremental", "gains": {"smallest_error": "1 N", "increment": "1 mm"}}},
            [
                "controller.gains.smallest_error: expected length in m, not force (got '1 N'; allowed a number of m)",
                "controller.gains.increment: expected force in N, not length (got '1 mm'; allowed a number of N)",
            ],
        ),
        (
            {"controller": PID | {"variant": "realizable"}},
            ["controller.variant: does not belong to a controller of kind 'pid' (got 'realizable'; allowed none)"],
        ),
        (
            {"controller": {"kind": "incremental", "variant": "as-printed"}},
            ["controller.variant: does not belong to a controller of kind 'incremental' (got 'as-printed'; allowed 'intended')"],
        ),
        (
            {"controller": PID | {"output": "needle_shape"}},
            ["controller.output: is no number that a sensor reads (got 'needle_shape'; allowed tip_deflection, needle_angle, "],
        ),
        (
            {"controller": PID | {"input": "force"}},
            ["controller.input: is not a choice (got 'force'; allowed 'push_force', 'speed',"],
        ),
        ({"controller": PID | {"input": ["speed"], "output": {"a": 1}, "gains": {"increment": "1 N"}}}, None),
        # Inputs that this scene has not: its insertion has a speed, its hub is fixed.
        ({"controller": PID | {"input": "push_force"}}, ["controller.input: 'push_force' needs insertion.kind = 'force'"]),
        (
            {"controller": PID | {"input": "hub_torque"}},
            ["controller.input: 'hub_torque' needs the support 'hub' with hub_rotation = 'free'"],
        ),
        ({"loads": [LATERAL, LATERAL]}, ["controller.input: 'lateral_force' needs one load of kind 'lateral' (got 2)"]),
        (
            {"loads": [LATERAL], "controller": PID | {"input": "tip_direction"}},
            ["controller.input: 'tip_direction' needs a load of kind 'tip'"],
        ),
        ({"actuators": {"push_force": {"maximum": "1 N"}}}, ["actuators.push_force: needs insertion.kind = 'force'"]),
        ({"actuators": {"push": {"maximum": 1.0}}}, ["actuators.push: unknown key; did you mean 'push_force'?"]),
        (
            {"actuators": {"lateral_force": {"minimum": 1.0, "maximum": "1 N"}}},
            ["actuators.lateral_force.maximum: leaves no range (got 1; allowed above minimum = 1)"],
        ),
        (
            {"actuators": {"lateral_force": {"rate": "1 N"}, "hub_angle": {"maximum": 3.0, "rate": "3 deg"}}},
            ["actuators.lateral_force.rate: expected force per time in N/s, not force (got '1 N'; allowed a number of N/s)"],
        ),
        # Target and scatter.
        ({"target": {"depth": "201 mm"}}, ["target.depth: deeper than the needle is long (got 0.201; allowed 0 to 0.2 m)"]),
        ({"target": {"depth": 0.0}}, ["target.depth: out of range (got 0; allowed above 0 m)"]),
        ({"scatter": {"modulus": 1.1}}, ["scatter.modulus: out of range (got 1.1; allowed 0 to 1)"]),
    ],
)
def test_a_mistake_says_what_and_where(changes, mistakes):
    found = mistakes_of(**changes)
    if mistakes is not None:
        assert len(found) == len(mistakes)
        assert all(line.startswith(expected) for line, expected in zip(found, mistakes, strict=True))


def test_a_loop_under_entry_has_fewer_inputs_and_no_angle_at_the_entry():
    insertion = {"kind": "speed", "initial_depth": 0.02, "speed": 0.01, "final_depth": 0.16}
    data = entry_data(insertion=insertion, sensors=[TIP], controller=PID | {"input": "speed"})
    assert Scene.from_dict(data).controller.input == "speed"
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(data | {"controller": PID | {"input": "hub_angle"}, "scatter": {"entry_angle": "1 deg"}})
    assert caught.value.mistakes == (
        "scatter.entry_angle: needs the support 'hub' with hub_rotation = 'fixed' (got 0.0174533; allowed 0 rad)",
        "controller.input: 'hub_angle' needs the support 'hub' with hub_rotation = 'fixed'",
    )


def test_a_free_hub_has_no_angle_that_repetitions_could_turn():
    free = hub_scene().to_dict()["support"] | {"hub_rotation": "free", "hub_rotational_inertia": 1e-3, "hub_angle": 0.0}
    expected = "scatter.entry_angle: needs the support 'hub' with hub_rotation = 'fixed' (got 0.002; allowed 0 rad)"
    assert mistakes_of(support=free, scatter={"entry_angle": 0.002}) == [expected]
    assert loop(support=free, scatter={"entry_angle": 0.0, "modulus": 0.1}).scatter.modulus == 0.1


def test_texts_with_units_are_si():
    scene = everything()
    tip, tissue, force, moment, shape, encoder = scene.sensors
    assert (tip.noise, tip.pixel_size, tip.period, tip.delay) == (1e-4, 2e-4, 0.04, 0.06)
    assert (tissue.decay_length, tissue.marker_spacing) == (0.01, 0.005)
    assert (force.noise, force.resolution, moment.noise, moment.resolution) == (0.01, 1e-3, 1e-3, 5e-4)
    assert (shape.stations, shape.pixel_size, encoder.resolution) == (21, 1e-4, 1e-5)
    assert scene.controller.gains.proportional == 20.0
    assert scene.actuators.lateral_force == Actuator(minimum=-2.0, maximum=2.0, rate=5.0)
    assert scene.actuators.hub_angle.maximum == pytest.approx(pi / 60.0, rel=1e-15)
    assert scene.target == Target(depth=0.15, lateral=2e-3)
    assert scene.scatter == Scatter(modulus=0.2, entry_angle=pi / 180.0, speed=0.1)


def test_the_parts_built_in_python_are_those_of_a_file():
    scene = everything()
    assert scene.sensors[1] == Sensor(kind="tissue-deformation", decay_length=0.01, marker_spacing=0.005)
    gains = Gains(proportional=20.0)
    assert scene.controller == Controller(kind="pid", period=0.04, schedule="model-gain", gains=gains)
    assert Actuators(hub_angle={"maximum": "180 deg"}).hub_angle.maximum == pi


def test_a_scene_without_a_loop_has_an_empty_one():
    scene = hub_scene()
    assert (scene.sensors, scene.controller.kind, scene.actuators) == ((), "none", Actuators())
    assert (scene.target, scene.scatter) == (Target(), Scatter())
    assert scene.to_dict().keys() & {"sensors", "controller", "actuators", "target", "scatter"} == set()


def test_a_round_trip_through_toml_loses_nothing(tmp_path):
    scene = everything()
    save_scene(scene, tmp_path / "scene.toml")
    assert parse_scene((tmp_path / "scene.toml").read_text()) == scene
    assert Scene.from_dict(scene.to_dict()) == scene
    assert "image_error" not in scene_text(scene)
    # The defaults of every key are written and read again, those of other kinds too.
    assert 'schedule = "model-gain"' in (tmp_path / "scene.toml").read_text()


def test_the_schema_has_units_and_ranges_of_a_loop():
    schema = Scene.model_json_schema()
    parts = schema["$defs"]
    assert {"target", "sensors", "controller", "actuators", "scatter"} <= schema["properties"].keys()
    assert {"Target", "Sensor", "Controller", "Gains", "Actuators", "Actuator", "Scatter"} <= parts.keys()
    period = {"type": "number", "exclusiveMinimum": 0.0, "description": "in s"}
    assert parts["Sensor"]["properties"]["period"]["anyOf"][0] == period
    assert parts["Controller"]["properties"]["kind"]["enum"] == ["none", "pid", "inverse-dynamics", "incremental", "proportional"]


@pytest.mark.parametrize(
    ("assignment", "path", "value"),
    [
        ("sensors.0.noise=0.3 mm", "sensors.0.noise", 3e-4),
        ("sensors.0.noise=3e-4", "sensors.0.noise", 3e-4),
        ("controller.gains.proportional=35", "controller.gains.proportional", 35.0),
        ("controller.gains.proportional=0.035 N/mm", "controller.gains.proportional", 35.0),
        ("controller.gains.integral=7 N/m s", "controller.gains.integral", 7.0),
        ("actuators.hub_angle.rate=180 deg/s", "actuators.hub_angle.rate", pi),
        ("target.lateral=-1 mm", "target.lateral", -1e-3),
        ("scatter.modulus=0.5", "scatter.modulus", 0.5),
    ],
)
def test_values_are_set_by_path(assignment, path, value):
    found = {entry.path: entry.value for entry in entries(changed(loop(), [assignment], {}))}
    assert found[path] == pytest.approx(value, rel=1e-15)


def test_set_knows_the_keys_of_a_loop():
    for assignment, message in (
        ("sensors.0.nois=1", "did you mean 'noise'"),
        ("sensors.1.noise=1", "no entry '1'"),
        ("controller.gain.proportional=1", "did you mean 'gains'"),
        ("actuators.lateral_force.maxi=1", "did you mean 'maximum'"),
    ):
        with pytest.raises(SceneError, match=message):
            changed(loop(), [assignment], {})


def test_a_listing_has_the_unit_of_what_is_read_and_commanded_and_no_key_without_meaning():
    units = {entry.path: entry.quantity.unit for entry in entries(everything()) if entry.quantity}
    assert units["sensors.0.noise"] == units["sensors.5.resolution"] == "m"
    assert (units["sensors.2.noise"], units["sensors.3.resolution"]) == ("N", "N m")
    assert units["controller.gains.proportional"] == "N/m"
    assert (units["actuators.hub_angle.maximum"], units["actuators.lateral_force.rate"]) == ("rad", "N/s")
    assert {"sensors.0.resolution", "sensors.0.stations", "sensors.2.pixel_size"} & units.keys() == set()
    assert {"sensors.4.stations", "sensors.1.decay_length", "sensors.2.resolution"} <= units.keys()


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (("lateral_force", "tip_deflection"), ("N/m", "N/m s", "N s/m", "m", "N")),
        (("hub_deflection", "tip_deflection"), ("1", "1/s", "s", "m", "m")),
        (("speed", "depth"), ("1/s", "1/s^2", "1", "m", "m/s")),
        (("hub_torque", "hub_moment"), ("1", "1/s", "s", "N m", "N m")),
        (("hub_angle", "image_error"), ("rad/m", "rad/m s", "rad s/m", "m", "rad")),
        (("tip_direction", "needle_angle"), ("1/rad", "1/rad s", "s/rad", "rad", "1")),
    ],
)
def test_units_of_gains(names, units):
    found = gain_units(*names)
    keys = ("proportional", "integral", "derivative", "smallest_error", "increment")
    assert tuple(found[key] for key in keys) == units
    # A gain times what it multiplies has the dimension of the command.
    (mass, length, time, angle), above = parse_unit(found["integral"]).dimension, parse_unit(found["smallest_error"]).dimension
    product = (mass + above[0], length + above[1], time + above[2] + 1, angle + above[3])
    assert product == parse_unit(found["increment"]).dimension


def test_units_of_limits():
    assert limit_units("speed") == {"minimum": "m/s", "maximum": "m/s", "rate": "m/s^2"}
    assert limit_units("tip_direction") == {"minimum": "1", "maximum": "1", "rate": "1/s"}
    assert limit_units("hub_torque")["rate"] == "N m/s"


def test_thresholds_of_the_printed_program_count_pixels():
    printed = {"kind": "proportional", "variant": "as-printed", "gains": {"smallest_change": 0.5, "proportional": "1 N"}}
    gains = loop(sensors=[TIP, TISSUE], controller=printed).controller.gains
    assert (gains.smallest_change, gains.proportional) == (0.5, 1.0)
    (line,) = mistakes_of(sensors=[TIP, TISSUE], controller=printed | {"gains": {"smallest_change": "1 mm"}})
    assert "smallest_change: is a plain number" in line
