"""Gauges of hypodermic needles: the outer diameter by number, `18 G`.

Nominal diameters of https://en.wikipedia.org/wiki/Needle_gauge_comparison_chart, which follows the Birmingham wire gauge; ISO
9626 allows some hundredths of a millimeter around them. A gauge says nothing of the bore.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from fem_needle.scene.quantity import Quantity

OUTER_DIAMETERS = {  # mm
    7: 4.572, 8: 4.191, 9: 3.759, 10: 3.404, 11: 3.048, 12: 2.769, 13: 2.413, 14: 2.108, 15: 1.829, 16: 1.651, 17: 1.473,
    18: 1.270, 19: 1.067, 20: 0.9081, 21: 0.8192, 22: 0.7176, 23: 0.6414, 24: 0.5652, 25: 0.5144, 26: 0.4636, 27: 0.4128,
    28: 0.3620, 29: 0.3366, 30: 0.3112,
}  # fmt: skip
_GAUGE = re.compile(r"\s*(\d+)\s*-?\s*(?:G|g|ga|Ga|GA|gauge|Gauge)\.?\s*")


@dataclass(frozen=True)
class OuterDiameter(Quantity):
    """Metadata and check of a diameter that may be a gauge."""

    unit: str = "m"

    def converted(self, value: Any) -> float:
        """Return a number, a text with a unit or a gauge in SI."""
        match = _GAUGE.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            return super().converted(value)
        known = OUTER_DIAMETERS.get(int(match[1])) if len(match[1]) < 3 else None
        if known is None:
            raise self.error(f"is no known gauge; known: {min(OUTER_DIAMETERS)} G to {max(OUTER_DIAMETERS)} G", value)
        return known / 1e3
