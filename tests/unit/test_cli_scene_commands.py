"""The commands scenes, new, check, schema: in-process, and once as a process."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import metadata

import pytest

from fem_needle import cli, shipped
from fem_needle.errors import ComputationError, SceneError

BAD = """
needle = { lenght = "127 mm/s", bending_stiffness = 0.02, mass_per_length = 0.01 }
support = { kind = "hub" }
"""


@pytest.fixture
def run(command_line):
    """Run the command; return status, stdout, stderr."""
    return command_line


def test_scenes_lists_every_shipped_scene(run):
    status, out, err = run("scenes")
    assert (status, err) == (0, "")
    for scene in shipped.shipped_scenes():
        assert any(scene.name in line and scene.title in line for line in out.splitlines())


def test_new_writes_a_scene_that_passes_the_check(run, tmp_path):
    path = tmp_path / "mine.toml"
    assert run("new", str(path))[0] == 0
    assert run("check", str(path), "--strict")[0] == 0


def test_new_overwrites_only_with_force(run, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("precious")
    status, out, err = run("new", str(path))
    assert (status, out) == (2, "")
    assert "--force" in err
    assert path.read_text() == "precious"
    assert run("new", str(path), "--force")[0] == 0
    assert path.read_text() == shipped.template_text()


def test_new_into_a_folder_that_is_not_there(run, tmp_path):
    """It is made, as every folder that a command writes into; a file in its place is told."""
    assert run("new", str(tmp_path / "none" / "mine.toml"))[0] == 0
    assert (tmp_path / "none" / "mine.toml").is_file()
    status, _, err = run("new", str(tmp_path / "none" / "mine.toml" / "other.toml"))
    assert (status, "cannot be written" in err, "Traceback" in err) == (2, True, False)


def test_check_shows_si_and_millimeters(run):
    status, out, err = run("check", "brachytherapy")
    assert (status, err) == (0, "")
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in out.splitlines() if line.strip()}
    assert rows["needle.length"] == "0.2 m 200 mm"
    assert rows["needle.bending_stiffness"] == "0.0157222 N m^2 15722.2 N mm^2"
    assert rows["tissue.layers.1.foundation_modulus"] == "20000 N/m^2 20 kN/m^2"
    assert rows["loads.0.force"] == "0 to 0.5 N (table of 4 points) 0 to 0.5 N (table of 4 points)"
    assert rows["support.guides.0.stiffness"] == "rigid rigid"
    assert rows["run.duration"] == "9.5 s (until the insertion ends) 9.5 s"
    assert "not the Young's modulus" in out
    table = [line for line in out.splitlines() if line.startswith("  ") and "." in line.strip().partition(" ")[0]]
    assert all(len(re.split(r"\s{2,}", line.strip())) == 3 for line in table)


def test_check_shows_a_closed_loop_in_the_units_of_its_input_and_output(run, tmp_path):
    path = tmp_path / "loop.toml"
    lines = shipped.template_text().splitlines()
    first, last = lines.index("# [target]"), lines.index("[run]")
    path.write_text("\n".join([*lines[:first], *(line.removeprefix("# ") for line in lines[first:last]), *lines[last:]]))
    status, out, err = run("check", str(path))
    assert (status, err) == (0, "")
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in out.splitlines() if line.strip()}
    assert rows["target.depth"] == "0.12 m 120 mm"
    assert rows["sensors.0.noise"] == "0.0001 m 0.1 mm"
    assert rows["controller.gains.proportional"] == "20 N/m 0.02 N/mm"
    assert rows["controller.gains.integral"] == "20 N/m s 0.02 N/mm s"
    assert rows["actuators.lateral_force.rate"] == "10 N/s 10 N/s"
    assert {"sensors.0.resolution", "sensors.0.stations", "scatter.modulus"} & set(rows) == set()


def test_check_shows_nothing_of_a_loop_that_a_scene_has_not(run):
    out = run("check", "brachytherapy")[1]
    assert "friction.coulomb" in out
    assert [word for word in ("target", "controller", "actuators", "scatter") if f"{word}." in out] == []


@pytest.mark.parametrize(("options", "status"), [((), 0), (("--strict",), 2)])
def test_check_warns_and_is_strict_if_asked(run, tmp_path, options, status):
    path = tmp_path / "mine.toml"
    path.write_text(shipped.template_text().replace('"5 kN/m^2"', '"5 MPa"'))
    found, _, err = run("check", str(path), *options)
    assert found == status
    assert "warning: tissue.layers.0.foundation_modulus = 5e+06 N/m^2 > 1e6 N/m^2" in err


def test_check_refuses_what_the_model_cannot_have(run, tmp_path):
    path = tmp_path / "mine.toml"
    text = shipped.template_text()
    path.write_text(text.replace('kind = "fem"', 'kind = "beads"'))
    status, _, err = run("check", str(path))
    assert status == 2
    assert "model.kind: unknown model (got 'beads'; allowed assumed-modes, fem)" in err
    path.write_text(text.replace('kind = "fem"\nkinematics = "material"', 'kind = "assumed-modes"\nvariant = "as-printed"'))
    status, _, err = run("check", str(path))
    assert status == 2


def test_check_takes_markup_in_a_title_as_text(run, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(shipped.template_text().replace('name = "tissue"', 'name = "[/bold] [red]x"'))
    status, out, _ = run("check", str(path))
    assert status == 0
    assert "[/bold] [red]x" in out


def test_wrong_input_is_one_line_each_on_stderr(run, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(BAD)
    status, out, err = run("check", str(path))
    assert (status, out) == (2, "")
    assert err.splitlines() == [
        "error: needle.length: is required",
        "error: needle.lenght: unknown key; did you mean 'length'?",
        "error: tissue: is required",
        "error: insertion: is required",
    ]


@pytest.mark.parametrize("arguments", [("check", "no-such-scene"), ("check",), ("chek", "thesis"), ("check", "thesis", "--x")])
def test_wrong_arguments(run, arguments):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert err
    assert "Traceback" not in err


def test_schema_describes_the_scene(run):
    status, out, _ = run("schema")
    schema = json.loads(out)
    assert status == 0
    assert set(schema["required"]) == {"needle", "support", "tissue", "insertion"}
    assert schema["additionalProperties"] is False
    length = schema["$defs"]["Needle"]["properties"]["length"]["anyOf"][0]
    assert (length["minimum"], length["maximum"]) == (1e-4, 1e2)
    assert {"enum": ["auto"]} in schema["$defs"]["Numerics"]["properties"]["elements"]["anyOf"]


def test_version(run):
    assert run("--version") == (0, f"fem-needle {metadata.version('fem-needle')}\n", "")


@pytest.mark.parametrize("command", ["scenes", "new", "check", "schema"])
def test_every_help_shows_an_example(run, command):
    status, out, _ = run(command, "--help")
    assert status == 0
    assert f"Example: fem-needle {command}" in out


@pytest.mark.parametrize(
    ("error", "status"), [(SceneError(["a: wrong", "b: wrong"]), 2), (ComputationError("stuck at 3 s: take shorter steps"), 1)]
)
def test_a_command_of_another_package_is_found_and_its_errors_are_shown(run, monkeypatch, error, status):
    def register(application):
        @application.command("fail")
        def fail():
            raise error

    class Point:
        def load(self):
            return register

    monkeypatch.setattr(cli.metadata, "entry_points", lambda group: [Point()] if group == "fem_needle.commands" else [])
    found, out, err = run("fail")
    assert (found, out) == (status, "")
    assert err.splitlines() == [f"error: {line}" for line in str(error).splitlines()]


def test_the_module_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "fem_needle", "check", "no-such-scene"], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: scene: ")
