from math import pi

import pytest

from fem_needle.scene import units


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("127 mm", "m", 0.127),
        ("1.27mm", "m", 1.27e-3),
        ("200 GPa", "Pa", 200e9),
        ("0.52 kN/m^2", "N/m^2", 520.0),
        ("20 kPa", "N/m^2", 2e4),
        ("10 mm/s", "m/s", 0.01),
        ("3 N", "N", 3.0),
        ("180 deg", "rad", pi),
        ("8 g/cm^3", "kg/m^3", 8000.0),
        ("1.28e-13 m^4", "m^4", 1.28e-13),
        ("0.128 mm^4", "m^4", 1.28e-13),
        ("30 ms", "s", 0.03),
        ("2 min", "s", 120.0),
        ("0.3 N s/m", "N s/m", 0.3),
        ("20 N s/m²", "N s/m^2", 20.0),
        ("0.02 N*m^2", "N m^2", 0.02),
        ("5 g/m", "kg/m", 5e-3),
        ("-4e1 µm", "m", -4e-5),
        ("1 kg m/s^2", "N", 1.0),
        ("2 1/s", "Hz", 2.0),
        ("8 in", "m", 0.2032),
        ("30 gf", "N", 0.2941995),
        ("2 kgf", "N", 19.6133),
        ("5 mm/min", "m/s", 5e-3 / 60),
    ],
)
def test_a_text_becomes_si(text, unit, value):
    assert units.to_si(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("number", "speed"), [(300, 0.005), (60, 0.001), (90, 0.0015), (7, 7 / 60000)])
def test_millimeters_per_minute_round_once(number, speed):
    assert units.to_si(f"{number} mm/min", "m/s") == speed


@pytest.mark.parametrize("text", ["127 mm", "0.1 mm", "12.7 mm", "33.3 mm", "7 mm"])
def test_a_decimal_fraction_rounds_once(text):
    assert units.to_si(text, "m") == float(text.split()[0]) / 1000


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("127 mm", "m/s", "expected speed in m/s, not length"),
        ("2 deg", "m", "expected length in m, not angle"),
        ("2 furlong", "m", "unknown unit 'furlong' .at 'furlong'.; known: m, cm, in"),
        ("200 gpa", "Pa", "unknown unit 'gpa'; did you mean 'GPa'"),
        ("200 mpa", "Pa", "did you mean 'MPa' or 'mPa'"),
        ("5 mm/sec", "m/s", "unknown unit 'mm/sec'; did you mean 'mm/s'"),
        ("5 millimeters/s", "m/s", "did you mean 'mm/s'"),
        ("8 inches", "m", "did you mean 'in'"),
        ("3 Newtons", "N", "did you mean 'N'"),
        ("3 kn", "N", "did you mean 'kN'"),
        ("5 mmm", "m", "did you mean 'mm'"),
        ("18 G", "m", "a gauge is known for an outer diameter alone"),
        ("2 m/s/s", "m", "more than one division"),
        ("0.2", "m", "needs a unit"),
        ("m", "m", "not a number"),
        ("nan m", "m", "not a number"),
        ("0.5 mm", "1", "plain number"),
        ("3 m^0", "m", "unknown unit"),
        ("3 /m", "m", "not a unit"),
    ],
)
def test_a_wrong_text_says_why(text, unit, message):
    with pytest.raises(ValueError, match=message):
        units.to_si(text, unit)


def test_an_angle_is_no_plain_number():
    assert units.parse_unit("rad").dimension != units.parse_unit("1").dimension


@pytest.mark.parametrize(
    ("unit", "shown", "thousandth_power"),
    [
        ("m", "mm", 1),
        ("N/m^2", "kN/m^2", -1),
        ("N m^2", "N mm^2", 2),
        ("Pa", "GPa", -3),
        ("N", "N", 0),
        ("N/m", "N/mm", -1),
        ("N s/m^2", "N s/m^2", 0),
    ],
)
def test_display_units_are_of_the_same_dimension(unit, shown, thousandth_power):
    assert units.display_unit(unit) == shown
    assert units.parse_unit(shown).dimension == units.parse_unit(unit).dimension
    assert units.parse_unit(shown).size == pytest.approx(1e-3**thousandth_power, rel=1e-14)
