"""The documents are true: their links lead somewhere, the contract names everything; that their code runs: tests/docs."""

import re
from itertools import chain

import pytest
import typer

import fem_needle
import reduced_model
from fem_needle.cli import build_application
from fem_needle.scene import Scene
from fem_needle.series_file import COORDINATES, FIELDS
from fem_needle.shipped import shipped_names
from fem_needle.trajectory import VARIABLES
from tests.house.source import ROOT, offending, texts

README = (ROOT / "README.md").read_text(encoding="utf-8")
CONTRACT = (ROOT / "docs" / "contract.md").read_text(encoding="utf-8")
SETUP = "python3 -m venv .venv && .venv/bin/pip install -q -e "
RUN_COMMAND = SETUP + ". && .venv/bin/fem-needle run thesis"
TEST_COMMAND = SETUP + "'.[dev]' && .venv/bin/pytest"
MARKDOWN = [path for path in texts() if path.suffix == ".md"]


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def test_the_readme_has_the_two_commands():
    lines = list(chain.from_iterable(block.splitlines() for block in blocks(README, "sh")))
    assert RUN_COMMAND in lines
    assert TEST_COMMAND in lines


def test_the_build_script_begins_with_the_test_command():
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    commands = [line for line in lines if line and not line.startswith(("#", "set ", "cd "))]
    assert commands[0] == TEST_COMMAND


def test_the_examples_of_the_readme_are_short():
    """That they run: tests/docs."""
    assert {len(example.splitlines()) <= 15 for example in blocks(README, "python")} == {True}


def test_the_readme_lists_every_shipped_scene():
    assert {name for name in shipped_names() if f"`{name}`" not in README} == set()


def test_links_lead_somewhere():
    def dead(path):
        targets = re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8"))
        local = [target.partition("#")[0] for target in targets if "://" not in target]
        return [target for target in local if target and not (path.parent / target).exists()]

    assert offending(MARKDOWN, dead) == {}


def test_files_that_documents_name_exist():
    def missing(path):
        names = re.findall(r"`((?:tests|docs|fem_needle|benchmarks)/[\w./-]+)`", path.read_text(encoding="utf-8"))
        return [name for name in names if not (ROOT / name).exists()]

    assert offending(MARKDOWN, missing) == {}


def scene_keys():
    schema = Scene.model_json_schema()
    return set(chain.from_iterable(part.get("properties", {}) for part in (schema, *schema["$defs"].values())))


def commands():
    return typer.main.get_command(build_application()).commands


def missing(names):
    return {name for name in names if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", CONTRACT)}


def test_the_contract_names_every_key_of_a_scene():
    assert "foundation_modulus" in scene_keys()
    assert missing(scene_keys()) == set()


def test_the_contract_names_every_variable_of_the_series():
    assert missing({*VARIABLES, *COORDINATES, *FIELDS}) == set()


def test_the_contract_names_every_command_and_option():
    options = {name for command in commands().values() for item in command.params for name in item.opts if name.startswith("--")}
    assert "--tolerance" in options
    assert missing({*commands(), *options}) == set()


def test_the_contract_names_everything_public():
    assert "run_scene" in dir(fem_needle)
    assert (fem_needle.__all__, reduced_model.__all__) == (dir(fem_needle), dir(reduced_model))
    assert missing(dir(fem_needle)) == set()


@pytest.mark.parametrize("name", sorted(commands()))
def test_the_help_of_a_command_shows_an_example(name):
    examples = re.findall(r"Example: fem-needle ([\w-]+)", commands()[name].help or "")
    assert examples == [name]
