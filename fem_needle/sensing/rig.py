"""All sensors of a run: when each reads, what arrives, and when it is known."""

from __future__ import annotations

from collections import deque
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Scene, Sensor
from fem_needle.sensing.instruments import Instrument, Readings, instrument_of
from fem_needle.sensing.noise import Noise, Place, uniform
from fem_needle.sensing.truth import Truth

Array = NDArray[np.float64]

EARLY = 1e-9  # of a sensor's period: instants closer than this are one


class ChannelState(NamedTuple):
    """Everything that one sensor remembers: places in its random numbers, its last frame, its clock, what is on its way."""

    noise: Place
    losses: Place
    memory: Array | None
    readings: int
    due: float
    earliest: float
    under_way: tuple[tuple[float, Readings], ...]


class RigState(NamedTuple):
    """Everything that the sensors of a run remember: of each of them, what is known, and when the next reading is due [s]."""

    channels: tuple[ChannelState, ...]
    known: Readings
    next_time: float


class SensorRig:
    """The sensors of a scene in one run; made anew for each run, because it remembers.

    A sensor reads at 0, T, 2 T, ..., each time the product of a whole number and its period T, so that times do not drift. What
    it reads at t is known from t + delay on. Instants that differ by less than 1e-9 T are taken as one.

    Parameters
    ----------
    scene
        With its sensors.
    seed
        Of the random numbers, at least 0.
    repetition
        Which run of the same scene it is: another one has other noise.

    Attributes
    ----------
    next_time
        When the next reading is due [s]; infinite without sensors.

    Notes
    -----
    Sensor number i (from 0) takes its noise and its losses from two children of ``SeedSequence([seed, repetition, i])``: a
    sensor that is appended changes nothing for the others, and losses do not shift the noise.
    """

    def __init__(self, scene: Scene, seed: int, repetition: int = 0) -> None:
        sources = (np.random.SeedSequence([seed, repetition, index]) for index in range(len(scene.sensors)))
        pairs = zip(scene.sensors, sources, strict=True)
        self._channels = tuple(_Channel(sensor, scene.needle.length, source) for sensor, source in pairs)
        self._delayed = tuple(channel for channel in self._channels if channel.delay)
        self._known: Readings = {}
        self.next_time = 0.0 if self._channels else inf

    def sample(self, truth: Truth) -> None:
        """Take every reading that is due at the time of ``truth``; of a sensor that missed several, one.

        Parameters
        ----------
        truth
            The needle at an instant; finite.
        """
        time, nearest = truth.time, inf
        for channel in self._channels:
            if channel.earliest <= time:
                readings = channel.reading(time, truth)
                if readings is not None and not channel.delay:
                    self._known.update(readings)
                elif readings is not None:
                    channel.under_way.append((time + channel.delay, readings))
            nearest = min(nearest, channel.due)
        self.next_time = nearest

    def known(self, time: float) -> dict[str, float | Array]:
        """Return the latest readings that have arrived, by name (`fem_needle.scene.signals.READINGS`), SI.

        Parameters
        ----------
        time
            [s]; must not fall from call to call.

        Returns
        -------
        dict
            A copy; a name is absent before its first reading has arrived.
        """
        for channel in self._delayed:
            under_way, latest = channel.under_way, time + channel.slack
            while under_way and under_way[0][0] <= latest:
                self._known.update(under_way.popleft()[1])
        return self._known.copy()

    def state(self) -> RigState:
        """Return a copy of everything that is remembered."""
        return RigState(tuple(channel.state() for channel in self._channels), self._known.copy(), self.next_time)

    def restore(self, state: RigState) -> None:
        """Go back to a state of this rig, or of another one of the same sensors."""
        for channel, kept in zip(self._channels, state.channels, strict=True):
            channel.restore(kept)
        self._known, self.next_time = state.known.copy(), state.next_time


class _Channel:
    """One sensor under way: its clock, its losses, and the readings that have not arrived yet."""

    def __init__(self, sensor: Sensor, length: float, source: np.random.SeedSequence) -> None:
        noise_source, loss_source = source.spawn(2)
        self._noise = Noise.of(sensor.noise, noise_source)
        self._read: Instrument = instrument_of(sensor, length, self._noise)
        self._lost, self._losses = sensor.dropped_fraction, uniform(loss_source)
        self._period, self._count = sensor.period, 0
        self.delay, self.slack = sensor.delay, EARLY * sensor.period
        self.due, self.earliest = 0.0, -self.slack
        self.under_way: deque[tuple[float, Readings]] = deque()

    def reading(self, time: float, truth: Truth) -> Readings | None:
        """Return what is read now, None if it is lost, and set the clock to the next reading after ``time``."""
        while self.earliest <= time:
            self._count += 1
            self.due = self._count * self._period
            self.earliest = self.due - self.slack
        if self._lost and self._losses.next() < self._lost:
            return None
        return self._read(truth)

    def state(self) -> ChannelState:
        """Return a copy of everything that is remembered; readings themselves nobody changes."""
        places = self._noise.stream.place(), self._losses.place()
        return ChannelState(*places, self._read.memory, self._count, self.due, self.earliest, tuple(self.under_way))

    def restore(self, state: ChannelState) -> None:
        """Go back to a state."""
        self._noise.stream.go_to(state.noise)
        self._losses.go_to(state.losses)
        self._read.memory, self._count, self.due, self.earliest = state[2:6]
        self.under_way = deque(state.under_way)
