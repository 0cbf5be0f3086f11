"""From measurements to parameters with intervals."""

from fem_needle.identification.bending import BendingFit, compare_printed, identify_bending, section_moment
from fem_needle.identification.friction import FrictionFit, Sliding, identify_friction, tell_sliding
from fem_needle.identification.friction_experiment import (
    FrictionRepetitions,
    friction_run,
    needle_mass,
    repeat_friction_experiment,
    with_noise,
)
from fem_needle.identification.indentation import (
    beam_foundation_modulus,
    beam_modulus_of_point,
    beam_point_stiffness,
    indented_modulus,
    rod_modulus_of_point,
)
from fem_needle.identification.least_squares import (
    Estimate,
    LinearFit,
    independent_stride,
    weighted_least_squares,
    zero_phase,
)
from fem_needle.identification.measurements import Measurements, read_measurements, sampling_interval
from fem_needle.identification.sample_data import sample_names, sample_path
from fem_needle.identification.spread import Spread, spread
from fem_needle.identification.stiffness import (
    Softening,
    StiffnessFit,
    StiffnessMatrix,
    eight_directions,
    identify_softening,
    identify_stiffness,
)

__all__ = [
    "BendingFit",
    "Estimate",
    "FrictionFit",
    "FrictionRepetitions",
    "LinearFit",
    "Measurements",
    "Sliding",
    "Softening",
    "Spread",
    "StiffnessFit",
    "StiffnessMatrix",
    "beam_foundation_modulus",
    "beam_modulus_of_point",
    "beam_point_stiffness",
    "compare_printed",
    "eight_directions",
    "friction_run",
    "identify_bending",
    "identify_friction",
    "identify_softening",
    "identify_stiffness",
    "indented_modulus",
    "independent_stride",
    "needle_mass",
    "read_measurements",
    "repeat_friction_experiment",
    "rod_modulus_of_point",
    "sample_names",
    "sample_path",
    "sampling_interval",
    "section_moment",
    "spread",
    "tell_sliding",
    "weighted_least_squares",
    "with_noise",
    "zero_phase",
]
