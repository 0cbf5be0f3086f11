"""The example in the help of a command is a command line of the program, and runs."""

import re
import shlex

import pytest
import typer

from fem_needle.cli import build_application
from tests.docs.test_pages import parsed

LONG = {"experiments", "stress"}  # minutes


def examples():
    """The example of each command, without where its output is put."""
    commands = typer.main.get_command(build_application()).commands
    found = ((name, re.search(r"Example: fem-needle ([^\n]+)", command.help or "")) for name, command in sorted(commands.items()))
    return {name: shlex.split(match[1].partition(" >")[0]) for name, match in found if match}


def test_examples_are_command_lines():
    assert set(examples()) == set(typer.main.get_command(build_application()).commands)
    for arguments in examples().values():
        parsed(arguments)


def test_what_is_no_command_line_is_refused():
    with pytest.raises(typer.BadParameter.__base__):
        parsed(["run", "thesis", "--no-such-option"])


@pytest.mark.slow
def test_examples_run(command_line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command_line("run", "thesis", "--no-vtk")[0] == 0
    for name, arguments in examples().items():
        if name not in LONG:
            status, out, err = command_line(*arguments)
            assert (status, bool(out), "Traceback" in err) == (0, True, False), f"{arguments}\n{err}"
