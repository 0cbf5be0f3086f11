"""What stands where in the picture [mm]: x along the insertion, 0 at the surface, y the direction of the deflection."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, log10

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.layer_names import key_entry, layer_text, numbered_layers
from fem_needle.run_forces import Forces, lateral_forces, support_forces, tip_force
from fem_needle.scene import Scene
from fem_needle.tissue_block import layer_extent
from fem_needle.trajectory import Trajectory
from fem_needle.view.solids import Surface, arrow, box, plate, together, tube
from fem_needle.vtk_export import DRAWN_RADIUS, needle_positions

Array = NDArray[np.float64]

MILLI = 1e3  # mm in a meter
SHOWN = 1 / 8  # of the needle's length: how long the largest deflection and the largest arrow may look
HALF_WIDTH = 1 / 8  # of the needle's length
STATIONS = 81
NOTHING = 1e-6  # of the largest force: a smaller one has no arrow
ARROW_RADIUS = 1 / 320  # of the needle's length
INVISIBLE = 1e-9  # mm
PLATE, SPRING_PLATE = 1 / 12, 1 / 20  # of the needle's length: radius of the plate of a guide that is rigid, on a spring


@dataclass(frozen=True)
class Slab:
    """A layer as a block.

    Attributes
    ----------
    start, end
        Along the insertion axis [mm].
    number
        In the scene.
    label, note
        What to write on it, and what a key says where there is no room.
    """

    start: float
    end: float
    number: int
    label: str
    note: str


@dataclass(frozen=True, eq=False)
class Pose:
    """Everything that moves, at one sample.

    Attributes
    ----------
    needle, loads, reactions
        Surfaces [mm].
    tip
        Where the magnified tip is (3,) [mm].
    caption
        Time, depth, tip.
    """

    needle: Surface
    loads: Surface
    reactions: Surface
    tip: Array
    caption: str


@dataclass(frozen=True, eq=False)
class Arrangement:
    """A run as a scene of solids.

    Attributes
    ----------
    run
        The run.
    magnification
        Deflections are drawn so many times as large.
    newton
        Length of an arrow of 1 N [mm].
    slabs
        Layers of the tissue.
    """

    run: Trajectory
    magnification: float
    newton: float
    slabs: tuple[Slab, ...]

    @property
    def scene(self) -> Scene:
        """What was run."""
        return self.run.scene

    @property
    def length(self) -> float:
        """Of the needle [mm]."""
        return MILLI * self.scene.needle.length

    @property
    def half_width(self) -> float:
        """Of the block [mm]."""
        return HALF_WIDTH * self.length

    @property
    def note(self) -> str:
        """What is not to scale."""
        arrows = "" if not self.newton else f"; arrows: {SHOWN * self.length:.4g} mm = {SHOWN * self.length / self.newton:.3g} N"
        radius = self.scene.needle.radius
        true = radius is not None and radius >= DRAWN_RADIUS * self.scene.needle.length
        thickness = "" if true else "; thickness of the needle not to scale"
        return f"deflections {self.magnification:g} times as large{arrows}{thickness}"

    @property
    def rigid_guides(self) -> Surface:
        """The rigid guides as plates with a hole."""
        return self._plates(PLATE, rigid=True)

    @property
    def spring_guides(self) -> Surface:
        """The guides on springs as smaller plates with a hole."""
        return self._plates(SPRING_PLATE, rigid=False)

    def _plates(self, size: float, *, rigid: bool) -> Surface:
        guides = (guide for guide in self.scene.support.guides if (guide.stiffness == "rigid") is rigid)
        return together(plate(MILLI * guide.position, 2.0 * self.radius, size * self.length) for guide in guides)

    @property
    def radius(self) -> float:
        """Of the needle as it is drawn [mm]."""
        return MILLI * max(self.scene.needle.radius or 0.0, DRAWN_RADIUS * self.scene.needle.length)

    @property
    def path(self) -> Array:
        """The path that the tip has cut by the end (n, 3) [mm]; empty without one."""
        y, rest = self.run.path_position, self.run.path_deflection
        return np.column_stack((MILLI * y, MILLI * self.magnification * rest, np.zeros(len(y))))

    @property
    def ruler(self) -> Array:
        """Round places along the insertion axis [mm] where something is drawn."""
        ends = [end for slab in self.slabs for end in (slab.start, slab.end)]
        places = MILLI * np.concatenate((self.run.depth - self.scene.needle.length, self.run.depth))
        return _ticks(min([*ends, float(np.min(places))]), max([*ends, float(np.max(places))]))

    def blocks(self) -> tuple[Surface, ...]:
        """Return the layers as blocks."""
        return tuple(box(slab.start, slab.end, self.half_width) for slab in self.slabs)

    def row(self, time: float | None) -> int:
        """Return the sample nearest to a time [s], the last one without a time.

        Raises
        ------
        SceneError
            If the run has no such time.
        """
        times = self.run.time
        if time is None:
            return len(times) - 1
        if not times[0] <= time <= times[-1]:
            raise SceneError(f"--time: not in the run (got {time:g}; allowed {times[0]:g} to {times[-1]:g} s)")
        return int(np.argmin(np.abs(times - time)))

    def pose(self, row: int) -> Pose:
        """Return what moves, at a sample."""
        line = self._line(row)
        loads, reactions = _loads(self.run, row), support_forces(self.run, row)
        tip = MILLI * float(self.run.tip_deflection[row])
        tip = tip if abs(tip) > INVISIBLE else 0.0
        caption = f"{self.run.time[row]:.4g} s, depth {MILLI * self.run.depth[row]:.4g} mm, tip {tip:.3g} mm"
        return Pose(tube(line, self.radius), self._arrows(loads, line), self._arrows(reactions, line), line[-1], caption)

    def _line(self, row: int) -> Array:
        run, depth = self.run, float(self.run.depth[row])
        stations = np.linspace(0.0, self.scene.needle.length, STATIONS)
        deflection = np.interp(stations, run.arc_length, run.station_deflection[row])
        places = needle_positions(self.scene, depth, stations)
        return np.column_stack((MILLI * places, MILLI * self.magnification * deflection, np.zeros(STATIONS)))

    def _arrows(self, forces: list[tuple[float, float]], line: Array) -> Surface:
        """Return arrows that end where forces (y [m], [N]) act on the line."""
        shown = [(MILLI * y, self.newton * force) for y, force in forces if abs(force) * self.newton > NOTHING * self.length]
        radius = ARROW_RADIUS * self.length
        found = []
        for place, size in shown:
            way = np.array([0.0, size, 0.0])
            end = np.array([place, float(np.interp(place, line[:, 0], line[:, 1])), 0.0])
            found.append(arrow(end - way, way, radius))
        return together(found)


def arrangement(run: Trajectory, magnification: float | None = None) -> Arrangement:
    """Arrange a run.

    Parameters
    ----------
    run
        Computed or loaded.
    magnification
        Of deflections; by default a round number with which the largest is an eighth of the needle's length at most.

    Raises
    ------
    SceneError
        If the magnification is no positive number.
    """
    if magnification is not None and not (np.isfinite(magnification) and magnification > 0.0):
        raise SceneError(f"--magnification: is no positive number (got {magnification:g})")
    length = run.scene.needle.length
    largest = float(np.nanmax(np.abs(run.station_deflection)))
    forces = [abs(force) for row in range(len(run.time)) for _, force in (*_loads(run, row), *support_forces(run, row))]
    strongest = max(forces, default=0.0)
    newton = MILLI * SHOWN * length / strongest if strongest else 0.0
    return Arrangement(run, magnification or _rounded(SHOWN * length, largest), newton, _slabs(run))


def _rounded(shown: float, largest: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... with which a length looks no longer than it may."""
    if largest <= 0.0 or shown <= largest:
        return 1.0
    ratio = shown / largest
    power = 10.0 ** floor(log10(ratio))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= ratio * (1.0 + 1e-12))


def _ticks(low: float, high: float) -> Array:
    """Return the multiples of 1, 2 or 5 times a power of ten within a range, about eight."""
    rough = (high - low) / 8.0
    power = 10.0 ** floor(log10(rough))
    step = power * min((size for size in (1.0, 2.0, 5.0, 10.0) if size * power >= rough), default=10.0)
    return np.asarray(step * np.arange(-floor(-low / step + 1e-9), floor(high / step + 1e-9) + 1), dtype=float)


def _slabs(run: Trajectory) -> tuple[Slab, ...]:
    deepest = float(np.max(run.depth))
    slabs = []
    for number, layer in numbered_layers(run.scene):
        start, end = layer_extent(layer, deepest, run.scene.needle.length)
        if end > start:
            slabs.append(Slab(MILLI * start, MILLI * end, number, layer_text(number, layer), key_entry(number, layer)))
    return tuple(slabs)


def _loads(run: Trajectory, row: int) -> Forces:
    return [*lateral_forces(run, row), tip_force(run, row)]
