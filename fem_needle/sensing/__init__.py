"""What a controller may know: sensors that read at their own rate, late, rounded, noisy, and not always."""

from fem_needle.sensing.rig import SensorRig
from fem_needle.sensing.truth import Truth

__all__ = ["SensorRig", "Truth"]
