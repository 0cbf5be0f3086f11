"""Runs on assumed modes: options, what the table says, the warning outside the range."""

from __future__ import annotations

import json
from functools import partial

import pytest

from fem_needle import SceneError, load_scene, run_scene
from fem_needle.cli.run_table import model_text

FAST = ("--time-step", "0.02", "--output-step", "0.2", "--no-vtk")


@pytest.fixture
def run(command_line, monkeypatch, tmp_path):
    """Run `run`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "run")


def missing(warnings):
    return [text for text in warnings if "assumed modes miss" in text]


def test_two_modes_warn_where_they_are_outside_their_range(run):
    status, out, _ = run("bench-m", "--model", "assumed-modes", "--modes", "2", *FAST, "--json")
    summary = json.loads(out)
    (warning,) = missing(summary["warnings"])
    assert status == 0
    assert (summary["model"], summary["modes"]) == ("assumed-modes", 2)
    # The lowest frequency at 20 mm is too high by 0.0046, more than the tip's 0.0027 and than the tolerance.
    assert "lowest natural frequency by 0.0046 (tolerance 0.001)" in warning
    assert "(k/4EI)^(1/4) z = 0.169" in warning


def test_two_modes_do_not_warn_inside_their_range(run):
    status, out, _ = run("bench-m", "--model", "assumed-modes", "--modes", "2", "--tolerance", "0.05", *FAST, "--json")
    assert status == 0
    assert missing(json.loads(out)["warnings"]) == []


def test_the_table_names_model_modes_variant_and_basis(run, monkeypatch):
    monkeypatch.setattr("fem_needle.progress_bar.PATIENCE", 1e3)  # a busy machine shows no bar either
    options = ("--modes", "3", "--variant", "corrected", "--basis", "inserted-length")
    status, out, err = run("thesis", "--model", "assumed-modes", *options, "--no-vtk", "--output-step", "4")
    assert (status, err) == (0, "")
    assert "assumed-modes, 3 modes, variant corrected, basis inserted-length" in out
    assert "?" not in out


def test_static_corrections_are_an_option(run, tmp_path):
    options = ("--modes", "1", "--static-corrections", "--output-step", "4", "--analysis", "static", "--no-vtk")
    status, out, _ = run("thesis", "--model", "assumed-modes", *options)
    assert status == 0
    assert "1 mode, 2 static corrections" in out
    assert "static_corrections = true" in (tmp_path / "runs" / "thesis" / "scene.toml").read_text()


def test_python_takes_the_same_settings():
    run = run_scene(load_scene("thesis"), model="assumed-modes", modes=4, basis="inserted-length", output_step=4.0)
    found = {key: run.summary[key] for key in ("model", "modes", "variant", "basis")}
    assert found == {"model": "assumed-modes", "modes": 4, "variant": "conservative", "basis": "inserted-length"}
    assert run.scene.model.modes == 4


@pytest.mark.parametrize(("options", "said"), [(("--modes", "0"), "model.modes"), (("--variant", "best"), "model.variant")])
def test_impossible_models_are_refused(run, tmp_path, options, said):
    status, out, err = run("thesis", "--model", "assumed-modes", *options)
    assert (status, out) == (2, "")
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_python_refuses_impossible_models_too():
    with pytest.raises(SceneError, match=r"model\.basis"):
        run_scene(load_scene("thesis"), model="assumed-modes", basis="half")


def test_a_model_that_says_little_has_a_name():
    assert model_text({}) == "?"
    assert model_text({"model": "rope"}) == "rope"


@pytest.mark.parametrize("setting", [{"modes": 2}, {"basis": "inserted-length"}, {"static_corrections": True}])
def test_settings_of_modes_without_modes_are_refused(setting):
    (name,) = setting
    with pytest.raises(SceneError, match=f"model.{name}: has no effect on the model 'fem' .*assumed-modes"):
        run_scene(load_scene("thesis"), **setting)


def test_options_of_modes_without_modes_are_refused(run):
    status, _, err = run("thesis", "--modes", "2", *FAST)
    assert (status, "model.modes: has no effect on the model 'fem'" in err) == (2, True)
