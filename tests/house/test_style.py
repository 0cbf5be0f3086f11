"""Sizes, docstrings, places of imports, and nothing of the machine that wrote it."""

import ast
import re

from tests.house.source import PACKAGES, ROOT, Function, functions, module_name, offending, python_files, texts, tree

LONGEST_FUNCTION = 40
LONGEST_FILE = 400
SOURCE = python_files(*PACKAGES)
# Where an import inside a function is right: commands load what they use, a result reaches its folder late.
LATE_IMPORTS = {
    ("fem_needle.progress_bar", "_show"),  # rich, where something takes long
    ("fem_needle.trajectory", "save"),
    ("fem_needle.trajectory", "load"),
    ("fem_needle.view.picture", "_rendered"),  # VTK, in the process that draws
}
LATE_PACKAGES = ("fem_needle.cli", "reduced_model.commands")


def code_lines(function):
    """Lines of a function without its docstring and decorators."""
    first = function.body[0]
    text = first if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) else None
    quoted = 0 if text is None or not isinstance(text.value.value, str) else text.end_lineno - text.lineno + 1
    return function.end_lineno - function.lineno + 1 - quoted


def test_code_lines_counts_what_it_should():
    function = ast.parse('def f():\n    """A.\n\n    B.\n    """\n    a = 1\n    return a\n').body[0]
    assert code_lines(function) == 3


def test_functions_are_short():
    def long(path):
        return {f.name: code_lines(f) for f in functions(path) if code_lines(f) > LONGEST_FUNCTION}

    assert offending(SOURCE + python_files("docs", "benchmarks"), long) == {}


def test_files_are_short():
    def lines(path):
        return len(path.read_text(encoding="utf-8").splitlines())

    checked = SOURCE + python_files("tests", "docs", "benchmarks")
    assert {path: lines(path) for path in checked if lines(path) > LONGEST_FILE} == {}


def public_things(path):
    """Yield every public module, class and function or method."""
    module = tree(path)
    yield module
    holders = [module, *(node for node in module.body if isinstance(node, ast.ClassDef) and not node.name.startswith("_"))]
    for holder in holders:
        for node in holder.body:
            if isinstance(node, ast.ClassDef | Function) and not node.name.startswith("_"):
                yield node


def test_public_things_have_docstrings():
    def bare(path):
        return [getattr(node, "name", "module") for node in public_things(path) if not ast.get_docstring(node)]

    assert offending(SOURCE, bare) == {}


def late_imports(path):
    """Yield (module, function) of each import inside a function."""
    for function in functions(path):
        if any(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.walk(function)):
            yield module_name(path), function.name


def test_imports_are_at_the_top():
    checked = [path for path in SOURCE if not module_name(path).startswith(LATE_PACKAGES)]
    assert {late for path in checked for late in late_imports(path)} == LATE_IMPORTS


def test_input_is_not_checked_by_assert():
    def asserts(path):
        return [node.lineno for node in ast.walk(tree(path)) if isinstance(node, ast.Assert)]

    assert offending(SOURCE, asserts) == {}


# Roots of machines, put together here so that this file does not name them.
MACHINE = re.compile(r"(?<![\w.])/(?:" + "|".join(("wor" + "k", "tm" + "p", "roo" + "t", "hom" + "e")) + r")\b")


def test_the_pattern_finds_a_machine_path():
    assert MACHINE.search("see /" + "tmp/x") and not MACHINE.search("frame/" + "work and load/" + "root")


def test_nothing_names_a_path_of_a_machine():
    found = {}
    for path in texts():
        hits = MACHINE.findall(path.read_text(encoding="utf-8", errors="replace"))
        if hits:
            found[str(path.relative_to(ROOT))] = hits
    assert found == {}
