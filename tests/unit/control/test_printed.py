from math import cos, pi

import pytest

from fem_needle.control.printed import PrintedProportional
from tests.unit.control.scenes import commands

PIXEL = 0.5  # m, so that a deformation of 0.16 m is 0.32 pixels, and 0.32 * 50/16 = 1


def printed(**changes):
    return PrintedProportional(**({"input": "lateral_force", "period": 0.5, "pixel_size": PIXEL} | changes))


def frames(*totals, angle=0.0):
    """Frames whose total is (C 50/16) / 2 = total where the deflection counts nothing."""
    return [{"needle_angle": angle, "tissue_deformation": 0.32 * total} for total in totals]


def test_the_force_is_a_ratchet():
    # 1 is 1 above 0; 0 is below; 1.4 is 0.4 above 1; 1.6 is 0.6 above; 3 is 1.4 above; 0 and everything after holds.
    assert commands(printed(), frames(1.0, 0.0, 1.4, 1.6, 3.0, 0.0, 3.2)) == pytest.approx([1.0, 1.0, 1.0, 1.6, 3.0, 3.0, 3.0])


@pytest.mark.parametrize("total, force", [(0.499, 0.0), (0.5, 0.0), (0.501, 0.501), (3.999, 3.999), (4.0, 0.0), (4.001, 0.0)])
def test_both_limits_are_strict(total, force):
    # A short period: with a length of 5 mm the cosine of pi/2, 6e-17 in double precision, adds a rounding.
    assert commands(printed(period=1e-9), frames(total)) == pytest.approx([force], rel=1e-12, abs=1e-15)


def test_the_deflection_of_a_needle_along_the_image_never_counts():
    """The angle of the normal, about pi/2, is compared with 10 degrees: any visible deflection is zeroed."""
    found = commands(printed(), frames(*[0.4] * 200, angle=0.15))  # length 1000 mm, sin(0.15) of it 149 mm
    assert found == [0.0] * 200


def test_only_a_needle_across_the_image_has_a_deflection():
    # Normal 0.1 rad: L = 5 mm after the first period, total = 5 cos(0.1) / 2 = 2.49; next 10 mm, 4.98 is not below 4.
    angle = 0.1 - 0.5 * pi
    assert commands(printed(), frames(0.0, 0.0, angle=angle)) == pytest.approx([2.5 * cos(0.1)] * 2, rel=1e-12)


@pytest.mark.parametrize("normal, counts", [(0.17449, True), (0.17451, False), (-0.17449, True), (-0.17451, False)])
def test_the_angle_test(normal, counts):
    force = commands(printed(), frames(0.0, angle=normal - 0.5 * pi))[0]
    assert force == pytest.approx(2.5 * cos(normal) if counts else 0.0, abs=1e-12)


def test_the_sign_of_the_deflection_is_lost():
    with_it, against = (commands(printed(), frames(1.0, 2.0, angle=angle)) for angle in (0.05, -0.05))
    assert with_it == against == pytest.approx([1.0, 2.0])


def test_missing_readings_keep_the_command_and_count_no_length():
    across = 0.1 - 0.5 * pi
    readings = [{}, {"needle_angle": across}, {"tissue_deformation": 0.0}, *frames(0.0, angle=across)]
    assert commands(printed(initial=0.25), readings) == pytest.approx([0.25, 0.25, 0.25, 2.5 * cos(0.1)])


def test_the_force_stored_is_the_force():
    # Gain 2: force 2 stands for the total; 2.4 is 0.4 above it, 2.6 is 0.6 above it: force 5.2.
    assert commands(printed(gain=2.0), frames(1.0, 2.4, 2.6)) == pytest.approx([2.0, 2.0, 5.2])


def test_other_thresholds():
    assert commands(printed(smallest_rise=0.25, largest_total=2.0), frames(0.3, 2.1)) == pytest.approx([0.3, 0.3])
