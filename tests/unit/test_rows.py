"""Arrays of compiled functions: what can be done with them, compiled and not, and what happens beyond their ends."""

import os
import subprocess
import sys

import pytest

from tests.house.source import ROOT

# In a process of its own: whether code is compiled and checks its indices is decided when numba is loaded.
PROGRAM = """
import numpy as np
from numba import njit
from fem_needle.dynamics.arrays import TABLE_COLUMNS, floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.linking import EntranceCompiler

LINE, PLANE, SPACE, FOUR, FIVE, WHOLE, WHOLES = range(7)

@inner
def row_sums(rows, out):
    for i in range(rows.shape[0]):
        total = 0.0
        for j in range(rows.shape[1]):
            total += rows[i, j]
        out[i] = total

@inner
def work(table):
    line, plane, space = floats_1(table, LINE), floats_2(table, PLANE), floats_3(table, SPACE)
    four, five, whole, wholes = floats_4(table, FOUR), floats_5(table, FIVE), integers_1(table, WHOLE), integers_2(table, WHOLES)
    row_sums(plane, line)                         # 0 ...
    row_sums(space[1], line[3:])                  # a plane of a space, a part of a line
    row_sums(plane[1:, 2:], line[6:8])            # a part with gaps
    row_sums(four[1, 0, :, 1:], line[8:10])
    row_sums(five[1, 1, 0], line[10:12])
    space[0, 1:, :] = 7.0
    plane[:, :1] = 9.0
    plane[2] = plane[1]
    space[1, :2, :3] = plane[1:, :3]
    line[12] = line[:3][1] + len(plane) + len(plane[0]) + plane.shape[1] + four.shape[3]
    line[13], line[14] = wholes[1, whole[2]], five[1, 1, 1, 1, 1]
    five[1, 0, 1, 0, 1] += 2.5
    whole[whole[0]] = 40 + len(line[3:2 + 1])
    chosen = plane[0] if whole[0] > 0 else line
    chosen[3] = -1.0
    return 0

@inner
def beyond(table, at):
    return floats_2(table, PLANE)[1, at]

@inner
def cut_beyond(table, first, last):
    return len(floats_1(table, LINE)[first:last])

whole = njit(pipeline_class=EntranceCompiler, _nrt=False, no_cfunc_wrapper=True)
run = whole(lambda table: work(table))
ask = whole(lambda table, at: beyond(table, at))
ask_cut = whole(lambda table, first, last: cut_beyond(table, first, last))
shapes = ((15,), (3, 4), (2, 3, 4), (2, 2, 2, 3), (2, 2, 2, 2, 2))
arrays = [0.5 + np.arange(float(np.prod(shape))).reshape(shape) for shape in shapes]
arrays += [np.array([1, 2, 3]), np.arange(8).reshape(2, 4)]
table = np.zeros((7, TABLE_COLUMNS), dtype=np.int64)
for number, array in enumerate(arrays):
    table[number, 0] = array.ctypes.data
    table[number, 1 : 1 + array.ndim] = array.shape
run(table)
print([array.tolist() for array in arrays])
for function, place in ((ask, (3,)), (ask_cut, (3, 99)), (ask, (4,)), (ask, (-1,)), (ask_cut, (16, 17))):
    try:
        print(float(function(table, *place)))
    except IndexError as error:
        print("IndexError")
"""


def outcome(**settings):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, env=environment | settings, cwd=ROOT, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def uncompiled():
    return outcome(NUMBA_DISABLE_JIT="1")


def test_compiled_code_does_what_numpy_does(uncompiled):
    compiled = outcome()
    assert compiled[:3] == uncompiled[:3]
    assert uncompiled[1:4] == ["7.5", "12.0", "IndexError"]


def test_indices_are_checked_on_demand(uncompiled):
    checked = outcome(NUMBA_BOUNDSCHECK="1")
    assert checked == uncompiled[:3] + ["IndexError"] * 3
