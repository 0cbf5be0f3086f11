"""Independent, slow, high-order solutions of the equation of motion, for tests only."""

from tests.references.entry import entry_motion
from tests.references.hub import hub_motion
from tests.references.piecewise_motion import piecewise_motion
from tests.references.push import pushed_motion
from tests.references.scenes import Motion

__all__ = ["Motion", "entry_motion", "hub_motion", "piecewise_motion", "pushed_motion"]
