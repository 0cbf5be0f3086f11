"""Every place where the packages tell a user something.

``python -m tests.house.messages COVERAGE_FILE`` lists those that no test has met.

A message is a ``raise`` of an error of the project's own, or a call that warns. A statement in a coverage data file (``coverage
combine`` first) counts as met when any of its lines was executed.
"""

import ast
import sys
from dataclasses import dataclass
from pathlib import Path

from coverage import CoverageData

from tests.house.source import PACKAGES, ROOT, python_files, tree

ERRORS = {"SceneError", "NeedleError", "ComputationError", "UnstableLoopError", "BadParameter", "UsageError", "ValueError"}
CALLS = {"warn", "_refused", "failed_step"}


@dataclass(frozen=True)
class Message:
    """Where a message is told: file, first and last line, source of what is told."""

    path: Path
    first: int
    last: int
    text: str


def called(node):
    """The name of what a call calls, "" of anything else."""
    function = node.func if isinstance(node, ast.Call) else None
    return getattr(function, "attr", getattr(function, "id", ""))


def tells(node):
    """Whether a statement tells something."""
    if isinstance(node, ast.Raise):
        return node.exc is not None and called(node.exc) in ERRORS | CALLS
    return isinstance(node, ast.Expr) and called(node.value) in CALLS


def messages():
    """All messages of both packages."""
    found = []
    for path in python_files(*PACKAGES):
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.stmt) and tells(node):
                found.append(Message(path, node.lineno, node.end_lineno, ast.unparse(node)))
    return found


def executed(data):
    """Lines of every file of a coverage data file, by path from the root of the checkout."""
    found = {}
    for name in data.measured_files():
        path = Path(name)
        place = path.relative_to(ROOT) if path.is_absolute() and path.is_relative_to(ROOT) else path
        found[str(place)] = set(data.lines(name) or ())
    return found


def unmet(data):
    """Messages that no measured run has met."""
    lines = executed(data)
    return [
        message
        for message in messages()
        if not lines.get(str(message.path.relative_to(ROOT)), set()) & set(range(message.first, message.last + 1))
    ]


def main(file):
    """Print what was not met; the exit status is 1 if there is any."""
    data = CoverageData(file)
    data.read()
    missing = unmet(data)
    for message in missing:
        print(f"{message.path.relative_to(ROOT)}:{message.first}: {message.text}")
    print(f"{len(missing)} of {len(messages())} messages are met by no test", file=sys.stderr)
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
