import mpmath
import numpy as np
import pytest

from fem_needle import banded
from reduced_model.modes import ClampedFreeModes
from reduced_model.shapes import LineShapes, ModeSet, RigidSet

DIGITS = 60
LENGTH = 0.2


def precise_root(number):
    """The root of cos B cosh B = -1, divided by cosh so that nothing overflows."""
    start = (number - 0.5) * mpmath.pi
    return mpmath.findroot(lambda b: mpmath.cos(b) + 1 / mpmath.cosh(b), start)


def precise_values(number, places, derivative):
    """phi of unit length by the textbook formula, in 60 digits beyond what cancels."""
    with mpmath.workdps(DIGITS + int(1.5 * number)):
        root = precise_root(number)
        ratio = (mpmath.cosh(root) + mpmath.cos(root)) / (mpmath.sinh(root) + mpmath.sin(root))
        found = []
        for place in places:
            t = root * mpmath.mpf(float(place))
            even, odd = mpmath.cosh(t), mpmath.sinh(t)
            grows = (even - ratio * odd) if derivative % 2 == 0 else (odd - ratio * even)
            wave = (
                mpmath.cos(t) - ratio * mpmath.sin(t),
                -mpmath.sin(t) - ratio * mpmath.cos(t),
                -mpmath.cos(t) + ratio * mpmath.sin(t),
                mpmath.sin(t) + ratio * mpmath.cos(t),
            )[derivative]
            found.append(float(root**derivative * (grows - wave)))
    return np.array(found)


@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
@pytest.mark.parametrize("number", [1, 2, 3, 10, 31, 100])
def test_modes_against_sixty_digits(number, derivative):
    places = np.concatenate([[0.0, 1e-7, 1e-4, 1.0 - 1e-9, 1.0], np.random.default_rng(number).uniform(0.0, 1.0, 8)])
    expected = precise_values(number, places, derivative)
    found = ClampedFreeModes(1.0, number).values(places, derivative)[-1]
    largest = 2.0 * precise_root(number) ** derivative
    assert np.max(np.abs(found - expected)) < 1e-12 * float(largest)


@pytest.mark.parametrize("number", [1, 2, 5, 30])
def test_near_the_clamp_every_digit_counts(number):
    places = np.array([1e-6, 1e-4, 3e-3])
    for derivative in (0, 1):
        expected = precise_values(number, places, derivative)
        assert ClampedFreeModes(1.0, number).values(places, derivative)[-1] == pytest.approx(expected, rel=2e-12)


def test_the_length_scales_modes_and_derivatives():
    unit, scaled = ClampedFreeModes(1.0, 6), ClampedFreeModes(LENGTH, 6)
    places = np.linspace(0.0, 1.0, 9)
    for derivative in range(4):
        expected = unit.values(places, derivative) * LENGTH ** (-0.5 - derivative)
        assert scaled.values(places * LENGTH, derivative) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_modes_are_orthonormal_and_their_tips_are_two():
    shapes = LineShapes(LENGTH, (ModeSet(LENGTH, 100),))
    mass, bending = (dense(shapes, kind) for kind in ("mass", "bending"))
    assert mass == pytest.approx(np.eye(100), abs=1e-12)
    wavenumbers = ClampedFreeModes(LENGTH, 100).wavenumbers
    assert bending / np.outer(wavenumbers**2, wavenumbers**2) == pytest.approx(np.eye(100), abs=1e-11)
    tips = ClampedFreeModes(LENGTH, 100).values(np.array([LENGTH]))[:, 0]
    assert tips == pytest.approx(2.0 / np.sqrt(LENGTH) * (-1.0) ** np.arange(100), rel=1e-12)


def dense(shapes, kind, power=0, interval=None):
    integrals = shapes.interval_integrals(kind, power)
    if interval is None:
        return banded.to_dense(integrals.band)
    band = banded.zeros(shapes.size, shapes.size - 1)
    integrals.add(*interval, 1.0, band)
    return banded.to_dense(band)


@pytest.mark.parametrize("interval", [(0.0, 0.37), (0.1, 0.1 + 1e-9), (0.25, 0.9), (1e-6, 3e-6)])
@pytest.mark.parametrize("kind", ["mass", "drag", "slip", "bending"])
def test_integrals_over_any_interval(kind, interval):
    """Against 40-digit quadrature, relative to what the two factors alone amount to."""
    pairs = [(1, 1), (1, 2), (2, 5)]
    count = 5
    shapes = LineShapes(1.0, (ModeSet(1.0, count),))
    found = dense(shapes, kind, interval=interval)
    orders = {"mass": (0, 0), "drag": (0, 1), "slip": (1, 1), "bending": (2, 2)}[kind]
    start, end = (mpmath.mpf(edge) for edge in interval)
    with mpmath.workdps(40):
        functions = {n: precise_function(n) for n in range(1, count + 1)}

        def integral(left, right, first, second):
            edges = mpmath.linspace(start, end, 5)
            return mpmath.quad(lambda x: functions[left](x, first) * functions[right](x, second), edges)

        for left, right in pairs:
            expected = integral(left, right, *orders)
            scale = mpmath.sqrt(integral(left, left, orders[0], orders[0]) * integral(right, right, orders[1], orders[1]))
            assert abs(found[left - 1, right - 1] - expected) < 1e-12 * scale


def precise_function(number):
    root = precise_root(number)
    ratio = (mpmath.cosh(root) + mpmath.cos(root)) / (mpmath.sinh(root) + mpmath.sin(root))

    def function(x, derivative):
        t = root * x
        value = {
            0: lambda: mpmath.cosh(t) - mpmath.cos(t) - ratio * (mpmath.sinh(t) - mpmath.sin(t)),
            1: lambda: mpmath.sinh(t) + mpmath.sin(t) - ratio * (mpmath.cosh(t) - mpmath.cos(t)),
            2: lambda: mpmath.cosh(t) + mpmath.cos(t) - ratio * (mpmath.sinh(t) + mpmath.sin(t)),
        }[derivative]
        return root**derivative * value()

    return function


@pytest.mark.parametrize("power", [0, 1])
def test_high_modes_integrals_are_exact(power):
    """One Gauss rule against a finer one, up to mode 100 and over an interval that cuts two panels."""
    shapes = LineShapes(1.0, (RigidSet(), ModeSet(1.0, 100)))
    points, weights = np.polynomial.legendre.leggauss(400)
    start, end = 0.2113, 0.7719
    x, w = start + (end - start) * (points + 1) / 2, weights * (end - start) / 2
    for kind, first, second, moment in (("mass", 0, 0, 0), ("drag", 0, 1, power), ("slip", 1, 1, 2 * power)):
        left, right = shapes.values(x, first), shapes.values(x, second)
        expected = (left * w * x**moment) @ right.T
        found = dense(shapes, kind, power, (start, end))
        assert found == pytest.approx(expected, abs=1e-12 * np.max(np.abs(expected)))
