"""Make the meshes of this folder: `python meshes/make_meshes.py [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LENGTH = 0.2  # m, of the needle
ELEMENTS = 40
GRADING = 10.0  # largest element / smallest
BLOCK = (0.25, 0.08, 0.08)  # m: along the insertion axis from the surface, then across, the needle's axis in the middle
BLOCK_CELLS = (25, 8, 8)


def uniform() -> Array:
    """Return the nodes of equal elements [m]."""
    return np.linspace(0.0, LENGTH, ELEMENTS + 1)


def fine_at_start() -> Array:
    """Return nodes whose distances grow geometrically from 0 on [m]."""
    steps = np.geomspace(1.0, GRADING, ELEMENTS)
    nodes = np.concatenate(([0.0], np.cumsum(steps) / steps.sum())) * LENGTH
    nodes[-1] = LENGTH
    return nodes


def fine_at_end() -> Array:
    """Return the same nodes, fine at the tip [m]."""
    return LENGTH - fine_at_start()[::-1]


def needle(nodes: Array) -> meshio.Mesh:
    """Return a line mesh along x."""
    points = np.column_stack((nodes, np.zeros((nodes.size, 2))))
    first = np.arange(nodes.size - 1)
    return meshio.Mesh(points, [("line", np.column_stack((first, first + 1)))])


def phantom() -> meshio.Mesh:
    """Return a block of hexahedra."""
    length, width, height = BLOCK
    counts = [cells + 1 for cells in BLOCK_CELLS]
    axes = (
        np.linspace(0.0, length, counts[0]),
        np.linspace(-width / 2, width / 2, counts[1]),
        np.linspace(-height / 2, height / 2, counts[2]),
    )
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(counts)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]  # VTK's order
    cells = [number[x : x + BLOCK_CELLS[0], y : y + BLOCK_CELLS[1], z : z + BLOCK_CELLS[2]].ravel() for x, y, z in corners]
    return meshio.Mesh(points, [("hexahedron", np.column_stack(cells))])


def meshes() -> dict[str, meshio.Mesh]:
    """Return every mesh by the name of its file."""
    return {
        "needle-uniform.vtu": needle(uniform()),
        "needle-fine-at-tip.vtu": needle(fine_at_end()),
        "needle-fine-at-skin.vtu": needle(fine_at_start()),
        "phantom-block.vtu": phantom(),
    }


def main() -> None:
    """Write all meshes, binary."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, mesh in meshes().items():
        mesh.write(folder / name, binary=True)
        print(f"wrote {folder / name}")


if __name__ == "__main__":
    main()
