"""A block of tissue around the needle, displaced for the eye.

The model knows forces on the needle, not the field around it. The block shows one chosen so that it follows the needle:

    u_y(x, y, z) = w(x) exp(-sqrt(y^2 + z^2) / L)   for 0 <= x <= depth,   0 beyond the tip

with L = needle length / 30 (`kernel_length` in each file). No strain or stress may be read from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Layer, Scene
from fem_needle.vtk_file import hexahedra_frame, point_data

Array = NDArray[np.float64]

MOST_POINTS = 3000
HALF_WIDTH = 1 / 10  # of the needle's length
KERNEL_LENGTH = 1 / 30  # of the needle's length
FARTHEST = 1.25  # of the largest depth where a layer has no far side, of the needle's length where it has one
_ACROSS = (9, 7, 5, 3)  # points across; odd, so that one line of points is the needle's axis


@dataclass(frozen=True, eq=False)
class TissueBlock:
    """The block's geometry, encoded once, and what displaces it.

    Attributes
    ----------
    planes
        x of every plane of points [m], layer by layer; an interface has a plane of each layer.
    kernel
        Displacement at each point of a plane by that of the needle, shape (points of a plane,).
    before, after
        The unchanging parts of its file.
    """

    planes: Array
    kernel: Array
    before: bytes
    after: bytes

    def displacement(self, positions: Array, deflection: Array) -> NDArray[np.float32]:
        """Return the displacement of every point [m], shape (points, 3).

        Parameters
        ----------
        positions, deflection
            x of the needle's stations, the tip last, and their deflection [m].
        """
        needle = np.interp(self.planes, positions, deflection, right=0.0)
        result = np.zeros((len(self.planes) * len(self.kernel), 3), dtype=np.float32)
        result[:, 1] = np.outer(needle, self.kernel).ravel()
        return result

    def file(self, positions: Array, deflection: Array, path: Array | None = None) -> bytes:
        """Return the ``.vtu`` of one frame; ``path`` is the rest line at every plane [m], where the tip cuts one."""
        arrays = {"displacement_illustrative": self.displacement(positions, deflection)}
        if path is not None:
            arrays["cut_path"] = np.repeat(path, len(self.kernel)).astype(np.float32)
        return self.before + point_data(arrays) + self.after


def tissue_block(scene: Scene, deepest: float) -> TissueBlock | None:
    """Return the block of a scene whose tip gets down to ``deepest`` [m]; None where it has no tissue to show."""
    length = scene.needle.length
    slabs = [(index, *layer_extent(layer, deepest, length)) for index, layer in enumerate(scene.tissue.layers)]
    slabs = [slab for slab in slabs if slab[2] > slab[1]]
    if not slabs:
        return None
    across = next((count for count in _ACROSS if 2 * len(slabs) * count**2 <= MOST_POINTS), _ACROSS[-1])
    counts = _plane_counts([end - start for _, start, end in slabs], MOST_POINTS // across**2)
    planes = [np.linspace(start, end, count) for (_, start, end), count in zip(slabs, counts, strict=True)]
    offsets = np.linspace(-HALF_WIDTH, HALF_WIDTH, across) * length
    y, z = (grid.ravel() for grid in np.meshgrid(offsets, offsets, indexing="ij"))
    all_planes = np.concatenate(planes)
    points = np.column_stack((np.repeat(all_planes, y.size), np.tile(y, all_planes.size), np.tile(z, all_planes.size)))
    layers = [np.full((count - 1) * (across - 1) ** 2, index) for (index, _, _), count in zip(slabs, counts, strict=True)]
    before, after = hexahedra_frame(
        points.astype(np.float32),
        _cells(counts, across),
        {"layer": np.concatenate(layers).astype(np.int32)},
        {"kernel_length": np.array([KERNEL_LENGTH * length])},
    )
    return TissueBlock(all_planes, np.exp(-np.hypot(y, z) / (KERNEL_LENGTH * length)), before, after)


def layer_extent(layer: Layer, deepest: float, length: float) -> tuple[float, float]:
    """Return where a layer is drawn from and to [m]."""
    if layer.end is not None:
        return layer.start, min(layer.end, max(FARTHEST * length, FARTHEST * deepest))
    return layer.start, max(FARTHEST * deepest, layer.start + HALF_WIDTH * length)


def _plane_counts(thicknesses: list[float], budget: int) -> list[int]:
    """Share planes among layers by thickness, at least two each."""
    spare, total = max(0, budget - 2 * len(thicknesses)), sum(thicknesses)
    return [2 + int(spare * thickness / total) for thickness in thicknesses]


def _cells(counts: list[int], across: int) -> NDArray[np.int64]:
    """Return the corners of all hexahedra in VTK's order, shape (cells, 8)."""
    starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
    planes = list(chain.from_iterable(range(start, start + count - 1) for start, count in zip(starts, counts, strict=True)))
    first, y, z = np.meshgrid(planes, np.arange(across - 1), np.arange(across - 1), indexing="ij")
    corner = ((first * across + y) * across + z).ravel()
    square = [0, across**2, across**2 + across, across]
    return np.column_stack([corner + step for step in (*square, *(step + 1 for step in square))])
