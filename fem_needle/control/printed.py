"""The thesis' program for proportional control (Appendix C), with its mistakes: docs/control.md says which."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi
from typing import NamedTuple

from fem_needle.control.controller import Command, Measurement

SPEED = 10.0  # mm/s: the length inserted is counted, not measured
LARGEST_ANGLE = 0.1745  # rad, of the line's normal in place of the line
SCALE = 50.0 / 16.0  # of the tissue's deformation
SMALLEST_RISE = 0.5  # pixels
LARGEST_TOTAL = 4.0  # pixels
FORCE_PER_PIXEL = 1.0  # N


class PrintedState(NamedTuple):
    """Last command, counted length [mm], and the total that the next one must exceed, which is the last force."""

    command: float
    length: float = 0.0
    total: float = 0.0


@dataclass(frozen=True)
class PrintedProportional:
    """The printed program: once in a period T, with theta = pi/2 + needle angle, the normal of the line in the image,

        L <- L + T v_ins;   theta <- pi/2 where |theta| > 0.1745;   total = (C 50/16 + L |cos theta|) / 2;
        force = gain total where total - total_old > 0.5 and total < 4, else total_old;   total_old <- force

    C is the tissue deformation in pixels, L in mm. No target, no sign, no limit: the force only rises.

    Attributes
    ----------
    input
        What is commanded.
    period
        T [s].
    pixel_size
        Of the sensor of tissue deformation [m].
    gain
        Input per pixel.
    smallest_rise, largest_total
        Pixels.
    initial
        The command before the first readings.
    """

    input: str
    period: float
    pixel_size: float
    gain: float = FORCE_PER_PIXEL
    smallest_rise: float = SMALLEST_RISE
    largest_total: float = LARGEST_TOTAL
    initial: float = 0.0

    def begin(self) -> PrintedState:
        """Return the state before the first decision."""
        return PrintedState(self.initial)

    def update(self, state: PrintedState, time: float, measurement: Measurement) -> tuple[PrintedState, Command]:
        """Return the next state and the command; see `Controller`."""
        angle, deformation = measurement.get("needle_angle"), measurement.get("tissue_deformation")
        if angle is None or deformation is None:
            return state, {self.input: state.command}
        length = state.length + self.period * SPEED
        normal = 0.5 * pi + angle
        if abs(normal) > LARGEST_ANGLE:
            normal = 0.5 * pi
        total = 0.5 * (deformation / self.pixel_size * SCALE + length * abs(cos(normal)))
        force = state.total
        if total - state.total > self.smallest_rise and total < self.largest_total:
            force = self.gain * total
        return PrintedState(force, length, force), {self.input: force}
