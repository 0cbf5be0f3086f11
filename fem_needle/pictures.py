"""The style that all pictures share: size, fonts, colors that color-blind readers tell apart."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from io import BytesIO
from textwrap import wrap
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

WIDTH, HEIGHT = 7.0, 4.6  # inches
DOTS_PER_INCH = 120
INK = "#303030"
# Okabe and Ito, in the order of use: blue, vermilion, bluish green, reddish purple, orange, sky blue.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: Any = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)), (0, (3, 3)), (0, (8, 2)))
# Of the layers of tissue, behind dark lines and letters.
SHADES = ("#f4e3d2", "#e3bfa6", "#eddcb4", "#d9c3c8", "#f1d5c4", "#dcc9a9")
MARKERS = ("o", "s", "^", "D", "v", "P")
TITLE_SIZE = 10.0  # points
LETTER = 0.55  # width of a letter over its height, on average
POINTS = 72.0  # of an inch
MOST_TURNS = 80  # of a curve: beyond, dashes merge into a band
STYLE: Any = {
    "font.size": 10.0,
    "axes.titlesize": 11.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#d8d8d8",
    "grid.linewidth": 0.6,
    "legend.framealpha": 1.0,
    "lines.linewidth": 1.8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}
_OF_THE_PROCESS = ("backend", "backend_fallback", "interactive", "toolbar", "timezone", "date.epoch", "tk.window_focus")
FORMATS = ("png", "svg", "pdf")
# Letters stay letters, which can be searched and edited; names inside a file do not change from one writing to the next.
_VECTOR_STYLE: Any = {"svg.fonttype": "none", "svg.hashsalt": "fem-needle", "pdf.fonttype": 42}
_METADATA: Any = {"svg": {"Date": None, "Creator": None}, "pdf": {"CreationDate": None, "Creator": None, "Producer": None}}


def crowded(values: NDArray[np.float64]) -> bool:
    """Return whether a curve turns so often that it is to be drawn thin and without dashes."""
    steps = np.diff(values[np.isfinite(values)])
    ways = np.sign(steps[steps != 0.0])
    return int(np.count_nonzero(np.diff(ways))) > MOST_TURNS


def new_figure(width: float = WIDTH, height: float = HEIGHT) -> Figure:
    """Return an empty figure [inches] that lays its parts out by itself; draw inside ``shared_style()``."""
    return Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")


def title_lines(title: str, width: float) -> str:
    """Return a title in one or two lines that fit a width [inches]; what two do not hold ends in "..."."""
    most = int(POINTS * width / (LETTER * TITLE_SIZE))
    return "\n".join(wrap(title, most, max_lines=2, placeholder=" ...", break_on_hyphens=False))


def write_title(figure: Figure, title: str, ending: str = "") -> None:
    """Write a title above a whole figure, in two lines where it is long; ``ending`` is never cut."""
    width = float(figure.get_size_inches()[0]) - len(ending) * LETTER * TITLE_SIZE / POINTS
    lines = title_lines(title, 0.98 * width) + ending
    figure.suptitle(lines, x=0.01, ha="left", fontsize=TITLE_SIZE, parse_math=False)


def shared_style(**more: Any) -> AbstractContextManager[None]:
    """Return the context manager in which pictures are drawn and saved: matplotlib's own defaults, whatever a user has set."""
    return mpl.rc_context(_defaults() | STYLE | more)


@cache
def _defaults() -> dict[str, Any]:
    """Return matplotlib's settings as it comes, but the backend, which pictures do not need."""
    return {name: value for name, value in mpl.rcParamsDefault.items() if name not in _OF_THE_PROCESS}


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as PNG, the same bytes for the same figure."""
    content = BytesIO()
    with shared_style():
        figure.savefig(content, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None}, pil_kwargs={"optimize": True})
    return content.getvalue()


def picture_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Return a figure as one of `FORMATS`, the same bytes for the same figure.

    Parameters
    ----------
    figure
        Of matplotlib.
    kind
        ``"png"``, ``"svg"`` or ``"pdf"``.

    Raises
    ------
    ValueError
        If the format is none of them.
    """
    if kind == "png":
        return png_bytes(figure)
    if kind not in FORMATS:
        raise ValueError(f"format: is not a choice (got {kind!r}; allowed {', '.join(FORMATS)})")
    content = BytesIO()
    with shared_style(**_VECTOR_STYLE):
        figure.savefig(content, format=kind, metadata=_METADATA[kind])
    return content.getvalue()
