"""From measurements to parameters with intervals."""

from fem_needle.identification.least_squares import (
    Estimate,
    LinearFit,
    independent_stride,
    weighted_least_squares,
    zero_phase,
)
from fem_needle.identification.measurements import Measurements, read_measurements, sampling_interval

__all__ = [
    "Estimate",
    "LinearFit",
    "Measurements",
    "independent_stride",
    "read_measurements",
    "sampling_interval",
    "weighted_least_squares",
    "zero_phase",
]
