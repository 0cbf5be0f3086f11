"""Pictures of a run, in mm, N, s: each function takes a `Trajectory`, computed or loaded, and returns a matplotlib figure."""

from fem_needle.figures.animation import animated_gif
from fem_needle.figures.course_figure import courses
from fem_needle.figures.energy_figure import energies
from fem_needle.figures.files import FORMATS, KINDS, write_pictures
from fem_needle.figures.shape_figure import shapes
from fem_needle.figures.tip_figure import tip_path
from fem_needle.figures.waterfall_figure import waterfall
from fem_needle.pictures import picture_bytes

__all__ = [
    "FORMATS",
    "KINDS",
    "animated_gif",
    "courses",
    "energies",
    "picture_bytes",
    "shapes",
    "tip_path",
    "waterfall",
    "write_pictures",
]
