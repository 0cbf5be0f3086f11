"""When entrances are compiled, what is kept of them and for how long: on a small one beside copies of the modules that do it."""

import os
import subprocess
import sys
from shutil import copy

import pytest

from tests.house.source import ROOT

MODULES = ("__init__", "compilation", "haste", "linking", "notice", "rows")
CALLEE = """
from fem_needle.dynamics.compilation import inner

@inner
def raised(value):
    return value + 1

@inner
def doubled(value):
    return raised(value) + raised(value)
"""
TINY = """
from fem_needle.dynamics.callee import doubled, raised
from fem_needle.dynamics.compilation import entrance

@entrance("tiny loop", 3)
def run_tiny(table):
    total = max(0, raised(table[0, 0]))
    for row in range(table.shape[0]):
        total += doubled(table[row, 1])
    return total
"""
CALL = """
import sys
import numpy as np
from fem_needle.dynamics.tiny import run_tiny
print(run_tiny(np.full((3, 6), 4, dtype=np.int64)), "compiled" if run_tiny.compiled else "kept")
"""
RESULT = 5 + 3 * 10


class Copy:
    """A folder with a package of a small entrance, and a home of its own."""

    def __init__(self, path):
        self.path, self.room = path, path / "fem_needle" / "dynamics"
        self.room.mkdir(parents=True)
        (path / "fem_needle" / "__init__.py").touch()
        for module in MODULES:
            copy(ROOT / "fem_needle" / "dynamics" / f"{module}.py", self.room)
        (self.room / "callee.py").write_text(CALLEE)
        (self.room / "tiny.py").write_text(TINY)

    def run(self, code=CALL, **settings):
        """What it prints, line by line, and what is said meanwhile."""
        usual = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "XDG_"))}
        mine = {"PYTHONPATH": str(self.path), "HOME": str(self.path), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-c", code]
        done = subprocess.run(
            command, env=usual | mine | settings, cwd=self.path, capture_output=True, text=True, timeout=100, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines(), done.stderr

    @property
    def kept(self):
        return sorted(path.name for path in self.path.rglob("*.nb?"))

    def nothing_can_be_kept(self):
        """Files where folders would have to be: root, too, can write none there."""
        (self.room / "__pycache__").touch()
        (self.path / ".cache").touch()


@pytest.fixture
def small(tmp_path):
    return Copy(tmp_path / "copy")


def test_an_entrance_is_compiled_once_and_says_so(small):
    first, said = small.run()
    assert first == [f"{RESULT} compiled"]
    assert said == "compiling the tiny loop, once on this machine (some 0 s)\n"
    assert len(small.kept) == 2
    assert small.run() == ([f"{RESULT} kept"], "")


def test_another_callee_is_another_kernel(small):
    small.run()
    before = small.kept
    (small.room / "callee.py").write_text(CALLEE.replace("value + 1", "value + 2"))
    again, said = small.run()
    assert again == [f"{6 + 3 * 12} compiled"] and "compiling" in said
    assert len(small.kept) == 2 and not set(small.kept) & set(before)  # nothing is left of what is gone
    assert small.run() == ([f"{6 + 3 * 12} kept"], "")


def test_code_that_checks_its_indices_is_kept_on_its_own(small):
    small.run()
    checked, said = small.run(NUMBA_BOUNDSCHECK="1")
    assert checked == [f"{RESULT} compiled"] and "compiling" in said
    assert len(small.kept) == 4
    assert small.run() == ([f"{RESULT} kept"], "")


@pytest.mark.parametrize("named", [False, True])
def test_without_a_folder_the_run_goes_on(small, named):
    small.nothing_can_be_kept()
    settings = {"NUMBA_CACHE_DIR": str(small.path / ".cache" / "numba")} if named else {}
    for _ in range(2):
        done, said = small.run(CALL + CALL.splitlines()[-1], **settings)
        assert done == [f"{RESULT} compiled"] * 2
        assert said.count("\n") == 1 and "in every process anew" in said and "NUMBA_CACHE_DIR" in said


def test_a_folder_that_cannot_be_read_when_it_is_needed_is_no_error(small):
    spoil = "import fem_needle.dynamics.tiny as t, shutil; shutil.rmtree(t.run_tiny.folder); t.run_tiny.folder.touch()"
    done, said = small.run(f"{spoil}\n{CALL}")
    assert done == [f"{RESULT} compiled"]
    assert "what was kept of the tiny loop in" in said and said.count("\n") == 2
    assert small.run() == ([f"{RESULT} kept"], "")  # in the user's folder


def test_a_folder_that_cannot_be_written_when_it_is_needed_is_no_error(small):
    spoil = "import numba.core.caching as c\ndef full(*given): raise OSError('disk full')\nc.IndexDataCacheFile.save = full"
    done, said = small.run(f"{spoil}\n{CALL}")
    assert done == [f"{RESULT} compiled"]
    assert said.splitlines()[1].startswith("the tiny loop cannot be kept in") and said.endswith("disk full\n")


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_what_is_kept_and_spoiled_is_made_anew(small, kind):
    small.run()
    for path in small.path.rglob(f"*.{kind}"):
        path.write_bytes(b"spoiled")
    done, said = small.run()
    assert done == [f"{RESULT} compiled"] and "cannot be read" in said and "compiling" in said
    assert small.run() == ([f"{RESULT} kept"], "")


def test_a_named_folder_is_used(small):
    small.run(NUMBA_CACHE_DIR=str(small.path / "named"))
    assert len(list((small.path / "named").rglob("*.nb?"))) == 2 == len(small.kept)


def test_threads_that_call_at_once_compile_once(small):
    code = """
from threading import Barrier, Thread
import numpy as np
from fem_needle.dynamics.tiny import run_tiny
at_once, found = Barrier(4), []
def call():
    at_once.wait()
    found.append(run_tiny(np.full((3, 6), 4, dtype=np.int64)))
threads = [Thread(target=call) for _ in range(4)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(found)
"""
    done, said = small.run(code)
    assert done == [str([RESULT] * 4)] and said.count("compiling") == 1


def test_settings_of_the_caller_come_back(small):
    code = """
import gc
from numba.core import config, types
from fem_needle.dynamics.tiny import run_tiny
gc.disable()
before = config.OPT, config.LOOP_VECTORIZE, config.SLP_VECTORIZE, gc.isenabled(), types.Function.get_call_type
run_tiny.prepare()
print(before == (config.OPT, config.LOOP_VECTORIZE, config.SLP_VECTORIZE, gc.isenabled(), types.Function.get_call_type))
print(vars(types.Function).get("get_call_type"))
"""
    assert small.run(code)[0] == ["True", "None"]


def test_an_interrupt_leaves_something_that_can_be_compiled(small):
    code = """
from fem_needle.dynamics import notice
from fem_needle.dynamics.tiny import run_tiny
def interrupted(what, share):
    if share > 0.3:
        raise KeyboardInterrupt
try:
    with notice.watched(interrupted):
        run_tiny.prepare()
except KeyboardInterrupt:
    print("interrupted")
"""
    done, _ = small.run(code + CALL)
    assert done[0] == "interrupted" and done[1].startswith(f"{RESULT} ")


def test_who_watches_sees_it_grow(small):
    code = """
from fem_needle.dynamics import notice
from fem_needle.dynamics.tiny import run_tiny
with notice.watched(lambda what, share: print(what, round(share, 2))):
    run_tiny.prepare()
"""
    done, _ = small.run(code)
    assert done[0] == "tiny loop 0.0" and done[-1] == "tiny loop 1.0"
    shares = [float(line.split()[-1]) for line in done]
    assert shares == sorted(shares) and len(set(shares)) >= 4


def test_uncompiled_nothing_is_compiled(small):
    assert small.run(NUMBA_DISABLE_JIT="1") == ([f"{RESULT} kept"], "")
    assert small.kept == []


def test_other_compiled_code_may_call_what_is_compiled_into_callers(small):
    code = """
from numba import njit
from fem_needle.dynamics.callee import doubled
print(njit(lambda value: doubled(value) + doubled(2 * value))(4))
"""
    assert small.run(code) == (["28"], "")


def test_a_table_of_another_kind_is_refused(small):
    code = """
import numpy as np
from fem_needle.dynamics.tiny import run_tiny
try:
    run_tiny(np.zeros((3, 6)))
except TypeError as error:
    print(str(error).splitlines()[0])
"""
    assert small.run(code)[0] == ["No matching definition for argument type(s) array(float64, 2d, C)"]
