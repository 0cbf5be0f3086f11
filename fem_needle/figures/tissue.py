"""Tissue behind a picture whose x axis is the insertion axis: shaded layers, with their names in a strip above."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import wrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_needle.figures.common import MILLIMETERS, SMALL
from fem_needle.layer_names import key_entry, layer_key, layer_text, numbered_layers
from fem_needle.pictures import INK, SHADES
from fem_needle.scene import Layer, Scene

STRIP_SHARE = 0.17  # height of the strip over that of the picture below it
CHARACTER = 0.56  # width of a letter over its height
MOST_LINES = 3
NOTE_WIDTH = 115  # characters of a line below the picture


@dataclass(frozen=True)
class Band:
    """A visible part of a layer along the insertion axis, [mm].

    Attributes
    ----------
    start, end
        y of its visible ends.
    number
        Of the layer in the scene.
    text
        Name and modulus.
    note
        Number, name and modulus, for the key of a picture that shows the number alone.
    shade
        Its color.
    """

    start: float
    end: float
    number: int
    text: str
    note: str
    shade: str


def bands_of(scene: Scene, low: float, high: float) -> tuple[Band, ...]:
    """Return the layers that are seen between two places [mm], by place."""
    found = (
        _band(layer, number, SHADES[place % len(SHADES)], (low, high))
        for place, (number, layer) in enumerate(numbered_layers(scene))
    )
    return tuple(band for band in found if band.end > band.start)


def _band(layer: Layer, number: int, shade: str, seen: tuple[float, float]) -> Band:
    start, end = max(MILLIMETERS * layer.start, seen[0]), min(MILLIMETERS * layer.far_side, seen[1])
    return Band(start, end, number, layer_text(number, layer), key_entry(number, layer), shade)


def figure_with_tissue(figure: Figure) -> tuple[Axes, Axes]:
    """Return the axes of a picture and the strip above it, which share the insertion axis."""
    strip, axes = figure.subplots(2, 1, sharex=True, height_ratios=[STRIP_SHARE, 1.0])
    strip.set(yticks=[], ylim=(0.0, 1.0))
    strip.tick_params(bottom=False, labelbottom=False)
    strip.grid(False)
    strip.spines[:].set_visible(False)
    return axes, strip


def draw_tissue(axes: Axes, strip: Axes, scene: Scene, width: float) -> None:
    """Shade the layers inside the present limits of ``axes`` and name them.

    Parameters
    ----------
    axes, strip
        Of `figure_with_tissue`; limits are set.
    scene
        The scene.
    width
        Of the axes [points], about.
    """
    low, high = axes.get_xlim()
    bands, notes = bands_of(scene, low, high), []
    for band in bands:
        for panel in (axes, strip):
            panel.axvspan(band.start, band.end, color=band.shade, linewidth=0.0, zorder=0)
        room = width * (band.end - band.start) / (high - low)
        lines = wrap(band.text, max(int(room / (CHARACTER * SMALL)), 1), break_long_words=False)
        fits = len(lines) <= MOST_LINES and max(map(len, lines)) * CHARACTER * SMALL <= room
        text = "\n".join(lines) if fits else str(band.number)
        if not fits:
            notes.append(band.note)
        if fits or len(text) * CHARACTER * SMALL + 2.0 <= room:
            place = ((band.start + band.end) / 2.0, 0.5)
            strip.annotate(text, place, ha="center", va="center", fontsize=SMALL, parse_math=False)
    if low < 0.0 < high:
        axes.axvline(0.0, color=INK, linewidth=1.2, zorder=1)
        strip.axvline(0.0, color=INK, linewidth=1.2, zorder=1)
    _write_notes(axes, notes)
    if not bands:
        stiffness = scene.tissue.tip_stiffness
        text = "no layer here" if stiffness is None else f"no layers; a spring of {stiffness:.4g} N/m travels with the tip"
        strip.annotate(text, ((max(low, 0.0) + high) / 2.0, 0.5), ha="center", va="center", fontsize=SMALL)
    if -low / (high - low) * width > len("outside skin") * CHARACTER * SMALL:
        strip.annotate("outside", (low / 2.0, 0.5), ha="center", va="center", fontsize=SMALL)


def _write_notes(axes: Axes, notes: list[str]) -> None:
    """Name below the picture the layers that are too thin for their names."""
    figure = axes.get_figure(root=True)
    if notes and figure is not None:
        figure.supxlabel(layer_key(notes, NOTE_WIDTH), x=0.01, ha="left", fontsize=SMALL, parse_math=False)
