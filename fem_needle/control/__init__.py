"""Controllers: who decides the command, from readings of sensors."""

from fem_needle.control.build import controller_of
from fem_needle.control.controller import Command, Controller, Measurement

__all__ = ["Command", "Controller", "Measurement", "controller_of"]
