"""What ParaView shows, read back with two other readers and compared with formulas."""

from __future__ import annotations

from itertools import pairwise

import meshio
import numpy as np
import pytest
import pyvista

from fem_needle import FiniteElementNeedle, Insertion, Layer, Needle, Scene, Sinusoid, Tissue, run_scene, solve_static
from fem_needle.path import straight_path
from fem_needle.run_folder import save_run
from fem_needle.tissue_block import MOST_POINTS, tissue_block
from fem_needle.vtk_export import Frame, VtkSeries, needle_arrays
from tests.unit.scene.examples import entry_data, hub_scene

NUMERICS = {"analysis": "static", "elements": 8, "time_step": 1.0, "output_step": 1.0, "output_points": 41}
LAYERS = (
    Layer(name="skin", start=0.0, end=0.01, foundation_modulus=5e3),
    Layer(name="deep", start=0.03, foundation_modulus=2e4),
)


def hub() -> Scene:
    """From 20 to 60 mm in 4 s through a layer, a gap and a layer; swelling tissue."""
    return hub_scene(
        insertion=Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.06),
        tissue=Tissue(layers=LAYERS, stiffness_factor=Sinusoid(mean=1.0, amplitude=0.5, frequency=0.1)),
        numerics=NUMERICS,
    )


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    run = run_scene(hub())
    return run, save_run(run, tmp_path_factory.mktemp("runs") / "hub")


@pytest.fixture(scope="module")
def cantilever(tmp_path_factory):
    """No tissue: 100 mm bend under 0.1 N."""
    data = entry_data(tissue={"layers": []}, numerics=NUMERICS, loads=[{"kind": "tip", "force": 0.1}])
    run = run_scene(Scene.from_dict(data))
    return run, save_run(run, tmp_path_factory.mktemp("runs") / "entry")


def test_the_collection_lists_every_row_with_relative_files(saved):
    run, folder = saved
    reader = pyvista.PVDReader(folder / "deflection.pvd")
    np.testing.assert_array_equal(reader.time_values, run.time)
    assert len(run.time) == 5
    assert [(d.time, d.part, d.path) for d in reader.datasets] == [
        (time, part, f"{name}/{row:06d}.{ending}")
        for row, time in enumerate(run.time)
        for part, (name, ending) in enumerate((("needle", "vtp"), ("tissue", "vtu")))
    ]
    reader.set_active_time_value(run.time[2])
    blocks = reader.read()
    assert [block.n_cells > 0 for block in blocks] == [True, True]


@pytest.mark.parametrize("row", [0, 4])
def test_the_needle_lies_where_it_is_and_warps_to_its_deflection(saved, row):
    run, folder = saved
    needle = pyvista.read(folder / f"needle/{row:06d}.vtp")
    depth, length = run.depth[row], 0.2
    assert needle.n_lines == needle.n_cells == 1
    np.testing.assert_array_equal(needle.lines, [41, *range(41)])
    np.testing.assert_allclose(needle.points[:, 0], np.linspace(depth - length, depth, 41), atol=1e-15)
    np.testing.assert_array_equal(needle.points[:, 1:], 0.0)
    bent = needle.warp_by_vector("deflection")
    expected = solve_static(FiniteElementNeedle(hub(), elements=8), depth=depth, time=run.time[row])
    stations = np.linspace(0.0, length, 41)
    np.testing.assert_allclose(bent.points[:, 1], expected.deflection(stations), rtol=1e-10, atol=1e-15)
    assert bent.points[-1, 1] == pytest.approx(expected.tip_deflection, rel=1e-10)
    assert bent.points[0, 1] == 0.0
    np.testing.assert_allclose(bent.points[:, 0], needle.points[:, 0])


@pytest.mark.parametrize("row", [0, 1, 4])
def test_layers_and_their_reaction(saved, row):
    run, folder = saved
    needle = pyvista.read(folder / f"needle/{row:06d}.vtp")
    y, time = needle.points[:, 0], run.time[row]
    clear = np.min(np.abs(y[:, None] - [0.0, 0.01, 0.03]), axis=1) > 1e-9  # at an interface round-off decides
    layer = np.where(y < 0, -1, np.where(y < 0.01, 0, np.where(y < 0.03, -1, 1)))
    modulus = np.where(layer == 0, 5e3, np.where(layer == 1, 2e4, 0.0)) * (1 + 0.5 * np.sin(0.2 * np.pi * time))
    np.testing.assert_array_equal(needle["layer"][clear], layer[clear])
    np.testing.assert_allclose(needle["tissue_reaction"][clear], (-modulus * needle["deflection"][:, 1])[clear], rtol=1e-12)
    assert np.any(needle["tissue_reaction"] != 0)
    np.testing.assert_array_equal(needle["radius"], 1.27e-3 / 2)


def test_section_forces_are_those_of_a_cantilever(cantilever):
    run, folder = cantilever
    needle = pyvista.read(folder / "needle/000000.vtp")
    x, stiffness, force, depth = needle.points[:, 0], 0.0256, 0.1, 0.1
    inside = x > 1e-9
    assert np.count_nonzero(inside) == 20
    exact = force * x**2 * (3 * depth - x) / (6 * stiffness)
    np.testing.assert_allclose(needle["deflection"][inside, 1], exact[inside], rtol=1e-9)
    np.testing.assert_allclose(needle["bending_moment"][inside], (force * (depth - x))[inside], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(needle["shear_force"][inside], -force, rtol=1e-12)
    outside = x < -1e-9
    for name in ("bending_moment", "shear_force"):
        np.testing.assert_array_equal(needle[name][outside], 0.0)
    np.testing.assert_array_equal(needle["layer"], -1)
    np.testing.assert_array_equal(needle["radius"], 0.2 / 200)
    assert run.tip_deflection[0] == pytest.approx(exact[-1], rel=1e-9)


def test_no_tissue_no_block(cantilever):
    _, folder = cantilever
    assert not (folder / "tissue").exists()
    reader = pyvista.PVDReader(folder / "deflection.pvd")
    assert [dataset.path for dataset in reader.datasets] == ["needle/000000.vtp", "needle/000001.vtp"]


def test_the_block_is_the_layers(saved):
    _, folder = saved
    block = pyvista.read(folder / "tissue/000004.vtu")
    assert block.n_points <= MOST_POINTS
    assert set(block.celltypes) == {pyvista.CellType.HEXAHEDRON}
    sizes = block.compute_cell_sizes()["Volume"]
    assert np.all(sizes > 0)
    ends = {0: (0.0, 0.01), 1: (0.03, 1.25 * 0.06)}
    assert set(block["layer"]) == set(ends)
    for index, (start, end) in ends.items():
        part = block.extract_cells(block["layer"] == index)
        np.testing.assert_allclose(part.bounds, (start, end, -0.02, 0.02, -0.02, 0.02), atol=1e-8)
        assert sizes[block["layer"] == index].sum() == pytest.approx((end - start) * 0.04**2, rel=1e-6)


def test_another_reader_finds_the_same_block(saved):
    _, folder = saved
    path = folder / "tissue/000003.vtu"
    ours, theirs = meshio.read(path), pyvista.read(path)
    np.testing.assert_array_equal(ours.points, theirs.points)
    np.testing.assert_array_equal(ours.cells_dict["hexahedron"], theirs.cells_dict[pyvista.CellType.HEXAHEDRON])
    moved = ours.point_data["displacement_illustrative"]
    np.testing.assert_array_equal(moved, theirs["displacement_illustrative"])
    np.testing.assert_array_equal(ours.cell_data_dict["layer"]["hexahedron"], theirs["layer"])
    assert theirs.field_data["kernel_length"][0] == pytest.approx(0.2 / 30)
    assert np.any(moved != 0)


@pytest.mark.parametrize("row", [0, 4])
def test_the_tissue_moves_with_the_needle_by_the_kernel(saved, row):
    run, folder = saved
    block = pyvista.read(folder / f"tissue/{row:06d}.vtu")
    x, y, z = block.points.T.astype(float)
    depth = run.depth[row]
    needle = np.interp(x, np.linspace(depth - 0.2, depth, 41), run.station_deflection[row])
    expected = np.where(x <= depth, needle, 0.0) * np.exp(-np.hypot(y, z) * 30 / 0.2)
    clear = np.abs(x - depth) > 1e-7  # the tip itself is a matter of single precision
    moved = block["displacement_illustrative"]
    np.testing.assert_allclose(moved[clear, 1], expected[clear], rtol=1e-4, atol=1e-9)
    np.testing.assert_array_equal(moved[:, [0, 2]], 0.0)
    axis = (y == 0) & (z == 0)
    assert np.max(np.abs(moved[axis, 1])) > 0.5 * np.max(np.abs(run.station_deflection[row]))


@pytest.mark.parametrize("count", [1, 12, 30, 100])
def test_many_layers_make_no_large_files(count):
    ends = np.linspace(0.0, 0.1, count + 1)
    layers = [Layer(start=a, end=b, foundation_modulus=1e3) for a, b in pairwise(ends)]
    block = tissue_block(hub_scene(tissue=Tissue(layers=layers)), 0.16)
    assert block is not None
    assert count * 2 <= len(block.planes)
    assert len(block.planes) * len(block.kernel) <= MOST_POINTS
    assert (block.planes[0], block.planes[-1]) == (0.0, pytest.approx(0.1))


def test_a_layer_out_of_reach_is_not_drawn_to_its_far_side():
    layers = [Layer(start=0.0, end=5.0, foundation_modulus=1e3), Layer(start=5.0, foundation_modulus=1e3)]
    block = tissue_block(hub_scene(tissue=Tissue(layers=layers[:1])), 0.16)
    assert block is not None
    assert block.planes[-1] == pytest.approx(0.25)


def test_the_radius_is_that_of_the_section_or_one_to_see():
    numbers = np.zeros(3)
    frame, stations = Frame(0.0, 0.1, numbers, numbers, numbers, straight_path(0.1)), np.linspace(0.0, 0.2, 3)
    given = Needle(length=0.2, youngs_modulus=2e11, second_moment_of_area=1e-13, area=np.pi * 1e-6, density=8e3)
    direct = Needle(length=0.2, bending_stiffness=0.02, mass_per_length=0.01)
    for needle, radius in ((given, 1e-3), (direct, 1e-3)):
        found = needle_arrays(hub_scene(needle=needle), frame, stations)["radius"]
        np.testing.assert_allclose(found, radius)


def test_the_list_is_rewritten_often_but_not_at_every_one_of_many_frames(tmp_path, monkeypatch):
    monkeypatch.setattr("fem_needle.vtk_export.REWRITES", 10)
    stations = np.linspace(0.0, 0.2, 3)
    series = VtkSeries(tmp_path, Scene.from_dict(entry_data(tissue={"layers": []})), stations)
    listed = []
    for number in range(60):
        series.add(Frame(0.1 * number, 0.1, *np.zeros((3, 3)), straight_path(0.1)))
        listed.append(len(pyvista.PVDReader(tmp_path / "deflection.pvd").datasets))
    assert listed[:19] == list(range(1, 20))
    assert all(number + 1 - found <= (number + 1) // 10 for number, found in enumerate(listed))
    assert len(set(listed)) < 60
    series.close()
    assert len(pyvista.PVDReader(tmp_path / "deflection.pvd").datasets) == 60


def test_a_frame_that_is_broken_off_leaves_no_file(tmp_path, monkeypatch):
    series = VtkSeries(tmp_path, hub(), np.linspace(0.0, 0.2, 3))
    series.add(Frame(0.0, 0.1, *np.zeros((3, 3)), straight_path(0.1)))

    def interrupted(path, content):
        path.open("wb").close()
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.write_bytes", interrupted)
    with pytest.raises(KeyboardInterrupt):
        series.add(Frame(1.0, 0.1, *np.zeros((3, 3)), straight_path(0.1)))
    assert sorted(path.name for path in tmp_path.rglob("*.vt*")) == ["000000.vtp", "000000.vtu"]
