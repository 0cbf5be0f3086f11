"""Scenes with a loop, hand-made responses of a model, and a plant that answers at once."""

from fem_needle import Scene
from fem_needle.control.gain_schedule import GainSchedule
from fem_needle.control.model_response import DepthCurve, ModelResponse
from fem_needle.control.signals import output_reader

TIP = {"kind": "tip-imaging"}
ENCODER = {"kind": "encoder"}
TISSUE = {"kind": "tissue-deformation", "decay_length": 0.01}


def tube(controller=None, *, modulus=5e3, sensors=(TIP, ENCODER), support="hub", **changes):
    """The tube of docs/analysis.md, with a finger at the skin, 50 to 120 mm at 10 mm/s; few elements."""
    data = {
        "needle": {"length": 0.2, "bending_stiffness": 0.01572, "mass_per_length": 0.01},
        "support": {"kind": support},
        "tissue": {"layers": [{"foundation_modulus": modulus}]},
        "insertion": {"kind": "speed", "initial_depth": 0.05, "speed": 0.01, "final_depth": 0.12},
        "loads": [{"kind": "lateral", "position": 0.0, "force": 0.0}] if support == "hub" else [],
        "sensors": list(sensors),
        "controller": controller or {},
        "numerics": {"elements": 12},
    }
    return Scene.from_dict(data | changes)


def line(start, slope, *, first=0.0, end=0.1):
    """The curve start + slope (z - first)."""
    return DepthCurve((first,), end, ((0.0, 0.0, slope, start),))


def response(gain, rest=None, *, largest):
    return ModelResponse("lateral_force", gain, rest or line(0.0, 0.0), 0.0, 0.1, largest, ())


def falling_gain():
    """A schedule on g = 2 - 40 z, so 2 at z = 0, 0 at 50 mm, -2 at 100 mm; s = 1/4."""
    return GainSchedule(response(line(2.0, -40.0), largest=2.0), 0.25)


def tip_readings(*values, **others):
    return [{"tip_deflection": value} | others for value in values]


def commands(controller, measurements, period=0.5):
    """The commands that follow from a sequence of measurements."""
    state, found = controller.begin(), []
    for number, measurement in enumerate(measurements):
        state, command = controller.update(state, number * period, measurement)
        found.append(command["lateral_force"])
    return found


COMMON = {"input": "lateral_force", "read": output_reader("tip_deflection")}


def static_loop(controller, answer, *, depth=lambda time: 0.05, periods=200, period=1 / 30, sensor_period=None, delay=0.0):
    """Deflections and commands of a tip that answers at once, answer(depth, command), seen by a sensor with period and delay."""
    sensor_period = sensor_period or period
    state, command, frames, tips, given = controller.begin(), 0.0, [], [], []
    for number in range(periods):
        time = number * period
        tip = answer(depth(time), command)
        if time >= len(frames) * sensor_period - 1e-9 * period:
            frames.append((time + delay, tip))
        known = [value for arrival, value in frames if arrival <= time + 1e-9 * period]
        measurement = {"depth": depth(time)} | ({"tip_deflection": known[-1]} if known else {})
        state, found = controller.update(state, time, measurement)
        command = found.get("lateral_force", command)
        tips.append(tip)
        given.append(command)
    return tips, given
