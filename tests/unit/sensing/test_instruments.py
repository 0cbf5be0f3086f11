"""What each kind of sensor reads, against numbers computed by hand."""

from __future__ import annotations

from math import atan2, exp, pi

import numpy as np
import pytest

from fem_needle.scene import Sensor
from fem_needle.scene.signals import READINGS
from fem_needle.sensing.markers import MarkerGrid
from fem_needle.sensing.quantization import rounded, rounded_array
from tests.unit.sensing.examples import LENGTH, Known, read_once, rig_of, series

PIXEL = 0.25  # a power of two, so that halves of it are exact


@pytest.mark.parametrize(
    ("value", "place"),
    [
        (0.0, 0.0),
        (0.1249, 0.0),
        (0.125, 0.25),  # half a pixel goes up
        (0.3749, 0.25),
        (0.375, 0.5),
        (-0.125, 0.0),  # up below zero too
        (-0.1251, -0.25),
        (-0.375, -0.25),
        (-0.3751, -0.5),
        (1e9 + 0.1, 1e9),
    ],
)
def test_rounding_to_pixels(value, place):
    assert rounded(value, PIXEL) == place
    assert rounded_array(np.array([value]), PIXEL)[0] == place


def test_a_step_of_zero_changes_nothing():
    assert rounded(0.1234567, 0.0) == 0.1234567
    values = np.array([0.1, -0.2])
    assert rounded_array(values, 0.0) is values


def test_an_image_has_the_tip_and_the_line_from_the_entry_to_it():
    """1.1 mm and 99.7 mm in pixels of 0.5 mm: 1.0 mm (2.2 pixels) and 99.5 mm (199.4 pixels)."""
    found = read_once("tip-imaging", Known(tip_deflection=1.1e-3, depth=0.0997), pixel_size=5e-4)
    assert found["tip_deflection"] == pytest.approx(1.0e-3, rel=1e-14)
    assert found["needle_angle"] == pytest.approx(atan2(1.0, 99.5), rel=1e-14)
    exact = read_once("tip-imaging", Known(tip_deflection=-1.1e-3, depth=0.0997))
    assert exact == {"tip_deflection": -1.1e-3, "needle_angle": atan2(-1.1e-3, 0.0997)}


@pytest.mark.parametrize(
    ("depth", "angle"),
    [(0.0, 0.0), (2.4e-4, 0.0), (2.6e-4, pi / 4.0), (-1e-9, 0.0)],
)
def test_the_angle_is_zero_at_depth_zero_in_the_image(depth, angle):
    """Depths below half a pixel of 0.5 mm are 0; above, the tip is a pixel deep and a pixel aside."""
    found = read_once("tip-imaging", Known(tip_deflection=5e-4, depth=depth), pixel_size=5e-4)
    assert found["needle_angle"] == pytest.approx(angle, rel=1e-14)
    assert found["tip_deflection"] == 5e-4


def test_forces_moment_and_depth_are_rounded_to_the_resolution():
    truth = Known(hub_force=0.126, push_force=-1.374, hub_moment=0.0126, depth=0.10003)
    assert read_once("base-force", truth, resolution=PIXEL) == {"hub_force": 0.25, "push_force": -1.25}
    assert read_once("base-force", truth) == {"hub_force": 0.126, "push_force": -1.374}
    assert read_once("base-moment", truth, resolution=0.005) == {"hub_moment": pytest.approx(0.015, rel=1e-14)}
    assert read_once("encoder", truth, resolution=1e-4) == {"depth": pytest.approx(0.1, rel=1e-14)}


def test_a_needle_shape_has_equal_stations_from_hub_to_tip():
    """w = s at 0, 50, 100, 150, 200 mm; in pixels of 40 mm: 0, 1.25, 2.5 (up), 3.75, 5."""
    truth = Known(shape=lambda arc_length: arc_length)
    assert read_once("needle-shape", truth, stations=5)["needle_shape"] == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2])
    rounded_shape = read_once("needle-shape", truth, stations=5, pixel_size=0.04)["needle_shape"]
    assert rounded_shape == pytest.approx([0.0, 0.04, 0.12, 0.16, 0.2], rel=1e-14)


@pytest.mark.parametrize("kind", READINGS)
def test_every_kind_reads_the_names_that_the_scene_says(kind):
    keys = {"decay_length": 0.01} if kind == "tissue-deformation" else {}
    assert read_once(kind, Known(depth=0.1), **keys).keys() == READINGS[kind].keys()


@pytest.mark.parametrize("kind", ["tip-imaging", "base-force", "base-moment", "encoder"])
def test_readings_are_plain_floats(kind):
    """A controller of 1 kHz has no time for numbers of numpy."""
    one = np.float64(1.0)
    truth = Known(depth=one, tip_deflection=one, hub_force=one, hub_moment=one, push_force=one)
    for keys in ({}, {"noise": 0.1}, {"pixel_size" if kind == "tip-imaging" else "resolution": 0.1}):
        assert {type(value) for value in read_once(kind, truth, **keys).values()} == {float}


def marker_sensor(**keys):
    return Sensor(kind="tissue-deformation", period=1.0, decay_length=0.02, marker_spacing=0.05, **keys)


def test_the_grid_of_markers():
    """Spacing 50 mm on 200 mm: depths 25, 75, 125, 175 mm; rows at +-25, +-75, +-125 mm."""
    grid = MarkerGrid.of(marker_sensor(), LENGTH)
    assert grid.depths == pytest.approx([0.025, 0.075, 0.125, 0.175])
    assert grid.places[:, 0] == pytest.approx([-0.125, -0.075, -0.025, 0.025, 0.075, 0.125])
    assert grid.shares[3:, 0] == pytest.approx([exp(-1.25), exp(-3.75), exp(-6.25)])
    assert len(MarkerGrid.of(marker_sensor(), 0.225).depths) == 5  # one at the needle's length itself
    assert len(MarkerGrid.of(marker_sensor(), 0.2249).depths) == 4
    assert len(MarkerGrid.of(marker_sensor(), 0.02).depths) == 0


def test_markers_move_with_the_needle_down_to_the_tip():
    """At depth 80 mm the markers at 25 and 75 mm lie at the arc lengths 145 and 195 mm of the needle; w = s there."""
    grid = MarkerGrid.of(marker_sensor(), LENGTH)
    seen = grid.seen(Known(depth=0.08, shape=lambda arc_length: arc_length))
    displacements = seen - grid.places
    assert displacements[3] == pytest.approx(np.array([0.145, 0.195, 0.0, 0.0]) * exp(-1.25), rel=1e-13)
    assert displacements[5] == pytest.approx(np.array([0.145, 0.195, 0.0, 0.0]) * exp(-6.25), rel=1e-12)
    assert displacements[0] == pytest.approx(displacements[5], abs=1e-16)
    # A tip at a marker's depth has not reached it yet.
    assert (grid.seen(Known(depth=0.025, shape=lambda arc_length: 1.0 + arc_length)) == grid.places).all()


def test_the_metric_of_two_frames_by_hand():
    """Two depths, w = +-1 mm all along: markers at 25 mm, then at 25 and 75 mm.

    With E the sum of exp(-x / 20 mm) over the six rows and 24 markers: from 80 mm deep at 1 mm to 30 mm deep at -2 mm the marker
    row at 25 mm moves by -3 mm, that at 75 mm is let go by -1 mm.
    """
    rows = 2.0 * (exp(-1.25) + exp(-3.75) + exp(-6.25))
    rig = rig_of(marker_sensor())
    truth = Known(depth=0.08, shape=lambda arc_length: 1e-3 + 0.0 * arc_length)
    rig.sample(truth)
    assert rig.known(0.0) == {"tissue_deformation": 0.0, "tissue_displacement": 0.0}
    truth.time, truth.depth, truth.shape = 1.0, 0.03, lambda arc_length: -2e-3 + 0.0 * arc_length
    rig.sample(truth)
    found = rig.known(1.0)
    assert found["tissue_deformation"] == pytest.approx((3e-3 + 1e-3) * rows / 24.0, rel=1e-12)
    assert found["tissue_displacement"] == pytest.approx(-(3e-3 + 1e-3) * rows / 24.0, rel=1e-12)
    # The tip goes deeper again and passes the second marker, which jumps to -2 mm; nothing else moves.
    truth.time, truth.depth = 2.0, 0.08
    rig.sample(truth)
    assert rig.known(2.0)["tissue_displacement"] == pytest.approx(-2e-3 * rows / 24.0, rel=1e-12)


def test_displacements_of_all_frames_add_up_to_where_the_markers_are():
    """What the jumps are for: without them the sum would miss every marker that the tip has passed."""
    rig = rig_of(marker_sensor())
    truth = Known(depth=0.0, shape=lambda arc_length: 0.05 * arc_length**2)
    total = 0.0
    for frame in range(20):
        truth.time, truth.depth = float(frame), 0.01 * frame
        rig.sample(truth)
        total += rig.known(truth.time)["tissue_displacement"]
    grid = MarkerGrid.of(marker_sensor(), LENGTH)
    assert total == pytest.approx(float((grid.seen(truth) - grid.places).mean()), rel=1e-12)
    assert total > 0.0


def test_signs_cancel_in_the_displacement_and_not_in_the_deformation():
    rig = rig_of(marker_sensor())
    truth = Known(depth=0.2)
    rig.sample(truth)
    # w is +1 mm at the markers 25 and 75 mm (arc lengths the same, the needle is all in), -1 mm beyond.
    truth.time, truth.shape = 1.0, lambda arc_length: np.where(arc_length < 0.1, 1e-3, -1e-3)
    rig.sample(truth)
    found = rig.known(1.0)
    assert found["tissue_displacement"] == pytest.approx(0.0, abs=1e-18)
    assert found["tissue_deformation"] == pytest.approx(1e-3 * 2.0 * (exp(-1.25) + exp(-3.75) + exp(-6.25)) / 6.0, rel=1e-12)


def test_markers_are_seen_in_pixels():
    """Pixels of 20 mm; the rows stand at +-1.25, +-3.75, +-6.25 pixels and are seen at +-1, +-4, +-6.

    A needle at 10 mm moves the inner ones by 10 mm exp(-1.25) = 0.143 pixels to 1.39 (seen at 1) and -1.11 (-1), at 20 mm by
    0.287 to 1.54 (2) and -0.96 (-1), at 100 mm by 1.43 to 2.68 (3) and 0.18 (0). The next rows move by 0.012, 0.024 and 0.118:
    not enough for 4.5 or -3.5. So one row of four markers jumps by 20 mm, then two.
    """
    rig = rig_of(marker_sensor(pixel_size=0.02))
    truth = Known(depth=0.2)
    found = []
    for frame, deflection in enumerate((0.0, 0.01, 0.02, 0.1)):
        truth.time, truth.shape = float(frame), lambda arc_length, w=deflection: w + 0.0 * arc_length
        rig.sample(truth)
        found.append(rig.known(truth.time)["tissue_deformation"])
    assert found == pytest.approx([0.0, 0.0, 4 * 0.02 / 24.0, 8 * 0.02 / 24.0], rel=1e-12)


def test_noise_of_markers_gives_the_deformation_a_floor():
    """The difference of two normal numbers has a mean magnitude of 2 sigma / sqrt(pi); 480 markers, 200 frames: to 1 %."""
    sensor = Sensor(kind="tissue-deformation", decay_length=0.02, marker_spacing=0.0025, noise=1e-4)
    found = series(rig_of(sensor, seed=5), "tissue_deformation", 201, Known(depth=0.1))[1:]
    assert found.mean() == pytest.approx(2e-4 / np.sqrt(pi), rel=0.01)
    assert series(rig_of(sensor, seed=5), "tissue_displacement", 201, Known(depth=0.1))[1:].mean() == pytest.approx(0.0, abs=1e-7)


def test_after_a_dropped_frame_the_difference_is_to_the_last_one_that_arrived():
    """A needle at n^2 mm in frame n: every pair of frames has a difference of its own."""
    rig = rig_of(marker_sensor(dropped_fraction=0.5), seed=3)
    truth = Known(depth=0.2)
    shares = float(MarkerGrid.of(marker_sensor(), LENGTH).shares.mean())
    arrived, known = [], {}
    for frame in range(60):
        truth.time, truth.shape = float(frame), lambda arc_length, w=1e-3 * frame**2: w + 0.0 * arc_length
        rig.sample(truth)
        before, known = known, rig.known(truth.time)
        if known != before:
            expected = 1e-3 * (frame**2 - arrived[-1] ** 2) * shares if arrived else 0.0
            assert known["tissue_displacement"] == pytest.approx(expected, rel=1e-9)
            arrived.append(frame)
    assert {1, 2, 3} <= set(np.diff(arrived))


def test_a_sensor_asks_only_for_what_it_reads():
    class OnlyDepth:
        time, depth = 0.0, 0.1

    rig = rig_of(Sensor(kind="encoder"))
    rig.sample(OnlyDepth())
    assert rig.known(0.0) == {"depth": 0.1}
