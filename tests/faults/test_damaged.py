"""Damaged and hostile run folders, meshes and tables: one clear error, nothing outside is read, little memory is used."""

import shutil
import struct
import zlib
from base64 import b64encode

import h5py
import numpy as np
import pytest

from fem_needle import load_scene
from fem_needle.errors import SceneError
from fem_needle.mesh_file import read_mesh
from fem_needle.run_folder import load_run
from tests.faults.short_run import compute

SECRET = "not yours"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert compute(folder) == 0
    return folder


@pytest.fixture
def copy(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "copy")


def refused(folder):
    """Load a run that may be refused, never anything else; return the message."""
    try:
        load_run(folder)
    except SceneError as error:
        assert len(str(error)) < 2000
        return str(error)
    return None


@pytest.mark.parametrize("name", ["series.nc", "summary.json", "manifest.json", "scene.toml"])
def test_a_truncated_file_is_refused(copy, name):
    content = (copy / name).read_bytes()
    for share in np.linspace(0.0, 0.97, 12):
        (copy / name).write_bytes(content[: int(share * len(content))])
        assert refused(copy) is not None or name == "scene.toml"  # a scene may end early and still be one
    (copy / name).unlink()
    assert refused(copy)


@pytest.mark.parametrize("name", ["series.nc", "summary.json", "manifest.json", "scene.toml"])
def test_bytes_that_change_are_refused_or_read(copy, name):
    content, random = (copy / name).read_bytes(), np.random.default_rng(5)
    for _ in range(40):
        changed = bytearray(content)
        for place in random.integers(0, len(content), 4):
            changed[place] = random.integers(0, 256)
        (copy / name).write_bytes(bytes(changed))
        refused(copy)


@pytest.mark.parametrize("content", [b"[" * 100_000, b"{}", b"[]", b"1", b'{"a": ' * 50_000])
def test_summaries_of_another_kind(copy, content):
    (copy / "summary.json").write_bytes(content)
    message = refused(copy)
    assert message is None if content == b"{}" else "not complete" in message


def with_item(copy, change):
    with h5py.File(copy / "series.nc", "r+") as file:
        del file["depth"]
        change(file)
    return refused(copy)


def test_a_series_that_leads_to_another_file_is_refused(copy, tmp_path):
    with h5py.File(tmp_path / "other.nc", "w") as other:
        other["depth"] = np.arange(3.0)
    (tmp_path / "raw").write_bytes(SECRET.encode() * 9)
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(tmp_path / "other.nc", "depth", (3,))
    changes = {
        "link to another file": lambda file: file.__setitem__("depth", h5py.ExternalLink(str(tmp_path / "other.nc"), "depth")),
        "lies in another file": lambda file: file.create_virtual_dataset("depth", layout),
    }
    for message, change in changes.items():
        folder = shutil.copytree(copy, tmp_path / message)
        assert message in with_item(folder, change)
    raw = [(str(tmp_path / "raw"), 0, 24)]
    message = with_item(copy, lambda file: file.create_dataset("depth", (3,), "f8", external=raw))
    assert "lies in another file" in message


def test_a_series_that_promises_too_much_is_refused_unread(copy):
    message = with_item(copy, lambda file: file.create_dataset("depth", (10**12,), "f8", chunks=(10**5,)))
    assert "8e+03 GB of numbers (allowed up to 4 GB)" in message


def test_a_link_in_a_circle_is_refused(copy):
    assert with_item(copy, lambda file: file.__setitem__("depth", h5py.SoftLink("/depth")))


@pytest.mark.parametrize("file", ["../table.csv", "/etc/passwd", "sub/../../table.csv", "link.csv", "nul\\u0000", "", "."])
@pytest.mark.parametrize("key", ["table", "mesh"])
def test_a_scene_reads_inside_its_folder_only(tmp_path, file, key):
    (tmp_path / "table.csv").write_text(f"time [s],{SECRET}\n0,1\n1,2\n")
    inner = tmp_path / "scenes"
    inner.mkdir()
    (inner / "link.csv").symlink_to(tmp_path / "table.csv")
    text = SCENE.replace("force = 0.1", f'force = {{ file = "{file}", column = "force" }}')
    if key == "mesh":
        text = SCENE + f'\n[numerics]\nmesh = "{file}"\n'
    (inner / "scene.toml").write_text(text)
    with pytest.raises(SceneError) as caught:
        load_scene(inner / "scene.toml")
    assert SECRET not in str(caught.value)


SCENE = """
[needle]
length = 0.2
bending_stiffness = 0.0256
mass_per_length = 0.01
[support]
kind = "entry"
[insertion]
kind = "hold"
initial_depth = 0.1
[run]
duration = 1.0
[tissue]
[[tissue.layers]]
foundation_modulus = 520.0
[[loads]]
kind = "tip"
force = 0.1
"""


def test_the_scene_of_the_tests_is_one(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    assert load_scene(tmp_path / "scene.toml").needle.length == 0.2


ENTITY = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><VTKFile>&b;</VTKFile>'
XDMF = (
    '<Xdmf Version="3.0"><Domain><Grid><Geometry><DataItem Format="{kind}" Dimensions="2 3">{item}</DataItem></Geometry></Grid>'
    "</Domain></Xdmf>"
)


def bomb():
    """Return a .vtu of some kilobytes that unpacks to 20 GB of points."""
    size, count = 2**20, 20_000
    block = zlib.compress(bytes(size), 9)
    header = struct.pack(f"<{3 + count}I", count, size, 0, *[len(block)] * count)
    data = b64encode(header) + b64encode(block * count)
    cells = '<DataArray type="Int32" Name="{}" format="ascii">{}</DataArray>'
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="2" NumberOfCells="1"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{data.decode()}</DataArray></Points><Cells>'
        f"{cells.format('connectivity', '0 1')}{cells.format('offsets', '2')}{cells.format('types', '3')}"
        "</Cells></Piece></UnstructuredGrid></VTKFile>"
    ).encode()


def linked(path):
    with h5py.File(path, "w") as file:
        file["tstt"] = h5py.ExternalLink("/etc/other.h5", "x")
    return path.read_bytes()


HOSTILE = {
    "entities.vtu": (lambda path: ENTITY.encode(), "entities"),
    "out.xdmf": (lambda path: XDMF.format(kind="HDF", item="../other.h5:/data").encode(), "not inside its folder"),
    "absolute.xdmf": (lambda path: XDMF.format(kind="Binary", item="/etc/passwd").encode(), "not inside its folder"),
    "linked.h5m": (linked, "link to another file"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_meshes_are_refused(tmp_path, name):
    make, message = HOSTILE[name]
    path = tmp_path / name
    path.write_bytes(make(path))
    with pytest.raises(SceneError, match=message):
        read_mesh(path)


@pytest.mark.slow
def test_a_mesh_that_unpacks_to_20_gigabytes_is_refused(tmp_path):
    (tmp_path / "bomb.vtu").write_bytes(bomb())
    with pytest.raises(SceneError, match="takes more than 2 GB"):
        read_mesh(tmp_path / "bomb.vtu")
