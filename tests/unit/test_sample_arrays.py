"""Samples as arrays: rows of them, blocks joined, the path as a prefix, deflections of many rows at once."""

from dataclasses import fields

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, row_blocks, run_scene
from fem_needle.dynamics.grid import time_grid
from fem_needle.dynamics.run import run_samples, without_inertia
from fem_needle.sample_arrays import OVER_TIME, Samples, joined
from fem_needle.samples import Sample, stacked
from fem_needle.scene import Guide, LateralLoad, TipLoad
from fem_needle.trajectory import trajectory_from_samples
from fem_needle.vtk_export import frames_of_samples
from tests.consistency.scenes import GEL, LENGTH, moving, scene_of
from tests.contract.plants import CASES

PATH_POINTS = (0, 0, 3, 4, 4, 6)  # of each row


@pytest.fixture(scope="module")
def given() -> list[Sample]:
    """Samples of random numbers; the path grows as in a run."""
    random = np.random.default_rng(3)
    scalars = [field.name for field in fields(Sample) if field.type == "float"]
    path = random.normal(size=(2, max(PATH_POINTS)))
    cubics = random.normal(size=(max(PATH_POINTS), 4))
    return [
        Sample(
            **(dict(zip(scalars, random.normal(size=len(scalars)).tolist(), strict=True)) | {"time": 0.1 * row}),
            coordinates=random.normal(size=5),
            velocities=random.normal(size=5),
            accelerations=random.normal(size=5),
            point_forces=random.normal(size=2),
            guide_force=random.normal(size=1),
            path_position=path[0, :points],
            path_deflection=path[1, :points],
            path_cubics=cubics[: max(points - 2, 0)],
        )
        for row, points in enumerate(PATH_POINTS)
    ]


def same(one: Samples, other: Samples) -> bool:
    return all(np.array_equal(getattr(one, field.name), getattr(other, field.name)) for field in fields(Samples))


def test_rows_are_the_samples(given):
    found = stacked(given)
    assert len(found) == len(given)
    for row, sample in enumerate(given):
        for name in OVER_TIME:
            if name != "path_points":
                assert np.array_equal(getattr(found, name)[row], getattr(sample, name))
        if len(sample.path_position):
            path = found.path_at(row)
            assert np.array_equal(path.edges, sample.path_position[1:]) and path.front == sample.path_deflection[-1]
            assert np.array_equal(path.coefficients, sample.path_cubics)
    assert found.coordinates.shape == (6, 5) and found.guide_force.shape == (6, 1) and found.push_force.shape == (6,)
    assert np.array_equal(found.lateral_energy, found.kinetic_energy + found.bending_energy + found.tissue_energy)


def test_samples_have_every_field_of_a_sample(given):
    assert {field.name for field in fields(Samples)} - {"path_points"} == {field.name for field in fields(Sample)}


@pytest.mark.parametrize(
    ("selection", "rows"),
    [
        (slice(0, 2), [0, 1]),
        (slice(1, None, 2), [1, 3, 5]),
        (np.array([False, True, False, True, True, False]), [1, 3, 4]),
        (np.array([0, 5]), [0, 5]),
    ],
    ids=["start", "every other", "mask", "indices"],
)
def test_some_rows(given, selection, rows):
    assert same(stacked(given).rows(selection), stacked([given[row] for row in rows]))


def test_no_rows(given):
    found = stacked(given).rows(slice(2, 2))
    assert len(found) == 0 and found.coordinates.shape == (0, 5)
    assert found.path_position.shape == found.path_deflection.shape == found.path_points.shape == (0,)


def test_blocks_are_joined(given):
    whole = stacked(given)
    assert same(joined([stacked(given[:1]), stacked(given[1:4]), stacked(given[4:])]), whole)
    assert same(joined([whole, whole.rows(slice(0, 0))]), whole)
    assert same(joined([whole]), whole)


def states(plant, count=60):
    """Random states (T, n), forces (T, p) and depths (T,), from hardly inserted to almost the whole length."""
    random = np.random.default_rng(7)
    depths = np.linspace(0.3 * LENGTH, 0.7 * LENGTH, count)
    if plant.scene.support.kind == "entry":
        depths = np.concatenate([[0.0, 0.5 * plant.smallest_depth], np.linspace(0.02 * LENGTH, LENGTH, count - 2)])
    coordinates = random.normal(0.0, 1e-3, (count, plant.size))
    return coordinates, random.normal(size=(count, len(plant.points(0.1).rows))), depths


# A third derivative of a projection is what rounding in its coordinates, times their number cubed, leaves of it.
ALLOWED = {False: (1e-13, 1e-13, 1e-13, 1e-13), True: (1e-13, 1e-13, 1e-11, 1e-9)}


@pytest.mark.parametrize("numbers", [row_blocks.NUMBERS, 4000], ids=["one block", "many blocks"])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_many_rows_deflect_as_each_of_them(case, numbers, monkeypatch):
    monkeypatch.setattr(row_blocks, "NUMBERS", numbers)
    plant, stations = case.plant, np.linspace(0.0, LENGTH, 41)
    coordinates, forces, depths = states(plant)
    for derivative, allowed in enumerate(ALLOWED[case.name == "projected"]):
        found = plant.deflection(coordinates, forces, depths, stations, derivative)
        rows = zip(coordinates, forces, depths.tolist(), strict=True)
        expected = np.stack([plant.deflection(*row, stations, derivative) for row in rows])
        assert found.shape == expected.shape
        assert np.max(np.abs(found - expected)) <= allowed * np.max(np.abs(expected))


@pytest.mark.parametrize("rows", [0, 1])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_no_row_and_one_row(case, rows):
    plant, stations = case.plant, np.linspace(0.0, LENGTH, 5)
    coordinates, forces, depths = (part[-1:][:rows] for part in states(plant))
    found = plant.deflection(coordinates, forces, depths, stations)
    assert found.shape == (rows, 5)
    if rows:
        expected = plant.deflection(coordinates[0], forces[0], float(depths[0]), stations)
        assert found[0] == pytest.approx(expected, rel=1e-13, abs=1e-15)


@pytest.mark.parametrize("rows", [0, 1, 7, 8, 9, 1000])
def test_blocks_cover_every_row_once(rows, monkeypatch):
    monkeypatch.setattr(row_blocks, "NUMBERS", 80)
    covered = [row for block in row_blocks.row_blocks(rows, 10) for row in range(rows)[block]]
    assert covered == list(range(rows))
    assert [block.stop - block.start for block in row_blocks.row_blocks(2, 1000)] == [1, 1]  # however long a row is


GUIDED = {"support": {"guides": [Guide(position=-0.03, stiffness=500.0)]}, "duration": 0.1}


@pytest.mark.parametrize("support", ["entry", "hub"])
def test_a_trajectory_has_the_samples_and_their_shapes(support):
    loads = [TipLoad(force=0.1), *([LateralLoad(position=-0.0123, force=0.3)] if support == "hub" else [])]
    scene = scene_of(support, moving(0.5, 0.04, 0.09), GEL, loads, **(GUIDED if support == "hub" else {"duration": 0.1}))
    plant = FiniteElementNeedle(scene, elements=4)
    whole = joined(list(run_samples(plant, without_inertia(scene), time_grid(plant, 0.01, 0.01))))
    shown = [whole.rows(slice(row, row + 1)) for row in range(len(whole))]
    run = trajectory_from_samples(plant, whole, {})
    tip, hub = np.array([LENGTH]), np.zeros(1)
    for row, sample in enumerate(shown):
        state = (sample.coordinates[0], sample.point_forces[0], float(sample.depth[0]))
        assert run.station_deflection[row] == pytest.approx(plant.deflection(*state, run.arc_length), rel=1e-13, abs=1e-16)
        assert run.deflection(tip, 2)[row] == pytest.approx(plant.deflection(*state, tip, 2), rel=1e-13, abs=1e-14)
        assert run.tip_angle[row] == pytest.approx(plant.deflection(*state, tip, 1)[0], rel=1e-13)
        assert run.hub_angle[row] == pytest.approx(plant.deflection(*state, hub, 1)[0], rel=1e-13, abs=1e-16)
        assert run.tissue_force[row] == sample.tissue_force[0] and run.time[row] == sample.time[0]
        assert np.array_equal(run.guide_force[row], sample.guide_force[0])
    assert np.ptp(run.tip_deflection) > 0.0


def test_the_frame_of_a_row_has_its_own_path():
    scene = scene_of("entry", moving(0.5, 0.04, 0.09), GEL, [TipLoad(force=0.1)], duration=0.1)
    scene = scene.with_value("tissue.rest_line", "cut-path")
    blocks: list[Samples] = []
    run = run_scene(scene, elements=4, time_step=1e-3, output_step=0.01, analysis="dynamic", observer=Keeps(blocks))
    found = joined(blocks)
    assert found.path_points[0] == 0 and np.all(np.diff(found.path_points) >= 0) and found.path_points[-1] > 50
    frames = frames_of_samples(run.plant, found, run.arc_length)
    assert np.array_equal([frame.time for frame in frames], run.time)
    for row, frame in enumerate(frames):
        if found.path_points[row]:
            assert np.array_equal(frame.path.edges, run.path_position[1 : found.path_points[row]])
            assert np.all(frame.path.edges <= frame.depth)
        assert np.array_equal(frame.deflection, run.station_deflection[row])
    assert frames[-1].path.deepest == pytest.approx(0.09, rel=1e-12)


class Keeps:
    """An observer that keeps the samples."""

    def __init__(self, blocks):
        self.blocks = blocks

    def begin(self, plant, choice):
        pass

    def progress(self, fraction):
        pass

    def samples(self, block):
        self.blocks.append(block)
