"""When sensors read, when readings are known, what is lost, and where the noise comes from."""

from __future__ import annotations

from math import inf, nextafter

import numpy as np
import pytest

from fem_needle.scene import Sensor
from tests.unit.sensing.examples import Known, read_once, rig_of, series

CLOCKED = {"period": 0.1}


def test_without_sensors_nothing_is_due():
    rig = rig_of()
    assert rig.next_time == inf
    rig.sample(Known())
    assert rig.known(0.0) == {}


@pytest.mark.parametrize("period", [0.1, 1.0 / 30.0, 0.15, 1e-3])
def test_times_do_not_drift(period):
    """100 000 readings, each at the product of its number and the period, to the last bit."""
    rig = rig_of(Sensor(kind="encoder", period=period))
    truth = Known()
    for number in range(100_000):
        assert rig.next_time == number * period
        truth.time = rig.next_time
        rig.sample(truth)
    assert rig.next_time == 100_000 * period


def test_a_reading_is_taken_when_it_is_due_and_not_before():
    rig = rig_of(Sensor(kind="encoder", **CLOCKED))
    truth = Known(depth=0.01)
    rig.sample(truth)
    for time, depth, known in (
        (0.0, 0.011, 0.01),  # the same instant again: nothing more is due
        (0.1 - 1.1e-10, 0.02, 0.01),
        (0.1 - 0.9e-10, 0.03, 0.03),  # within 1e-9 of the period
        (0.1, 0.04, 0.03),  # that was it
        (0.2, 0.05, 0.05),
    ):
        truth.time, truth.depth = time, depth
        rig.sample(truth)
        assert rig.known(time) == {"depth": known}
    assert rig.next_time == pytest.approx(0.3, rel=1e-15)


def test_a_sensor_that_missed_several_readings_takes_one():
    rig = rig_of(Sensor(kind="encoder", **CLOCKED))
    truth = Known(time=0.35, depth=0.07)
    rig.sample(truth)
    assert (rig.known(0.35), rig.next_time) == ({"depth": 0.07}, 4 * 0.1)


def test_sensors_keep_their_own_time():
    rig = rig_of(Sensor(kind="encoder", period=0.1), Sensor(kind="base-moment", period=0.25))
    truth, times = Known(), []
    while rig.next_time < 1.0:
        truth.time = truth.depth = truth.hub_moment = rig.next_time
        rig.sample(truth)
        times.append((round(truth.time, 12), *(round(value, 12) for value in rig.known(truth.time).values())))
    assert times == [
        (0.0, 0.0, 0.0), (0.1, 0.1, 0.0), (0.2, 0.2, 0.0), (0.25, 0.2, 0.25), (0.3, 0.3, 0.25), (0.4, 0.4, 0.25),
        (0.5, 0.5, 0.5), (0.6, 0.6, 0.5), (0.7, 0.7, 0.5), (0.75, 0.7, 0.75), (0.8, 0.8, 0.75), (0.9, 0.9, 0.75),
    ]  # fmt: skip


def test_a_delayed_reading_is_known_from_its_arrival_on():
    """Readings at 0, 0.5, 1, ... arrive 1.25 later, three on the way at once; 1e-9 of the period is one instant."""
    rig = rig_of(Sensor(kind="encoder", period=0.5, delay=1.25))
    truth = Known()
    for number in range(5):
        truth.time = rig.next_time
        truth.depth = 0.01 * (number + 1)
        rig.sample(truth)
    assert rig.known(0.0) == {}
    assert rig.known(1.25 - 1e-9) == {}
    assert rig.known(1.25) == {"depth": 0.01}
    assert rig.known(nextafter(1.75, 0.0)) == {"depth": 0.02}  # rounding does not cost a period
    assert rig.known(2.7) == {"depth": 0.03}  # arrived at 2.25; the next one at 2.75
    assert rig.known(4.0) == {"depth": 0.05}


def test_each_sensor_has_its_own_delay():
    rig = rig_of(Sensor(kind="encoder", period=1.0, delay=0.3), Sensor(kind="base-moment", period=1.0, delay=0.2))
    rig.sample(Known())
    found = [sorted(rig.known(time)) for time in (0.1, 0.2, 0.25, 0.3)]
    assert found == [[], ["hub_moment"], ["hub_moment"], ["depth", "hub_moment"]]


def test_a_sensor_without_delay_is_known_at_once():
    rig = rig_of(Sensor(kind="encoder"))
    rig.sample(Known())
    assert set(rig.known(0.0)) == {"depth"}


def test_what_is_known_does_not_change_afterwards():
    rig = rig_of(Sensor(kind="encoder", **CLOCKED))
    truth = Known(depth=0.01)
    rig.sample(truth)
    first = rig.known(0.0)
    truth.time, truth.depth = 0.1, 0.02
    rig.sample(truth)
    assert (first["depth"], rig.known(0.1)["depth"]) == (0.01, 0.02)


def test_a_lost_reading_leaves_the_old_one():
    rig = rig_of(Sensor(kind="encoder", dropped_fraction=0.5, **CLOCKED))
    truth, found = Known(), []
    for number in range(200):
        truth.time, truth.depth = rig.next_time, float(number)
        rig.sample(truth)
        found.append(rig.known(truth.time).get("depth", -1.0))
    # Each value is that of an instant up to now, and the newest that arrived: it never goes back.
    assert all(value in (number, before) for number, (before, value) in enumerate(zip([-1.0, *found], found, strict=False)))
    assert 0 < sum(value == number for number, value in enumerate(found)) < 200


@pytest.mark.parametrize("fraction", [0.02, 0.3, 0.9])
def test_the_share_of_lost_readings(fraction):
    """Of n = 20 000 readings n p are lost, to five standard deviations of the binomial, sqrt(n p (1 - p))."""
    count = 20_000
    rig = rig_of(Sensor(kind="encoder", dropped_fraction=fraction), seed=11)
    truth, arrived = Known(), 0
    for number in range(count):
        truth.time, truth.depth = rig.next_time, float(number)
        rig.sample(truth)
        arrived += rig.known(truth.time).get("depth") == number
    assert abs(count - arrived - count * fraction) < 5.0 * np.sqrt(count * fraction * (1.0 - fraction))


def test_mean_deviation_and_independence_of_the_noise():
    """n = 20 000: the mean is right to five sigma / sqrt(n), the deviation to five sigma / sqrt(2 n), neighbors do not know of
    each other to five / sqrt(n).
    """
    count, sigma = 20_000, 2e-4
    rig = rig_of(Sensor(kind="tip-imaging", noise=sigma), seed=7)
    noise = series(rig, "tip_deflection", count, Known(tip_deflection=1e-3)) - 1e-3
    assert abs(noise.mean()) < 5.0 * sigma / np.sqrt(count)
    assert abs(noise.std() - sigma) < 5.0 * sigma / np.sqrt(2.0 * count)
    assert abs(np.corrcoef(noise[:-1], noise[1:])[0, 1]) < 5.0 / np.sqrt(count)
    assert len(np.unique(noise)) == count


def test_two_forces_have_noise_of_their_own():
    sensor = Sensor(kind="base-force", noise=0.1)
    lateral, axial = (series(rig_of(sensor, seed=1), name, 2000) for name in ("hub_force", "push_force"))
    assert abs(np.corrcoef(lateral, axial)[0, 1]) < 5.0 / np.sqrt(2000)


def test_the_noise_of_a_shape_differs_from_station_to_station():
    found = read_once("needle-shape", Known(), noise=1e-3, stations=500)["needle_shape"]
    assert len(np.unique(found)) == 500
    assert found.std() == pytest.approx(1e-3, rel=0.16)  # five standard deviations


def test_the_same_seed_gives_the_same_readings_another_seed_or_repetition_others():
    sensor = Sensor(kind="tip-imaging", noise=1e-4, dropped_fraction=0.1)

    def readings(**keys):
        return series(rig_of(sensor, **keys), "tip_deflection", 600).tolist()

    runs = [readings(seed=seed, repetition=repetition) for seed, repetition in ((4, 0), (4, 1), (5, 0), (0, 4))]
    assert readings(seed=4) == runs[0]
    assert all(first != second for number, first in enumerate(runs) for second in runs[:number])


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_sensor_more_changes_nothing_for_the_others(noise):
    first = Sensor(kind="tip-imaging", noise=1e-4, dropped_fraction=0.1)
    more = (Sensor(kind="base-force", noise=noise, dropped_fraction=noise), Sensor(kind="needle-shape", noise=noise))
    alone = series(rig_of(first, seed=2), "tip_deflection", 600)
    assert series(rig_of(first, *more, seed=2), "tip_deflection", 600).tolist() == alone.tolist()
    assert len(np.unique(alone)) > 500


def test_sensors_have_noise_of_their_own():
    """The third number, not the reading, decides: an encoder and a moment of the same deviation differ."""
    rig = rig_of(Sensor(kind="encoder", noise=1.0), Sensor(kind="base-moment", noise=1.0))
    rig.sample(Known())
    known = rig.known(0.0)
    assert known["depth"] != known["hub_moment"]


def test_losses_do_not_shift_the_noise():
    """The n-th reading that arrives has the n-th number, whatever was lost between."""
    losing = series(rig_of(Sensor(kind="encoder", noise=1.0, dropped_fraction=0.4), seed=9), "depth", 400)
    whole = series(rig_of(Sensor(kind="encoder", noise=1.0), seed=9), "depth", 400)
    arrived = list(dict.fromkeys(losing[~np.isnan(losing)].tolist()))
    assert arrived == whole[: len(arrived)].tolist()
    assert 200 < len(arrived) < 280
