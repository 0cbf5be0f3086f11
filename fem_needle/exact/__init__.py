"""Exact cases: closed forms and exact solutions that carry their own scene."""

from fem_needle.exact.closed_forms import ClampedTipForce, InfiniteBeam, SemiInfiniteBeam
from fem_needle.exact.statics import PiecewiseStatics, exact_static, tip_compliance
from fem_needle.exact.vibration import ReleaseFromTipForce, clamped_free_roots, natural_frequencies

__all__ = [
    "ClampedTipForce",
    "InfiniteBeam",
    "PiecewiseStatics",
    "ReleaseFromTipForce",
    "SemiInfiniteBeam",
    "clamped_free_roots",
    "exact_static",
    "natural_frequencies",
    "tip_compliance",
]
