"""From measurements to parameters with intervals."""

from fem_needle.identification.friction import FrictionFit, Sliding, identify_friction, tell_sliding
from fem_needle.identification.friction_experiment import (
    FrictionRepetitions,
    friction_run,
    needle_mass,
    repeat_friction_experiment,
    with_noise,
)
from fem_needle.identification.least_squares import (
    Estimate,
    LinearFit,
    independent_stride,
    weighted_least_squares,
    zero_phase,
)
from fem_needle.identification.measurements import Measurements, read_measurements, sampling_interval
from fem_needle.identification.spread import Spread, spread

__all__ = [
    "Estimate",
    "FrictionFit",
    "FrictionRepetitions",
    "LinearFit",
    "Measurements",
    "Sliding",
    "Spread",
    "friction_run",
    "identify_friction",
    "independent_stride",
    "needle_mass",
    "read_measurements",
    "repeat_friction_experiment",
    "sampling_interval",
    "spread",
    "tell_sliding",
    "weighted_least_squares",
    "with_noise",
    "zero_phase",
]
