"""Mesh files: read whatever meshio wrote, refuse everything that is no needle, and compute with what is left."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, Layer, Scene, load_scene, mesh_file, run_scene, solve_static
from fem_needle.errors import SceneError
from fem_needle.mesh_file import read_mesh
from fem_needle.run_folder import load_run
from tests.consistency.scenes import held, scene_of
from tests.unit.scene.examples import entry_data

MESHES = Path(__file__).parents[2] / "meshes"
UNIFORM = MESHES / "needle-uniform.vtu"
NODES = np.array([0.0, 0.03, 0.07, 0.2])
CHAIN = np.array([[0, 1], [1, 2], [2, 3]])


def write(path: Path, positions=NODES, lines=CHAIN, *, points=None, cells=None, **options) -> Path:
    if points is None:
        points = np.column_stack((positions, np.zeros((len(positions), 2))))
    meshio.Mesh(points, cells or [("line", np.asarray(lines))]).write(path, **options)
    return path


WRITERS = {
    "binary.vtu": {"binary": True},
    "text.vtu": {"binary": False},
    "legacy.vtk": {},
    "gmsh-4.msh": {"file_format": "gmsh"},
    "gmsh-2.msh": {"file_format": "gmsh22", "binary": False},
    "h5.xdmf": {},
    "abaqus.inp": {},
    "medit.mesh": {},
}


@pytest.mark.parametrize("name", WRITERS)
def test_formats(tmp_path, capfd, name):
    path = write(tmp_path / name, **WRITERS[name])
    capfd.readouterr()
    np.testing.assert_allclose(read_mesh(path), NODES, rtol=0, atol=1e-16)
    assert capfd.readouterr() == ("", "")


def test_the_order_of_nodes_and_lines_does_not_matter(tmp_path):
    shuffled = write(tmp_path / "a.vtu", NODES[[2, 0, 3, 1]], [[2, 0], [0, 3], [1, 3]])
    np.testing.assert_array_equal(read_mesh(shuffled), NODES)
    blocks = [("vertex", [[0], [3]]), ("line", CHAIN[:1]), ("line", CHAIN[1:, ::-1])]
    np.testing.assert_array_equal(read_mesh(write(tmp_path / "b.vtu", cells=blocks)), NODES)


def test_any_axis_and_both_ends_as_origin(tmp_path):
    beside = np.full(4, 0.01)
    along_z = write(tmp_path / "z.vtu", points=np.column_stack((beside, beside, NODES)))
    np.testing.assert_array_equal(read_mesh(along_z), NODES)
    from_the_tip = write(tmp_path / "t.vtu", NODES - 0.2)
    np.testing.assert_allclose(read_mesh(from_the_tip), NODES, rtol=0, atol=1e-16)
    plane = write(tmp_path / "p.vtk", points=np.column_stack((NODES, beside)))
    np.testing.assert_array_equal(read_mesh(plane), NODES)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
BAD_MESHES = {
    "tetrahedra": ({"points": np.eye(4, 3), "cells": [("tetra", [[0, 1, 2, 3]])]}, "tetra cells"),
    "triangles with edges": ({"points": SQUARE, "cells": [("line", CHAIN), ("triangle", [[0, 1, 2]])]}, "triangle cells"),
    "second-order lines": ({"cells": [("line3", [[0, 2, 1]]), ("line", CHAIN)]}, "line3 cells"),
    "points alone": ({"cells": [("vertex", [[0], [1]])]}, "no line cells"),
    "a branch": ({"lines": [*CHAIN, [1, 3]]}, r"branches: 3 lines meet at \(0\.03, 0, 0\)"),
    "a ring": ({"lines": [*CHAIN, [3, 0]]}, "closed line"),
    "a gap": ({"lines": CHAIN[[0, 2]]}, "gap"),
    "a line twice": ({"lines": [*CHAIN, [1, 2]]}, "branches"),
    "a line on itself": ({"lines": [[0, 1], [1, 2], [3, 3]]}, "gap"),
    "an unused point": ({"positions": [0.0, 0.03, 0.07, 0.2, 0.1]}, "1 points that belong to no line"),
    "a fold": ({"positions": [0.0, 0.1, 0.05, 0.2]}, "runs back on itself"),
    "two nodes at one place": ({"positions": [0.0, 0.07 - 1e-12, 0.07, 0.2]}, "two nodes at one place"),
    "a bend": ({"points": SQUARE}, "not straight along one axis"),
    "slightly off the axis": ({"points": np.column_stack((NODES, [0, 0, 1e-9, 0], 0 * NODES))}, "not straight"),
    "one point": ({"positions": [0.1, 0.1], "lines": [[0, 1]]}, "not straight"),
    "no origin": ({"positions": NODES + 0.01}, r"runs from 0\.01 to 0\.21"),
    "not a number": ({"positions": [0.0, np.nan, 0.07, 0.2]}, "not finite"),
    "a point that is not there": ({"lines": [[0, 1], [1, 2], [2, 9]]}, "points that it does not hold"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_meshes_that_are_no_needle(tmp_path, name):
    parts, message = BAD_MESHES[name]
    path = write(tmp_path / "bad.vtu", **parts)
    with pytest.raises(SceneError, match=message) as caught:
        read_mesh(path)
    assert str(caught.value).startswith("'bad.vtu' ")
    assert len(str(caught.value).splitlines()) == 1


def test_the_block_is_no_needle():
    with pytest.raises(SceneError, match="hexahedron cells"):
        read_mesh(MESHES / "phantom-block.vtu")


GARBAGE = bytes(range(256)) * 8


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("missing.vtu", None, "does not exist"),
        ("empty.vtu", b"", "is empty"),
        ("garbage.vtu", GARBAGE, "cannot be read as a mesh"),
        ("garbage.msh", GARBAGE, "cannot be read as a mesh"),
        ("garbage.xdmf", GARBAGE, "cannot be read as a mesh"),
        ("garbage.h5m", GARBAGE, "cannot be read as a mesh"),
        ("text.inp", b"not a mesh\n", "cannot be read as a mesh|no line cells"),
        ("notes.txt", b"not a mesh\n", "no format that meshio reads"),
        ("noending", b"not a mesh\n", "no format that meshio reads"),
    ],
)
def test_files_that_are_no_meshes(tmp_path, capfd, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match=message) as caught:
        read_mesh(tmp_path / name)
    assert len(str(caught.value).splitlines()) == 1
    assert capfd.readouterr() == ("", "")


def test_a_folder_is_no_mesh(tmp_path):
    with pytest.raises(SceneError, match="is not a file"):
        read_mesh(tmp_path)
    with pytest.raises(SceneError, match="nul"):
        read_mesh(tmp_path / "nul\0.vtu")


@pytest.mark.parametrize("name", ["binary.vtu", "gmsh-4.msh"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
def test_a_truncated_file(tmp_path, name, share):
    path = write(tmp_path / name, **WRITERS[name])
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(SceneError, match=r"cannot be read|no line cells|belong to no line|does not hold"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import time; time.sleep(60)", r"did not end within 0\.5"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", r"broke off \(status -9\)"),
        ("print('other')", "no answer"),
    ],
)
def test_a_reader_that_does_not_end_well(tmp_path, monkeypatch, program, message):
    (tmp_path / "reader.py").write_text(program)
    monkeypatch.setattr(mesh_file, "READER", tmp_path / "reader.py")
    monkeypatch.setattr(mesh_file, "SECONDS", 0.5)
    with pytest.raises(SceneError, match=message):
        read_mesh(UNIFORM)


def with_mesh(mesh, **changes) -> Scene:
    return Scene.from_dict(entry_data(numerics={"mesh": mesh} | changes))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        ([0.0], "got 1 node positions; allowed 2 to"),
        ([], "got 0 node positions"),
        ([0.0, 0.1, 0.1, 0.2], "do not rise"),
        ([0.0, 0.2, 0.1], "do not rise"),
        ([0.01, 0.2], "first node at 0.01"),
        ([0.0, float("nan"), 0.2], "not finite"),
        ([0.0, "fast", 0.2], "fast"),
        ([[0.0, 0.2]], "number"),
        (0.2, "is no mesh"),
        ("needle.vtu", "use --mesh"),
        ([0.0, 100.0, 200.0], "looks like mm"),
        ([0.0, 0.1, np.float32(0.2).item()], "single precision"),
        ([0.0, 0.1], "does not end at the tip"),
    ],
)
def test_lists_that_are_no_mesh(mesh, message):
    with pytest.raises(SceneError, match=message) as caught:
        with_mesh(mesh)
    assert all(line.startswith("numerics.mesh") for line in caught.value.mistakes)


def test_positions_may_carry_units():
    assert with_mesh(["0 mm", "50 mm", 0.2]).numerics.mesh == (0.0, 0.05, 0.2)


def test_elements_and_a_mesh_are_one_too_many():
    with pytest.raises(SceneError, match="elements = 4; allowed one of the two"):
        with_mesh([0.0, 0.2], elements=4)
    scene = with_mesh([0.0, 0.2])
    with pytest.raises(SceneError, match="allowed one of the two"):
        FiniteElementNeedle(scene, elements=4, mesh=[0.0, 0.2])
    with pytest.raises(SceneError, match="allowed one of the two"):
        run_scene(scene, elements=4, mesh=[0.0, 0.2])


def test_a_scene_reads_a_file_of_its_folder_only(tmp_path):
    (tmp_path / "deep").mkdir()
    write(tmp_path / "deep" / "needle.vtu")
    data = entry_data(numerics={"mesh": "deep/needle.vtu"})
    scene = Scene.from_dict(data, folder=tmp_path)
    assert scene.numerics.mesh == tuple(NODES)
    assert Scene.from_dict(scene.to_dict(complete=True)) == scene
    for name in ("../needle.vtu", str(tmp_path / "deep" / "needle.vtu"), "deep/../deep/needle.vtu"):
        with pytest.raises(SceneError, match="inside the scene's folder"):
            Scene.from_dict(entry_data(numerics={"mesh": name}), folder=tmp_path)
    with pytest.raises(SceneError, match=r"'none\.vtu' does not exist"):
        Scene.from_dict(entry_data(numerics={"mesh": "none.vtu"}), folder=tmp_path)


def test_a_needle_takes_a_file_an_array_or_the_mesh_of_its_scene():
    hub = scene_of("hub", held(0.1))
    nodes = read_mesh(MESHES / "needle-fine-at-tip.vtu")
    for mesh in (MESHES / "needle-fine-at-tip.vtu", str(MESHES / "needle-fine-at-tip.vtu"), nodes, nodes.tolist()):
        np.testing.assert_array_equal(FiniteElementNeedle(hub, mesh=mesh).mesh.nodes, nodes)
    entry = with_mesh(nodes.tolist())
    np.testing.assert_allclose(FiniteElementNeedle(entry).mesh.nodes, nodes / 0.2, rtol=1e-15)
    assert FiniteElementNeedle(entry).mesh.nodes[-1] == 1.0
    assert FiniteElementNeedle(entry, elements=3).mesh.elements == 3
    assert FiniteElementNeedle(hub).mesh.elements == 40
    wrong = {"do not rise": [0.0, 0.2, 0.1], "looks like mm": [0.0, 200.0], "does not exist": "none.vtu"}
    for message, mesh in wrong.items():
        with pytest.raises(SceneError, match=f"^mesh: .*{message}"):
            FiniteElementNeedle(hub, mesh=mesh)


LAYERS = (Layer(start=0.0, end=0.0437, foundation_modulus=5e3, damping=5.0), Layer(start=0.05, foundation_modulus=2e4))


@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_a_uniform_mesh_gives_the_static_tip_of_equal_elements(kind):
    scene = scene_of(kind, held(0.1), LAYERS)
    given = solve_static(FiniteElementNeedle(scene, mesh=UNIFORM), depth=0.0913).tip_deflection
    built = solve_static(FiniteElementNeedle(scene, elements=40), depth=0.0913).tip_deflection
    assert given == pytest.approx(built, rel=1e-10, abs=0.0)
    assert built != 0.0


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("thesis", {"analysis": "quasi-static", "time_step": 0.5}),
        ("bench-m2", {"analysis": "dynamic", "time_step": 2e-3}),
        ("release", {"analysis": "dynamic", "time_step": 1e-3}),
    ],
)
def test_a_uniform_mesh_gives_the_run_of_equal_elements(name, settings):
    scene = load_scene(name)
    mesh = read_mesh(UNIFORM) * (scene.needle.length / 0.2)
    given, built = run_scene(scene, mesh=mesh, **settings), run_scene(scene, elements=40, **settings)
    scale = np.max(np.abs(built.tip_deflection))
    assert scale > 1e-6
    np.testing.assert_allclose(given.tip_deflection, built.tip_deflection, rtol=0.0, atol=1e-10 * scale)
    assert given.summary["elements"] == 40
    assert given.summary["error_estimate"] == pytest.approx(built.summary["error_estimate"], abs=1e-9)


@pytest.mark.parametrize("name", ["needle-fine-at-tip.vtu", "needle-fine-at-skin.vtu"])
@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_graded_meshes_agree_with_a_fine_one(kind, name):
    """40 elements of degree 4 have a relative error of some 1e-7 here; a wrong element length would cost percents."""
    scene = scene_of(kind, held(0.1), LAYERS)
    graded = solve_static(FiniteElementNeedle(scene, mesh=MESHES / name), depth=0.1).tip_deflection
    fine = solve_static(FiniteElementNeedle(scene, elements=160), depth=0.1).tip_deflection
    assert graded == pytest.approx(fine, rel=2e-6)
    assert graded != fine


def test_the_shipped_meshes_are_those_of_their_script(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["make_meshes.py", str(tmp_path)])
    runpy.run_path(str(MESHES / "make_meshes.py"), run_name="__main__")
    assert {path.name for path in MESHES.glob("*.vtu")} == {path.name for path in tmp_path.iterdir()}
    listed = (MESHES / "README.md").read_text(encoding="utf-8")
    for made in tmp_path.iterdir():
        shipped, again = meshio.read(MESHES / made.name), meshio.read(made)
        np.testing.assert_allclose(shipped.points, again.points, rtol=0, atol=1e-15)
        np.testing.assert_array_equal(shipped.cells[0].data, again.cells[0].data)
        assert f"`{made.name}`" in listed
    assert "wrote" in capsys.readouterr().out


def test_how_the_shipped_meshes_are_graded():
    names = ("uniform", "fine-at-tip", "fine-at-skin")
    ends = {name: np.diff(read_mesh(MESHES / f"needle-{name}.vtu"))[[0, -1]] for name in names}
    assert ends["uniform"][0] == pytest.approx(ends["uniform"][1])
    assert ends["fine-at-tip"][0] == pytest.approx(10 * ends["fine-at-tip"][1])
    assert ends["fine-at-skin"][1] == pytest.approx(10 * ends["fine-at-skin"][0])


def test_the_block_fills_its_volume():
    mesh = meshio.read(MESHES / "phantom-block.vtu")
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    edges = [corners[:, corner] - corners[:, 0] for corner in (1, 3, 4)]
    volumes = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2])
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(0.25 * 0.08 * 0.08)


@pytest.fixture
def command(command_line, monkeypatch, tmp_path):
    """Run the command, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return command_line


SHORT = ("--set", "insertion.final_depth=0.03", "--output-step", "0.5", "--no-vtk", "--json")


def test_a_run_with_a_mesh_is_repeated_without_its_file(command, tmp_path):
    mesh = write(tmp_path / "needle.vtu")
    assert command("run", "thesis", *SHORT, "--mesh", str(mesh))[0] == 0
    mesh.unlink()
    status, out, _ = command("run", "runs/thesis/scene.toml", "--no-vtk", "--json", "--out", "again")
    assert (status, json.loads(out)["elements"]) == (0, 3)
    first, again = load_run(tmp_path / "runs" / "thesis"), load_run(tmp_path / "again")
    assert first.scene.numerics.mesh == tuple(NODES)
    np.testing.assert_array_equal(first.tip_deflection, again.tip_deflection)
    status, out, _ = command("run", "runs/thesis/scene.toml", "--no-vtk", "--json", "--elements", "5")
    assert (status, json.loads(out)["elements"]) == (0, 5)
    status, out, _ = command("check", "runs/thesis/scene.toml")
    assert (status, "mesh of 3 elements" in out) == (0, True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--mesh", "none.vtu"), "mesh: 'none.vtu' does not exist"),
        (("--mesh", str(MESHES / "phantom-block.vtu")), "hexahedron"),
        (("--mesh", str(UNIFORM), "--elements", "4"), "allowed one of the two"),
        (("--mesh", str(UNIFORM), "--set", "needle.length=0.3"), "does not end at the tip"),
    ],
)
def test_a_wrong_mesh_writes_nothing(command, tmp_path, options, message):
    status, out, err = command("run", "thesis", *options)
    assert (status, out) == (2, "")
    assert message in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


WRITTEN = "1, 0., 0., 0.\n2, 0.1, 0., 0.\n3, 0.2, 0., 0.\n"
ELEMENTS = "1, 1, 2\n2, 2, 3\n"
GMSH = "$Nodes\n3\n1 0 0 0\n2 0.1 0 0\n3 0.2 0 0\n$EndNodes\n$Elements\n2\n1 1 2 0 1 1 2\n2 1 2 0 1 2 3\n$EndElements\n"
READ = {
    **{f"{kind}.inp": f"*NODE\n{WRITTEN}*ELEMENT, TYPE={kind}\n{ELEMENTS}" for kind in ("B31", "B33", "B23", "PIPE31", "T3D2")},
    "two.inp": f"*Node\n1, 0., 0., 0.\n*Node, nset=b\n** more\n2, 0.1, 0., 0.\n3, 0.2, 0., 0.\n*Element, type=b33\n{ELEMENTS}",
    "late.inp": f"*NODE\n1, 0., 0., 0.\n2, 0.1, 0., 0.\n*ELEMENT, TYPE=B31\n{ELEMENTS}*NODE\n3, 0.2, 0., 0.\n*NODE OUTPUT\nU\n",
    "plain.msh": f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{GMSH}",
    "blank.msh": f"\ufeff\n\n$MeshFormat\n2.1 0 8\n$EndMeshFormat\n{GMSH}",
}
NOT_READ = {
    "shell.inp": (f"*NODE\n{WRITTEN}*ELEMENT, TYPE=SC8R\n1, 1, 2\n", r"elements of type SC8R .line 5. are not read; allowed B21"),
    "quadratic.inp": (f"*NODE\n{WRITTEN}*ELEMENT, TYPE=B32\n1, 1, 2, 3\n", "holds line3 cells"),
    "made.inp": ("*NODE\n1,0.,0.,0.\n3,0.2,0.,0.\n*NGEN\n1,3\n", r"\*NGEN in line 4 is not read"),
    "leads.inp": ("*INCLUDE, INPUT=nodes.inp\n", r"\*INCLUDE in line 1 is not read"),
    "parts.inp": (f"*NODE\n{WRITTEN}*NODE\n{WRITTEN}", "node 1 is there twice"),
    "one.msh": ("$NOD\n3\n", "Gmsh's format 1 .* is not read; save it in format 2.2 or 4.1"),
    "three.msh": (f"$MeshFormat\n3 0 8\n$EndMeshFormat\n{GMSH}", "format 3 of Gmsh is not read"),
    "other.msh": (f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{GMSH}", "what follows is not format 4.1 of Gmsh, as its header says"),
    "none.msh": (GMSH, "no .MeshFormat with a version of Gmsh"),
}


@pytest.mark.parametrize("name", READ)
def test_variants_of_abaqus_and_gmsh_are_read(tmp_path, name):
    (tmp_path / name).write_text(READ[name], encoding="utf-8")
    assert read_mesh(tmp_path / name).tolist() == [0.0, 0.1, 0.2]


@pytest.mark.parametrize("name", NOT_READ)
def test_what_is_not_read_is_named(tmp_path, name):
    content, message = NOT_READ[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(SceneError, match=message) as caught:
        read_mesh(tmp_path / name)
    assert "damaged" not in str(caught.value)
