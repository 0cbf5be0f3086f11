"""Rows of the table of hit rates, computed anew: the tolerance is kept and the error is below its estimate."""

import csv
import warnings
from pathlib import Path

import pytest

from benchmarks.hit_rate import KNOWN, UNKNOWN, measured, new_seeds, summarized
from tests.consistency.random_kinds import ANNOUNCED, FIRST_SPECIAL, KINDS, kind_of, scene_of_seed

TABLE = Path(__file__).parents[2] / "benchmarks" / "results" / "hit_rate.csv"
DEFAULT = ((2, 1e-3), (207, 1e-4))
DOZEN = (  # of every kind, with truths that are cheap
    (2, 1e-4), (92, 1e-4), (112, 1e-5), (204, 1e-5), (212, 1e-4), (248, 1e-4),
    (217, 1e-4), (381, 1e-4), (385, 1e-3), (378, 1e-4), (227, 1e-4), (239, 1e-4),
)  # fmt: skip


def table():
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {(int(row["seed"]), float(row["tolerance"])): row for row in csv.DictReader(file)}


def checked(seed, tolerance):
    kept = table()[seed, tolerance]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        row = measured(seed, tolerance, 60.0, fixed=False)
    assert {name: str(row[name]) for name in ("kind", "support", "insertion", "initial")} == {
        name: kept[name] for name in ("kind", "support", "insertion", "initial")
    }
    assert float(kept["error"]) <= tolerance
    assert row["error"] <= tolerance
    assert row["error"] <= row["estimate"] + row["uncertainty"]
    assert row["uncertainty"] <= KNOWN * tolerance


@pytest.mark.parametrize(("seed", "tolerance"), DEFAULT)
def test_the_tolerance_is_kept(seed, tolerance):
    checked(seed, tolerance)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "tolerance"), DOZEN)
def test_the_tolerance_is_kept_in_scenes_of_every_kind(seed, tolerance):
    checked(seed, tolerance)


def test_every_kind_is_announced():
    announced = [kind_of(seed) for seed in range(ANNOUNCED)]
    assert {kind: announced.count(kind) for kind in KINDS} == dict.fromkeys(KINDS, 75) | {"plain": FIRST_SPECIAL}
    fresh = [kind_of(seed) for seed in new_seeds("1.2.3")]
    assert {kind: fresh.count(kind) for kind in KINDS} == dict.fromkeys(KINDS, 20)
    assert new_seeds("1.2.3") != new_seeds("1.2.4")
    assert min(new_seeds("1.2.3")) >= ANNOUNCED


def test_scenes_are_what_their_kind_says():
    for seed in range(FIRST_SPECIAL, FIRST_SPECIAL + 40):
        scene, kind = scene_of_seed(seed), kind_of(seed)
        bevels = [load for load in scene.loads if load.kind == "tip" and load.bevel_coefficient is not None]
        assert (scene.insertion.kind == "force") == (kind == "push")
        assert (scene.tissue.rest_line == "cut-path") == (kind == "cut-path")
        assert bool(bevels) == (kind == "bevel") or kind == "cut-path"
        assert scene.support.guides or kind != "guides"


def test_refused_scenes_are_misses_and_unknown_truths_are_counted_apart():
    fields = {"tolerance": 1e-3, "kind": "plain", "cost": "", "fixed_cost": "", "note": ""}
    hit = fields | {"error": 5e-4, "estimate": 8e-4, "uncertainty": 0.0}
    miss = fields | {"error": 2e-3, "estimate": 1e-3, "uncertainty": 0.0}
    refused = fields | {"error": "", "estimate": "", "uncertainty": "", "note": "SceneError"}
    unknown = refused | {"note": UNKNOWN}
    assert "| 0.001 | all | 4 | 1 | 2 | 1 | 1 |" in summarized([hit, miss, refused, unknown])
