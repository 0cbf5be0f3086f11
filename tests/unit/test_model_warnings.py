"""What is set for another model is told; a run takes no study's folder; a study refuses what it cannot vary."""

import pytest

from fem_needle import SceneError, analyze, converge, load_scene, suspicious
from fem_needle.atomic_file import json_bytes
from fem_needle.manifest import manifest
from fem_needle.run_target import RunTarget


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("model.modes", 3, "model.modes = 3 has no effect"),
        ("model.static_corrections", True, "model.static_corrections = True has no effect"),
        ("model.variant", "as-printed", "only makes it fixed-frame"),
    ],
)
def test_settings_of_modes_on_finite_elements(path, value, said):
    scene = load_scene("bench-s").with_value(path, value)
    assert said in suspicious(scene)[0]
    assert suspicious(load_scene("bench-s")) == ()


def test_elements_on_assumed_modes():
    scene = load_scene("bench-s").with_values({"model.kind": "assumed-modes", "numerics.elements": 8})
    assert "has no effect" in suspicious(scene)[0]


def test_an_analysis_of_few_modes_warns_outside_their_range():
    scene = load_scene("brachytherapy").with_values({"model.kind": "assumed-modes", "model.modes": 2})
    assert "assumed modes miss" in analyze(scene, [0.05], time=5.0).warnings[0]


def test_modes_of_finite_elements_are_refused_at_once():
    with pytest.raises(SceneError, match="'assumed-modes' does"):
        converge(load_scene("bench-m"), "modes", (1, 2))


def test_a_run_does_not_replace_a_study(tmp_path):
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "converge.json").write_text("{}")
    (folder / "manifest.json").write_bytes(json_bytes(manifest(load_scene("bench-s"))))
    with pytest.raises(SceneError, match="holds a study, not a run"):
        RunTarget(folder, force=True).check()
    RunTarget(folder, force=True, for_study=True).check()
