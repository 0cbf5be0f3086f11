"""Scenes over ranges far beyond needles, and what no run may do on any of them: the command `stress`."""

from fem_needle.stress.draws import random_numbers
from fem_needle.stress.numbers import Numbers, Units, scene_of
from fem_needle.stress.study import StressRow, StressTable, stress
from fem_needle.stress.trial import Figure, Trial, examine

__all__ = ["Figure", "Numbers", "StressRow", "StressTable", "Trial", "Units", "examine", "random_numbers", "scene_of", "stress"]
