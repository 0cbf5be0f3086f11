"""A run as ParaView opens it: `deflection.pvd` with a needle and a block of tissue at every output time.

Meters; x along the insertion axis, 0 at the surface, y the direction of the deflection. Points are undeformed: Warp By
Vector with `deflection` (needle) or `displacement_illustrative` (tissue) bends them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_needle.atomic_file import write_atomically
from fem_needle.path import CutPath, path_through
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples
from fem_needle.scene import Scene, as_function
from fem_needle.section_forces import section_forces
from fem_needle.tissue_block import TissueBlock, tissue_block
from fem_needle.trajectory import Trajectory
from fem_needle.vtk_file import collection_entry, collection_file, polyline_file

Array = NDArray[np.float64]

COLLECTION = "deflection.pvd"
NEEDLE, TISSUE = "needle", "tissue"
OUTSIDE = -1  # `layer` where there is none
DRAWN_RADIUS = 1 / 200  # of the length, where the scene gives no radius
REWRITES = 500  # the list of frames is rewritten at each of the first ones, and then this often per doubling or so


@dataclass(frozen=True, eq=False)
class Frame:
    """The needle at one output time.

    Attributes
    ----------
    time, depth
        [s], [m].
    deflection, bending_moment, shear_force
        w [m], EI w'' [N m], EI w''' [N] at the stations, shape (n,).
    path
        The path cut so far.
    """

    time: float
    depth: float
    deflection: Array
    bending_moment: Array
    shear_force: Array
    path: CutPath

    def rest_line(self, positions: Array) -> Array:
        """Return where the tissue's springs rest [m] at positions y [m]: on the path cut so far, else on the axis."""
        return np.where(positions <= self.path.deepest, self.path.value(positions), 0.0)


def frames_of_samples(plant: Plant, samples: Samples, arc_length: Array) -> list[Frame]:
    """Return the frames of samples at stations from the hub, 0, to the tip, l [m]."""
    shapes = plant.deflection(samples.coordinates, samples.point_forces, samples.depth, arc_length)
    inside = section_forces(plant, samples, arc_length)
    return [
        Frame(time, depth, shapes[row], inside.bending_moment[row], inside.shear_force[row], samples.path_at(row))
        for row, (time, depth) in enumerate(zip(samples.time.tolist(), samples.depth.tolist(), strict=True))
    ]


def frames_of_run(run: Trajectory, first: int = 0) -> list[Frame]:
    """Return the frames of a run from row ``first`` on."""
    frames = []
    for row in range(first, len(run.time)):
        cut = int(np.count_nonzero(run.path_position <= np.max(run.depth[: row + 1])))
        path = path_through(run.path_position[:cut], run.path_deflection[:cut], run.path_cubics[: max(cut - 2, 0)])
        shape = (run.station_deflection[row], run.bending_moment[row], run.shear_force[row])
        frames.append(Frame(float(run.time[row]), float(run.depth[row]), *shape, path))
    return frames


def needle_positions(scene: Scene, depth: float, arc_length: Array) -> Array:
    """Return x = s - (l - z) of the stations [m]."""
    return arc_length - (scene.needle.length - depth)


def needle_arrays(scene: Scene, frame: Frame, arc_length: Array) -> dict[str, NDArray[np.generic]]:
    """Return the arrays on the needle's points.

    ``deflection`` (0, w, 0) [m]; ``bending_moment`` EI w'' [N m]; ``shear_force`` EI w''' [N], from equilibrium
    (`fem_needle.section_forces`); ``tissue_reaction``
    -k m(t) (w - r) [N/m], the springs' force on the needle, without the viscous part; ``layer`` [1], -1 outside; ``radius`` [m].
    """
    positions = needle_positions(scene, frame.depth, arc_length)
    layer = layers_at(scene, positions)
    moduli = np.array([item.foundation_modulus for item in scene.tissue.layers] + [0.0])
    modulus = moduli[layer] * as_function(scene.tissue.stiffness_factor).value(frame.time)
    radius = scene.needle.radius
    return {
        "deflection": _along_y(frame.deflection),
        "bending_moment": frame.bending_moment,
        "shear_force": frame.shear_force,
        "tissue_reaction": -modulus * (frame.deflection - frame.rest_line(positions)),
        "layer": layer,
        "radius": np.full(arc_length.shape, DRAWN_RADIUS * scene.needle.length if radius is None else radius),
    }


def layers_at(scene: Scene, positions: Array) -> NDArray[np.int32]:
    """Return the index of the layer at each position y [m], the deeper one at an interface, -1 outside."""
    found = np.full(positions.shape, OUTSIDE, dtype=np.int32)
    for index, layer in enumerate(scene.tissue.layers):
        found[(positions >= layer.start) & (positions < layer.far_side)] = index
    return found


def _deepest(scene: Scene) -> float:
    """Return the largest depth that a run may reach [m]."""
    if scene.insertion.kind == "force":
        return scene.insertion.final_depth or scene.needle.length
    return scene.insertion.depth_range(scene.duration)[1]


def _along_y(values: Array) -> Array:
    vectors = np.zeros((values.size, 3))
    vectors[:, 1] = values
    return vectors


class VtkSeries:
    """Writes the frames of one run as they come.

    Parameters
    ----------
    folder
        An existing run folder.
    scene
        What is run.
    arc_length
        Stations from the hub, 0, to the tip, l [m].
    """

    def __init__(self, folder: Path, scene: Scene, arc_length: Array) -> None:
        self._folder, self._scene, self._arc_length = folder, scene, arc_length
        self._block: TissueBlock | None = tissue_block(scene, _deepest(scene))
        self._entries: list[str] = []  # of the list, one for each frame
        self._listed = 0
        for name in (NEEDLE, TISSUE) if self._block else (NEEDLE,):
            (folder / name).mkdir(exist_ok=True)

    @property
    def count(self) -> int:
        """Number of complete frames."""
        return len(self._entries)

    def add(self, frame: Frame) -> None:
        """Write a frame and list it; one that is broken off leaves no file.

        Raises
        ------
        OSError
            If it cannot be written; the frames before stay readable.
        """
        contents = self._contents(frame)
        files = self._files(self.count)
        paths = [self._folder / file for file in files]
        try:
            for path, content in zip(paths, contents, strict=True):
                write_atomically(path, content)
        except BaseException:
            for path in paths:
                path.unlink(missing_ok=True)
            raise
        self._entries.append("".join(collection_entry(frame.time, part, file) for part, file in enumerate(files)))
        if self.count % max(1, self.count // REWRITES) == 0:
            self._write_list()

    def keep(self, count: int) -> None:
        """Drop the frames after the first ``count``."""
        dropped = [file for index in range(count, self.count) for file in self._files(index)]
        del self._entries[count:]
        if dropped:
            self._write_list()
        for file in dropped:
            (self._folder / file).unlink(missing_ok=True)

    def close(self) -> None:
        """List every frame."""
        if self._listed != self.count:
            self._write_list()

    def _contents(self, frame: Frame) -> list[bytes]:
        x = needle_positions(self._scene, frame.depth, self._arc_length)
        points = np.column_stack((x, np.zeros((x.size, 2))))
        contents = [polyline_file(points, needle_arrays(self._scene, frame, self._arc_length))]
        if self._block is not None:
            path = frame.rest_line(self._block.planes) if self._scene.tissue.rest_line == "cut-path" else None
            contents.append(self._block.file(x, frame.deflection - frame.rest_line(x), path))
        return contents

    def _files(self, index: int) -> list[str]:
        files = [f"{NEEDLE}/{index:06d}.vtp", f"{TISSUE}/{index:06d}.vtu"]
        return files if self._block is not None else files[:1]

    def _write_list(self) -> None:
        write_atomically(self._folder / COLLECTION, collection_file(self._entries))
        self._listed = self.count
