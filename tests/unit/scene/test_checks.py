import pytest

from fem_needle import shipped
from fem_needle.checks import notes, suspicious, warn_if_suspicious
from fem_needle.errors import SceneError, SuspiciousValueWarning
from fem_needle.scene import Controller, Friction, Guide, Insertion, LateralLoad, Layer, Run, Sensor, Support, Tissue
from fem_needle.scene_file import load_scene, parse_scene
from tests.unit.scene.examples import hub_scene

HELD = Support(kind="hub")  # without a guide


@pytest.mark.parametrize("name", shipped.shipped_names())
def test_shipped_scenes_are_not_suspicious(name):
    """But for the pushes, which are above the Euler load of the free part: theirs is what the literature says."""
    pushed = load_scene(name).insertion.kind == "force"
    assert [line for line in suspicious(load_scene(name)) if not (pushed and "may buckle" in line)] == []


def test_the_template_is_not_suspicious():
    assert suspicious(parse_scene(shipped.template_text())) == ()


@pytest.mark.parametrize(
    ("values", "inequality", "guess"),
    [
        ({"tissue.layers.0.end": 50.0}, "tissue.layers.0.end = 50 m > 1 m", "looks like mm"),
        ({"needle.length": 2.0, "support.guides": None}, "needle.length = 2 m > 1 m", "looks like mm"),
        ({"needle.youngs_modulus": 2e5, "loads": []}, "needle.youngs_modulus = 200000 Pa < 1e6 Pa", "looks like GPa"),
        ({"support.hub_angle": 2.0}, "support.hub_angle = 2 rad > 0.5 rad", "looks like degrees"),
        ({"support.hub_angle": {"time": [0, 1], "value": [0, -2]}}, "= 2 rad > 0.5 rad", "looks like degrees"),
        ({"tissue.layers.0.foundation_modulus": 2e6}, "2e+06 N/m^2 > 1e6 N/m^2", "looks like a Young's modulus"),
        ({"insertion.speed": 10.0}, "insertion.speed = 10 m/s >= 5 m/s", "looks like mm/s"),
        ({"insertion.speed": 5.0}, "insertion.speed = 5 m/s >= 5 m/s", "looks like mm/s"),
        ({"loads.0.force": {"time": [1.7e9, 1.8e9], "value": [0, 1]}}, "begins at 1700000000 s", "seconds since 1970"),
        ({"loads.0.force": {"time": [0, 14000], "value": [0, 1]}}, "has one of its 2 points", "another unit of time"),
        ({"loads.0.force": {"time": [20, 30], "value": [0.1, 0.2]}}, "has none of its 2 points", "another unit of time"),
        ({"needle.outer_diameter": 0.021}, "outer_diameter = 0.021 m > length / 10 = 0.02 m", "too thick"),
        ({"tissue.layers.0.end": 1e-4}, "thickness 0.0001 m < needle.length / 1000 = 0.0002 m", "thin"),
        ({"numerics.time_step": 15.0}, "numerics.time_step = 15 s > 14 s", "duration"),
        ({"numerics.output_step": 15.0}, "numerics.output_step = 15 s > 14 s", "duration"),
        ({"loads.0.force": 20.0}, "the tip force 20 N bends", "too much for small deflections"),
        ({"loads.0.force": None, "loads.0.bevel_coefficient": 20 / 520}, "the tip force 20 N bends", "too much"),
    ],
)
def test_a_suspicious_value_names_its_inequality(values, inequality, guess):
    (message,) = [line for line in suspicious(hub_scene().with_values(values)) if inequality in line]
    assert guess in message


def test_the_euler_load_of_the_free_part():
    """Pi^2 EI / (2 L)^2 with EI = 0.01572216 and L = 0.18 m: 1.19730 N."""
    below, above = (hub_scene(support=HELD, friction=Friction(coulomb=push)) for push in (1.197, 1.1975))
    assert suspicious(below) == ()
    (message,) = suspicious(above)
    assert "1.2 N > 1.2 N, the Euler load" in message


def test_the_push_adds_friction_and_cutting():
    """0.2 + 20 N/m 0.02 m + (10 + 500 0.02) N s/m 0.01 m/s + 0.4 N = 1.2 N > 1.1973 N."""
    friction = Friction(coulomb=0.2, coulomb_per_length=20.0, viscous=10.0, viscous_per_length=500.0)
    layer = Layer(foundation_modulus=520.0, cutting_force=0.4)
    way = Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.0201)
    short = {"support": HELD, "friction": friction, "insertion": way}
    assert any("Euler" in line for line in suspicious(hub_scene(**short, tissue=Tissue(layers=[layer]))))
    lower = Layer(foundation_modulus=520.0, cutting_force=0.39)
    assert suspicious(hub_scene(**short, tissue=Tissue(layers=[lower]))) == ()


def test_the_free_part_ends_at_a_rigid_guide():
    """From hub to guide 0.15 m: 20.19 EI / L^2 = 14.11 N with EI = 0.01572216; behind it pi^2 EI / 0.03^2 = 172 N."""
    guide = Guide(position=-0.03)
    guided = Support(kind="hub", guides=[guide])
    below, above = (hub_scene(support=guided, friction=Friction(coulomb=push)) for push in (14.1, 14.2))
    assert suspicious(below) == ()
    (message,) = suspicious(above)
    assert "14.1 N, the Euler load 20.19 EI / L^2 of the part from hub to guide (L = 0.15 m)" in message


def test_the_cutting_force_counts_where_the_tip_is_in_its_layer():
    """A layer at 0.1 m that takes 4 N: there 0.1 m are free, whose Euler load is 3.88 N, and not 1.2 N as at 0.02 m."""

    def of(force):
        layers = [Layer(foundation_modulus=520.0, end=0.1), Layer(start=0.1, foundation_modulus=520.0, cutting_force=force)]
        return suspicious(hub_scene(support=HELD, tissue=Tissue(layers=layers)))

    assert of(3.8) == ()
    (message,) = of(4.0)
    assert "at 0.1 m, 4 N > 3.88 N" in message


def test_a_bevel_on_a_straight_line_has_a_note_and_no_warning():
    scene = load_scene("three-layers")
    (note,) = notes(scene)
    assert "loads.0.bevel_coefficient" in note and "tissue.rest_line = 'cut-path'" in note and suspicious(scene) == ()
    assert notes(scene.with_value("tissue.rest_line", "cut-path")) == notes(load_scene("thesis")) == ()


def test_a_needle_that_is_wholly_inserted_has_no_free_part():
    scene = hub_scene(support=Support(kind="entry"), friction=Friction(coulomb=9.0), run=Run(duration=1.0))
    values = {"insertion.kind": "hold", "insertion.initial_depth": 0.2, "insertion.speed": None, "insertion.final_depth": None}
    assert suspicious(scene.with_values(values)) == ()


def test_warnings_are_issued():
    scene = hub_scene().with_value("support.hub_angle", 2.0)
    with pytest.warns(SuspiciousValueWarning, match="looks like degrees"):
        assert len(warn_if_suspicious(scene)) == 1


def steered(every, **sensor):
    """A loop of 14 s over a tip image and an encoder, with a lateral force before the guide."""
    loads = [LateralLoad(position=-0.035, force=0.0)]
    sensors = [Sensor(kind="encoder", period=0.001), Sensor(kind="tip-imaging", **sensor)]
    return hub_scene(loads=loads, sensors=sensors, controller=Controller(kind="pid", period=every))


@pytest.mark.parametrize(
    ("every", "sensor", "message"),
    [
        (2.0, {"period": 14.1}, "sensors.1.period = 14.1 s > 14 s, the duration of the run: it reads once"),
        (0.1, {"pixel_size": 0.011}, "sensors.1.pixel_size = 0.011 m > 1e-2 m: looks like mm"),
        (0.1, {"period": 1.01}, "controller.period = 0.1 s < 0.1 times sensors.1.period = 1.01 s: it decides on old readings"),
        (0.1, {"delay": 0.51}, "sensors.1.delay = 0.51 s > 5 times controller.period = 0.1 s: the loop swings unless"),
    ],
)
def test_a_suspicious_loop_names_its_inequality(every, sensor, message):
    (line,) = suspicious(steered(every, **sensor))
    assert line.startswith(message)


def test_an_ordinary_loop_is_not_suspicious():
    """Each value at the limit of a check, or beyond it at a sensor that the controller does not read."""
    assert suspicious(steered(0.1, period=1.0, delay=0.5, pixel_size=0.01)) == ()
    assert suspicious(steered(1.41, period=14.0)) == ()
    free = steered(0.1).with_values({"sensors.0.delay": 10.0, "sensors.0.period": 5.0})
    assert suspicious(free) == ()
    assert suspicious(free.with_value("controller.output", "depth")) != ()
    assert suspicious(free.with_values({"controller.output": "depth", "controller.kind": "none"})) == ()


@pytest.mark.parametrize(("position", "told"), [("30 mm", True), ("-30 mm", False)])
def test_a_guide_behind_the_skin_is_asked_back(position, told):
    values = {"support": {"kind": "hub", "guides": [{"position": position}]}, "insertion.final_depth": "100 mm"}
    if not told:
        load_scene("thesis").with_values(values)
        return
    with pytest.raises(SceneError, match="negative is before the skin: did you mean -30 mm"):
        load_scene("thesis").with_values(values)
