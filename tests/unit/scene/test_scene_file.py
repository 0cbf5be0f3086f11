"""Files: TOML scenes, CSV columns, shipped scenes."""

from __future__ import annotations

import json
import os
import re
import tomllib
from itertools import pairwise
from math import pi, sin

import pytest
from hypothesis import HealthCheck, given, settings

from fem_needle import scene_file, shipped
from fem_needle.errors import SceneError
from fem_needle.scene import Scene, Table
from fem_needle.scene_file import load_scene, parse_scene, save_scene
from tests.unit.scene.examples import hub_scene, scene_data

PLAIN = """
needle = { length = 0.2, bending_stiffness = 0.02, mass_per_length = 0.01 }
support = { kind = "entry" }
tissue = { layers = [{ foundation_modulus = 520.0 }] }
"""


def with_speed(value: str) -> str:
    return PLAIN + f'insertion = {{ kind = "speed", initial_depth = 0.0, speed = {value} }}\nrun = {{ duration = 1.0 }}\n'


@given(scene_data())
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
def test_save_and_load_lose_nothing(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "saved.toml"
    scene = Scene.from_dict(data)
    save_scene(scene, path)
    assert load_scene(path) == scene


def test_a_saved_scene_is_complete(tmp_path):
    save_scene(hub_scene(), tmp_path / "scene.toml")
    data = tomllib.loads((tmp_path / "scene.toml").read_text())
    assert data["numerics"]["output_points"] == 101
    assert data["friction"]["viscous"] == 0.0
    assert data["tissue"]["layers"][0]["cutting_force"] == 0.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b" \n\t", "is empty"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", "not UTF-8"),
        (b"title = 'a\x00b'", "not text"),
        ("title = 'größe'".encode("latin-1"), "not UTF-8"),
        (b"[needle\nlength = 3", "not TOML"),
        (b"a = " + b"[" * 100_000, "not TOML"),
        (b"a = " + b"9" * 5000, "not TOML"),
        (b"title = 1979-05-27", "title: is not a text"),
    ],
)
def test_a_bad_file_is_one_clear_line(tmp_path, content, message):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert any(message in line for line in caught.value.mistakes)
    assert all(len(line.splitlines()) == 1 for line in caught.value.mistakes)


def test_a_huge_file_is_not_read(tmp_path):
    path = tmp_path / "huge.toml"
    with path.open("wb") as file:
        file.truncate(50_000_001)
    with pytest.raises(SceneError, match="larger than 50 MB"):
        load_scene(path)


def test_what_is_no_file(tmp_path):
    with pytest.raises(SceneError, match="did you mean 'thesis'"):
        load_scene("thessis")
    with pytest.raises(SceneError, match="is not a file"):
        load_scene(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SceneError, match="is not a file"):
        load_scene(tmp_path / "pipe")


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbf" + with_speed("0.1, final_depth = 0.1").encode())
    assert load_scene(tmp_path / "scene.toml").needle.length == 0.2


def test_a_csv_column_with_units(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "speed.csv").write_text("force [N], time [ms] , speed [mm/s]\n9,0,10\n\n9,500,20\n9,1000,0\n")
    (tmp_path / "scene.toml").write_text(with_speed('{ file = "data/speed.csv", column = "speed" }'))
    scene = load_scene(tmp_path / "scene.toml")
    assert scene.insertion.speed == Table(time=[0.0, 0.5, 1.0], value=[0.01, 0.02, 0.0])
    save_scene(scene, tmp_path / "copy.toml")
    (tmp_path / "data" / "speed.csv").unlink()
    assert load_scene(tmp_path / "copy.toml") == scene


def test_a_csv_column_without_units_is_si(tmp_path):
    (tmp_path / "speed.csv").write_text("time,speed\r\n0,0.1\r\n1,0.2\r\n")
    scene = parse_scene(with_speed('{ file = "speed.csv", column = "speed" }'), tmp_path)
    assert scene.insertion.speed == Table(time=[0.0, 1.0], value=[0.1, 0.2])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"time,speed\n0,1\n", "at least 2 rows"),
        (b"time,velocity\n0,1\n1,2\n", "needs a column 'speed'"),
        (b"time,speed,speed\n0,1,1\n1,2,2\n", "column 'speed' comes twice"),
        (b"seconds,speed\n0,1\n1,2\n", "needs a column 'time'"),
        (b"time,speed\n0,1\n1,fast\n", "row 3 column 2 ('speed') is not a number (got 'fast')"),
        (b"time,speed\n0,1\n1\n", "row 3 column 2 ('speed') is missing"),
        (b"time,speed\n0,1\n0,2\n", "times must rise"),
        (b"time,speed\n0,1\n1,nan\n", "not finite"),
        (b"time,speed [N]\n0,1\n1,2\n", "wrong unit"),
        (b"time [mm],speed\n0,1\n1,2\n", "times in 'mm'"),
        (b"time [parsec],speed\n0,1\n1,2\n", "unknown unit"),
        (b"", "is empty"),
        (b"\xff\xfe\x00", "not UTF-8"),
        (b"\xfe", "not UTF-8"),
        (b'time,speed\n0,"1\n1,2\n', "insertion.speed"),
        (b"time,speed\n0," + b"1" * 200_000 + b"\n1,2\n", "insertion.speed"),
    ],
)
def test_a_wrong_csv_says_where(tmp_path, content, message):
    (tmp_path / "speed.csv").write_bytes(content)
    with pytest.raises(SceneError) as caught:
        parse_scene(with_speed('{ file = "speed.csv", column = "speed" }'), tmp_path)
    assert caught.value.mistakes[0].startswith("insertion.speed")
    assert message in caught.value.mistakes[0]


@pytest.mark.parametrize("file", ["../secret.csv", "sub/../../secret.csv", "link.csv", "linked/secret.csv", "", ".", "none.csv"])
def test_a_csv_file_stays_in_the_folder(tmp_path, file):
    (tmp_path / "secret.csv").write_text("time,speed\n0,0.1\n1,0.1\n")
    folder = tmp_path / "scene"
    (folder / "sub").mkdir(parents=True)
    (folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    (folder / "linked").symlink_to(tmp_path)
    for written in (file, str(tmp_path / "secret.csv")):
        with pytest.raises(SceneError, match=r"insertion.speed.file: .*(inside the scene's folder|not a file|not exist)"):
            parse_scene(with_speed(f'{{ file = "{written}", column = "speed" }}'), folder)


def test_a_csv_value_has_two_keys(tmp_path):
    with pytest.raises(SceneError) as caught:
        parse_scene(with_speed('{ file = "a.csv", unit = "mm/s" }'), tmp_path)
    assert [line.split(":")[0] for line in caught.value.mistakes] == ["insertion.speed.unit", "insertion.speed.column"]


@pytest.mark.parametrize("name", shipped.shipped_names())
def test_shipped_scenes_load_and_name_the_source_of_every_number(name):
    lines = shipped.shipped_path(name).read_text().splitlines()
    assert lines[:2] == [f'title = "{load_scene(name).title}"', "format_version = 1"]
    for before, line in pairwise(lines[1:]):
        value = line.split("#")[0].partition("=")[2]
        if any(sign.isdigit() for sign in value):
            assert "#" in line or before.startswith("#"), f"no source: {line}"


def test_all_scenes_of_the_contract_are_shipped():
    expected = "thesis brachytherapy release bench-s bench-d bench-m bench-m2 misra-2010 roesthuis-2012 abayazid-2013"
    expected += " thesis-open-loop liver-push thesis-pid thesis-inverse-dynamics steering steering-manual steering-stiff"
    expected += " friction-ramp three-layers bevel"
    assert set(shipped.shipped_names()) == set(expected.split())
    assert all(scene.title for scene in shipped.shipped_scenes())


def test_the_benchmarks_are_the_defined_ones():
    static, release, moving, swinging = (load_scene(f"bench-{name}") for name in ("s", "d", "m", "m2"))
    for scene in (static, release, moving, swinging):
        assert scene.support.kind == "entry"
        assert scene.needle.bending_stiffness == pytest.approx(0.0256, rel=1e-14)
        assert scene.needle.mass_per_length == pytest.approx(0.01016, rel=1e-14)
        assert [layer.foundation_modulus for layer in scene.tissue.layers] == [520.0]
        assert scene.tissue.layers[0].damping == 0.0
    assert (static.insertion.first_depth, static.loads[0].force, static.numerics.analysis) == (0.1, 0.1, "static")
    assert (release.duration, release.loads, release.numerics.output_step) == (0.1, (), 1e-4)
    assert moving.duration == pytest.approx(3.2)
    assert moving.insertion == swinging.insertion
    force = swinging.loads[0].force
    times = (0.0, 1 / 120, 0.0123)
    expected = [0.1, 0.15, 0.1 * (1 + 0.5 * sin(2 * pi * 30 * 0.0123))]
    assert [force.value(time) for time in times] == pytest.approx(expected, rel=1e-12)


def keys_of_schema(schema, part, path=()):
    """Yield the name of the part and the dotted path of each key of a scene."""
    for key, value in part["properties"].items():
        yield part["title"], (*path, key)
        for name in re.findall(r"#/\$defs/(\w+)", json.dumps(value)):
            yield from keys_of_schema(schema, schema["$defs"][name], (*path, key))


def keys_of_template(text):
    """Yield the dotted path of each key that the template shows, commented out or not."""
    table = ()
    for line in (line.lstrip("# ") for line in text.splitlines()):
        if header := re.match(r"\[\[?([\w.]+)\]", line):
            table = tuple(header[1].split("."))
            yield table
        elif key := re.match(r"(\w+) = (.*)", line):
            yield (*table, key[1])
            if key[2].startswith("{"):
                yield from ((*table, key[1], inner) for inner in re.findall(r"(\w+) = ", key[2]))


def test_the_template_loads_and_shows_every_key():
    text = shipped.template_text()
    assert parse_scene(text).duration == pytest.approx(10.0)

    shown = set(keys_of_template(text))
    schema = Scene.model_json_schema()
    places = list(keys_of_schema(schema, schema))
    assert ("Actuator", ("actuators", "speed", "rate")) in places
    # A part that may stand at several places is shown at one of them at least.
    found = {(part, path[-1]) for part, path in places if path in shown}
    assert {(part, path[-1]) for part, path in places} - found == set()


def test_the_closed_loop_of_the_template_works():
    lines = shipped.template_text().splitlines()
    first, last = lines.index("# [target]"), lines.index("[run]")
    scene = parse_scene("\n".join([*lines[:first], *(line.removeprefix("# ") for line in lines[first:last]), *lines[last:]]))
    assert (scene.controller.kind, scene.sensors[0].kind, scene.actuators.lateral_force.rate) == ("pid", "tip-imaging", 10.0)
    assert (scene.target.depth, scene.controller.gains.proportional) == (0.12, 20.0)


def test_parse_scene_needs_no_file():
    assert scene_file.parse_scene(scene_file.scene_text(hub_scene())) == hub_scene()
