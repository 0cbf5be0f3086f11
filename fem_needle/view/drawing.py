"""An arrangement as colored surfaces with labels: what VTK, matplotlib and the browser draw alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.view.arrangement import Arrangement, Pose
from fem_needle.view.solids import Surface

Array = NDArray[np.float64]

NEEDLE, LOAD, REACTION, PLATE, PATH = "#303030", "#D55E00", "#0072B2", "#777777", "#CC79A7"
LEGEND = (("needle", NEEDLE), ("loads on the needle", LOAD), ("forces of its supports", REACTION))
LAYERS = ("#E69F00", "#56B4E9", "#009E73", "#F0E442")  # Okabe and Ito: told apart by color-blind readers
LAYER_OPACITY = 0.22
RULER, RULER_TICK, RULER_TEXT = 1.2, 1.3, 1.62  # half widths of the block below the axis


@dataclass(frozen=True, eq=False)
class Part:
    """A surface with its name, color and opacity."""

    name: str
    surface: Surface
    color: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Label:
    """A text at a point [mm]."""

    text: str
    place: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Drawing:
    """One instant.

    Attributes
    ----------
    title, caption, note
        What was run; time, depth and tip; what is not to scale.
    parts, labels
        Surfaces and texts.
    lines
        Ruler and cut path: color and points (n, 3) [mm].
    """

    title: str
    caption: str
    note: str
    parts: tuple[Part, ...]
    labels: tuple[Label, ...]
    lines: tuple[tuple[str, Array], ...]

    def corners(self) -> Array:
        """Return all points (n, 3) [mm] that a picture must hold."""
        surfaces = [part.surface.points for part in self.parts]
        lines = [points for _, points in self.lines]
        return np.concatenate([*surfaces, *lines, np.array([label.place for label in self.labels])])


def drawing(arranged: Arrangement, row: int) -> Drawing:
    """Return a sample as colored surfaces."""
    parts = (*still_parts(arranged), *moving_parts(arranged.pose(row)))
    caption = arranged.pose(row).caption
    shown = tuple(part for part in parts if len(part.surface.triangles))
    texts = (*layer_labels(arranged), *ruler_labels(arranged))
    return Drawing(title_of(arranged), caption, arranged.note, shown, texts, lines(arranged))


def title_of(arranged: Arrangement) -> str:
    """Return what was run."""
    return arranged.scene.title or "needle"


def still_parts(arranged: Arrangement) -> tuple[Part, ...]:
    """Return layers and template."""
    blocks = zip(arranged.slabs, arranged.blocks(), strict=True)
    layers = [
        Part(slab.label, block, LAYERS[number % len(LAYERS)], LAYER_OPACITY) for number, (slab, block) in enumerate(blocks)
    ]
    return (*layers, Part("template", arranged.template, PLATE, 0.6))


def moving_parts(pose: Pose) -> tuple[Part, ...]:
    """Return needle and arrows."""
    surfaces = (pose.needle, pose.loads, pose.reactions)
    return tuple(Part(name, surface, color) for (name, color), surface in zip(LEGEND, surfaces, strict=True))


def layer_labels(arranged: Arrangement) -> tuple[Label, ...]:
    """Return the names of the layers, above their blocks, on two heights in turn."""
    half = arranged.half_width
    return tuple(
        Label(slab.label, (0.5 * (slab.start + slab.end), (1.5 + 0.3 * (number % 2)) * half, 0.0))
        for number, slab in enumerate(arranged.slabs)
    )


def ruler_labels(arranged: Arrangement) -> tuple[Label, ...]:
    """Return the numbers of the ruler, the unit with the last."""
    places, half = arranged.ruler.tolist(), arranged.half_width
    texts = [f"{place:.6g}" for place in places]
    texts[-1] += " mm"
    return tuple(Label(text, (place, -RULER_TEXT * half, half)) for text, place in zip(texts, places, strict=True))


def lines(arranged: Arrangement) -> tuple[tuple[str, Array], ...]:
    """Return the ruler with its ticks, and the path that the tip has cut."""
    half, places = arranged.half_width, arranged.ruler
    corners = [point for place in places for point in ((place, -RULER), (place, -RULER_TICK), (place, -RULER))]
    ruler = np.array([(place, height * half, half) for place, height in corners])
    path = arranged.path
    return ((NEEDLE, ruler), *(((PATH, path),) if len(path) > 1 else ()))
