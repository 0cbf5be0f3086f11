"""What is known of a run at its output times: arrays over time, a row for each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.path import CutPath, path_through
from fem_needle.plant import Plant

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Selection = slice | NDArray[np.bool_] | NDArray[np.integer]


@dataclass(frozen=True, eq=False)
class Samples:
    """State, forces and ledger at output times that rise, T of them; SI.

    The names are those of ``series.nc`` (docs/contract.md), with ``coordinates``, ``point_forces`` and ``path_points`` besides.

    Attributes
    ----------
    time, depth, speed
        [s], [m], [m/s], shape (T,).
    coordinates
        Of the plant, shape (T, n).
    velocities, accelerations
        First and second derivatives of the coordinates in time, shape (T, n); the second is 0 without inertia.
    point_forces
        On guides, at lateral loads and at the tip, as `fem_needle.plant.Points` orders them [N], shape (T, p).
    guide_force
        Of each guide on the needle [N], shape (T, guides).
    push_force, friction_force, cutting_force, axial_force, tissue_force, hub_force
        [N], shape (T,).
    hub_moment
        [N m], shape (T,).
    kinetic_energy, bending_energy, tissue_energy, guide_energy
        Lateral energies [J], shape (T,).
    load_work, hub_work, tissue_work, tissue_dissipation, boundary_energy
        Of the lateral balance, since the start of the run [J], shape (T,).
    friction_dissipation, cutting_work, push_work, arrest_loss
        Of the axial balance, since the start of the run [J], shape (T,).
    axial_kinetic_energy
        [J], shape (T,).
    path_position, path_deflection
        The path that the tip has cut, y and r [m], at the last row; shape (points,), empty without one.
    path_cubics
        Powers of (y - start) of the pieces between these points, behind the jump at the first one, shape (points - 2, 4).
    path_points
        How many of these points each row has, shape (T,): the path only grows, that of a row is a prefix.
    """

    time: Array
    depth: Array
    speed: Array
    coordinates: Array
    velocities: Array
    accelerations: Array
    point_forces: Array
    guide_force: Array
    push_force: Array
    friction_force: Array
    cutting_force: Array
    axial_force: Array
    tissue_force: Array
    hub_force: Array
    hub_moment: Array
    kinetic_energy: Array
    bending_energy: Array
    tissue_energy: Array
    guide_energy: Array
    load_work: Array
    hub_work: Array
    tissue_work: Array
    tissue_dissipation: Array
    boundary_energy: Array
    friction_dissipation: Array
    cutting_work: Array
    push_work: Array
    arrest_loss: Array
    axial_kinetic_energy: Array
    path_position: Array
    path_deflection: Array
    path_cubics: Array
    path_points: Integers

    def __len__(self) -> int:
        return len(self.time)

    @property
    def lateral_energy(self) -> Array:
        """Kinetic, bending and tissue energy together [J], shape (T,)."""
        return self.kinetic_energy + self.bending_energy + self.tissue_energy

    @property
    def tip_force(self) -> Array:
        """Lateral force of the loads at the tip [N], shape (T,)."""
        return self.point_forces[:, -1]

    def lateral_forces(self, count: int) -> Array:
        """Return the forces of so many lateral loads [N], shape (T, count): they follow the guides."""
        guides = self.guide_force.shape[1]
        return self.point_forces[:, guides : guides + count]

    def rows(self, selection: Selection) -> Samples:
        """Return some of the rows, with the path as far as they have it.

        Parameters
        ----------
        selection
            A slice, a mask (T,) or indices (rows,), in order of time.
        """
        chosen = {name: getattr(self, name)[selection] for name in OVER_TIME}
        points = int(np.max(chosen["path_points"], initial=0))
        path: dict[str, Any] = self._path(points)
        return replace(self, **chosen, **path)

    def after(self, before: Samples) -> Samples:
        """Return the rows with works that go on from the last row of what was before."""
        return replace(self, **{name: getattr(self, name) + getattr(before, name)[-1] for name in SINCE_START})

    def path_at(self, row: int) -> CutPath:
        """Return the path at a row."""
        path = self._path(int(self.path_points[row]))
        return path_through(path["path_position"], path["path_deflection"], path["path_cubics"])

    def _path(self, points: int) -> dict[str, Array]:
        """Return the path up to so many points."""
        return {
            "path_position": self.path_position[:points],
            "path_deflection": self.path_deflection[:points],
            "path_cubics": self.path_cubics[: max(points - 2, 0)],
        }


SINCE_START = (
    "load_work", "hub_work", "tissue_work", "tissue_dissipation", "boundary_energy", "friction_dissipation", "cutting_work",
    "push_work", "arrest_loss",
)  # fmt: skip
NO_PATH = {"path_position": np.zeros(0), "path_deflection": np.zeros(0), "path_cubics": np.zeros((0, 4))}
PATH = tuple(NO_PATH)
OVER_TIME = tuple(field.name for field in fields(Samples) if field.name not in PATH)


def tips_of(plant: Plant, samples: Samples) -> Array:
    """Return the tip deflections [m] of samples (T,)."""
    tip = np.array([plant.scene.needle.length])
    return plant.deflection(samples.coordinates, samples.point_forces, samples.depth, tip)[:, 0]


def joined(blocks: Sequence[Samples]) -> Samples:
    """Return the rows of several blocks of one run, at least one, in their order; the path is that of the longest."""
    if len(blocks) == 1:
        return blocks[0]
    longest = max(blocks, key=lambda block: len(block.path_position))
    chosen = {name: np.concatenate([getattr(block, name) for block in blocks]) for name in OVER_TIME}
    return Samples(**chosen, **{name: getattr(longest, name) for name in PATH})
