"""What a fit needs of measured data, and what it says of columns that it does not use."""

import json
import re

import numpy as np
import pytest

from fem_needle import Measurements, SceneError, identify
from fem_needle.identification.static_model import Place, static_problem
from fem_needle.report.identify_study import identify_parts
from fem_needle.scene_file import parse_scene

MODULUS = "tissue.layers.0.foundation_modulus"
SCENE = parse_scene(
    """
    needle = { length = "150 mm", bending_stiffness = 0.0055, mass_per_length = 0.003 }
    support = { kind = "hub", hub_deflection = 0.0 }
    tissue.layers = [{ name = "gel", start = 0.0, foundation_modulus = "3 kN/m^2" }]
    insertion = { kind = "speed", initial_depth = "20 mm", speed = "5 mm/s", final_depth = "100 mm" }
    loads = [{ kind = "tip", force = 0.05 }, { kind = "lateral", position = "-10 mm", force = 0.05 }]
    numerics = { analysis = "static", elements = 4 }
    """
)
RISING = {"time": [0.0, 16.0], "value": [1e-3, 2e-3]}
VARYING = {
    "loads.0.force": {"time": [0.0, 10.0, 20.0], "value": [0.05, 0.1, 0.4]},
    "loads.1.force": {"mean": 0.0, "amplitude": 0.1, "frequency": 0.1},
    "loads.0.direction": {"time": [0.0, 16.0], "value": [-1.0, 1.0]},
    "support.hub_deflection": RISING,
    "support.hub_angle": RISING,
    "tissue.stiffness_factor": {"time": [0.0, 16.0], "value": [1.0, 1.2]},
}
DEPTHS = np.linspace(0.02, 0.1, 9)
TIMES = (DEPTHS - 0.02) / 0.005


def measured(scene=SCENE, **others):
    places = [Place(depth, time, np.array([0.15])) for depth, time in zip(DEPTHS.tolist(), TIMES.tolist(), strict=True)]
    problem = static_problem(scene, places, [MODULUS])
    return Measurements({"depth": DEPTHS, "tip_deflection": problem.answers(problem.start)[0], **others}, "tips.csv")


@pytest.mark.parametrize("path", VARYING)
def test_equilibria_need_their_times_where_something_varies(path):
    scene = SCENE.with_value(path, VARYING[path])
    with pytest.raises(SceneError, match=rf"tips\.csv: needs a column 'time \[s\]'.*{path} varies in time"):
        identify(scene, [MODULUS], measured(scene))
    start = scene.with_value(MODULUS, 5e3)
    found = identify(start, [MODULUS], measured(scene, time=TIMES))
    assert found[MODULUS].value == pytest.approx(3e3, rel=1e-6)
    assert found.notes == ()


def test_nothing_varies_or_only_the_insertion():
    constant = {"time": [0.0, 16.0], "value": [0.05, 0.05]}
    for scene in (SCENE, SCENE.with_value("loads.0.force", constant), SCENE.with_value("insertion.speed", RISING)):
        assert identify(scene, [MODULUS], measured(scene))[MODULUS].value == pytest.approx(3e3, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("push_forces", "push_force"),
        ("Push force", "push_force"),
        ("tip-deflection", "tip_deflection"),
        ("tip_deflction", "tip_deflection"),
        ("Time", "time"),
        ("depths", "depth"),
        ("Deflection_at_50", "deflection_at_50"),
        ("deflection_50", "deflection_at_<mm>"),
    ],
)
def test_misspelled_columns_are_refused(name, meant):
    with pytest.raises(SceneError, match=rf"tips\.csv: column '{name}' is not known, did you mean '{meant}'"):
        identify(SCENE, [MODULUS], measured(**{name: DEPTHS}))


def test_columns_that_nobody_uses_are_named():
    found = identify(SCENE, [MODULUS], measured(temperature=DEPTHS, tip_angle=DEPTHS))
    assert found.notes == ("tips.csv: not used: temperature, tip_angle (used: depth, tip_deflection)",)


@pytest.mark.parametrize(("shift", "told"), [(0.0, "then$"), (0.01, "then; it differs from .* by up to 10 mm$")])
def test_a_run_does_not_use_depths_and_says_so(shift, told):
    scene = SCENE.with_values({"numerics.analysis": "quasi-static", "numerics.output_step": 1.0, "tissue.layers.0.damping": 1.0})
    data = measured(time=TIMES)
    found = identify(scene, [MODULUS], Measurements({**data.columns, "depth": DEPTHS + shift}, "tips.csv"))
    assert len(found.notes) == 1
    assert re.search(told, found.notes[0])


def test_deviations_of_no_column_and_shares_of_no_row():
    with pytest.raises(SceneError, match=r"deviations: push_force: no column that is fitted .allowed tip_deflection"):
        identify(SCENE, [MODULUS], measured(), deviations={"tip_deflection": 1e-5, "push_force": 0.1})
    with pytest.raises(SceneError, match=r"held_back: holds back no row of tips\.csv .got 0\.01 of 9"):
        identify(SCENE, [MODULUS], measured(), held_back=0.01)


def test_the_command_shows_notes_and_keeps_them(command_line, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tips.csv").write_text("depth [mm];tip_deflection [mm];note [1]\n20;0,373;1\n40;0,434;2\n60;0,368;3\n")
    arguments = ("identify", "brachytherapy", "tips.csv", "--analysis", "static", "--set", "loads.0.force=0.5", "--fit", MODULUS)
    status, out, _ = command_line(*arguments, "--out", "here")
    assert (status, "note: tips.csv: not used: note (used: depth, tip_deflection)" in out) == (0, True)
    data = json.loads((tmp_path / "here" / "identify.json").read_text())
    assert data["notes"] == ["tips.csv: not used: note (used: depth, tip_deflection)"]
    told = identify_parts(data, {"data": ["tips.csv"], "depth [m]": ["0.02"], "time [s]": [""], "column": []}, SCENE).paragraphs
    assert ("Data", f"{data['notes'][0]}.") in told
    for option, value in (("--sigma", "tip_deflection=1um"), ("--bounds", f"{MODULUS}=1:1e6")):
        status, _, err = command_line(*arguments, option, value, option, value)
        assert (status, "more than once" in err) == (2, True)
