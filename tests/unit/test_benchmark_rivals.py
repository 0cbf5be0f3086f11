"""The scripts of the rivals: each takes part where its library is installed, and is skipped with the reason elsewhere."""

from __future__ import annotations

from importlib.util import find_spec

from fem_needle.benchmark.cases import CASES
from fem_needle.benchmark.rivals import load_rivals
from tests.house.source import ROOT

RIVALS = {
    "opensees_rival": "openseespy",
    "exudyn_rival": "exudyn",
    "elastica_rival": "elastica",
    "mujoco_rival": "mujoco",
    "pynite_rival": "Pynite",
}


def test_every_rival_that_is_not_installed_is_skipped():
    found = load_rivals(ROOT / "benchmarks" / "rivals")
    skipped = {name for name, _ in found.skipped}
    missing = {script for script, module in RIVALS.items() if find_spec(module) is None}
    assert missing <= skipped <= set(RIVALS)
    assert len(found.packages) == len(RIVALS) - len(skipped)
    assert all(any(method.settings(case) for case in CASES) for method in found.methods)


def test_the_scripts_are_those_that_are_known():
    assert {path.stem for path in (ROOT / "benchmarks" / "rivals").glob("*.py")} == set(RIVALS)
