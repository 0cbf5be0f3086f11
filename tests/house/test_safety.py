"""Nothing that is read is executed: no eval, no pickle, no shell, and no way to them."""

import ast

import pytest

from tests.house.source import PACKAGES, offending, python_files, tree

CALLS = {"eval", "exec", "compile", "__import__", "system", "popen", "unsafe_load"}
MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib", "yaml", "runpy", "code", "imp"}


def name_of(function):
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def offences(module):
    """Yield what a module does that runs what it reads."""
    for node in ast.walk(module):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            yield from (name for name in names if name.split(".")[0] in MODULES)
        elif isinstance(node, ast.Call):
            holder = getattr(node.func.value, "id", "") if isinstance(node.func, ast.Attribute) else ""
            if name_of(node.func) in CALLS and holder not in {"re", "platform", "dispatcher"}:
                yield name_of(node.func)
            for keyword in node.keywords:
                if keyword.arg in {"shell", "allow_pickle"} and getattr(keyword.value, "value", True) is not False:
                    yield str(keyword.arg)


@pytest.mark.parametrize(
    "text",
    [
        "eval('1')",
        "import pickle",
        "from yaml import load",
        "subprocess.run(a, shell=True)",
        "np.load(a, allow_pickle=b)",
        "os.system(a)",
    ],
)
def test_the_search_finds_what_it_should(text):
    assert list(offences(ast.parse(text)))


@pytest.mark.parametrize(
    "text", ["re.compile('a')", "dispatcher.compile(a)", "np.load(a)", "subprocess.run([a])", "np.load(a, allow_pickle=False)"]
)
def test_the_search_finds_no_more(text):
    assert not list(offences(ast.parse(text)))


def test_nothing_that_is_read_is_executed():
    assert offending(python_files(*PACKAGES), lambda path: list(offences(tree(path)))) == {}
