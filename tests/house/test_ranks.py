"""Rooms have ranks: a room imports only rooms of lower rank. The table is the map of the house."""

import ast

import pytest

from tests.house.source import PACKAGES, module_name, python_files, tree

RANKS = {
    # what every room may import
    "errors": -1,
    # no other room
    "banded": 0,
    "collocation": 0,
    "progress_bar": 1,
    "display": 0,
    "frames": 0,
    "gauss": 0,
    "shapes": 2,
    "path": 0,
    "piecewise": 0,
    "row_blocks": 0,
    "shipped": 0,
    "atomic_file": 0,
    "folder_lock": 0,
    "hdf5_guard": 0,
    "limits": 0,
    "threads": 0,
    "vtk_file": 0,
    "mesh_file": 0,
    "mesh_reader": 1,
    # physics and reference elements
    "scene": 1,
    "elements": 3,
    # what knows a scene and no model
    "scene_file": 2,
    "segments": 2,
    "time_integrals": 2,
    "exact": 2,
    "manifest": 2,
    "tissue_block": 2,
    "layer_names": 2,
    "plant": 2,
    "checks": 3,
    "sample_arrays": 3,
    "models": 3,
    # parts of a model, and what needs only the protocol
    "axial": 3,
    "foundation": 3,
    "beam_matrices": 4,
    "beam_needle": 6,
    "loads": 3,
    "free_response": 3,
    "run_target": 3,
    "rigid_push": 4,
    "needle": 7,
    "motion": 5,
    "statics": 4,
    "rounding": 5,
    # time: matrices at an instant, ledger, the kernel; no mesh
    "stages": 6,
    "ledger": 7,
    "initial": 8,
    "samples": 9,
    "dynamics": 8.5,
    "skipping": 9,
    "inertia_effect": 11,
    "section_forces": 10,
    "trajectory": 11,
    "run_parts": 11.5,
    "choices": 12,
    "detuning": 13,
    "sensing": 12,
    "expectation": 1,
    "finite_element_model": 13,
    "series_file": 12,
    "run_forces": 12,
    "vtk_export": 12,
    # whole runs
    "run_job": 13,
    "trial_steps": 13.5,
    "refined_run": 14,
    "simulation": 15,
    # studies
    "linear": 15,
    "analysis": 16,
    "convergence": 17,
    "comparison": 17,
    "control": 17,
    "benchmark": 18,
    "stress": 18,
    "run_folder": 14,
    "batch": 16,
    "csv_file": 13,
    "matlab_file": 13,
    "vtkhdf_file": 13,
    "export": 15,
    "view": 15,
    # studies of a scene
    "pictures": 0,
    "study_files": 4,
    "closed_loop": 18,
    "figures": 19,
    "identification": 19,
    "report": 19.5,
    "cli": 20,
    "__main__": 21,
}
# A convenience of the result that reaches upward, when it is called and not before.
LATE = {("trajectory", "run_folder")}
# The rooms that may know a mesh: everything else must work with any plant.
KNOW_A_MESH = {"elements", "needle", "finite_element_model"}
MESH = {"elements", "needle"}


def room(module):
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def imported_modules(path):
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            module = node.module or ""
            yield from (f"{module}.{alias.name}" for alias in node.names) if module in PACKAGES else (module,)


def imports(package):
    """Yield importing module and imported module, of this project, for each import across rooms."""
    for path in python_files(package):
        for name in imported_modules(path):
            here = module_name(path)
            if name.split(".")[0] in PACKAGES and (name.split(".")[0] != package or room(name) != room(here)):
                yield here, name


def test_every_room_has_a_rank_and_every_rank_a_room():
    assert {room(module_name(path)) for path in python_files("fem_needle")} - {""} == set(RANKS)


def test_a_room_imports_only_rooms_of_lower_rank():
    found = {(room(here), room(name)) for here, name in imports("fem_needle")}
    assert ("run_job", "dynamics") in found  # the search finds imports at all
    assert {pair for pair in found - LATE if RANKS[pair[0]] <= RANKS.get(pair[1], -1)} == set()


def test_the_models_know_no_study_and_the_studies_no_mesh():
    found = {(room(here), room(name)) for here, name in imports("fem_needle") if room(name) in MESH}
    assert {here for here, _ in found} <= KNOW_A_MESH


def test_the_reference_does_not_know_the_reduced_model():
    assert [pair for pair in imports("fem_needle") if pair[1].startswith("reduced_model")] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_do_not_import_tests(package):
    names = [name for path in python_files(package) for name in imported_modules(path)]
    assert not [name for name in names if name.split(".")[0] == "tests"]
