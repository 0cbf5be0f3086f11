"""Arrays by name: compiled functions take one table of addresses and shapes, and look up in it what they need.

A compiled function that takes a dozen arrays spends more time, to compile and to call, on handing them on than on using them. The
arrays themselves belong to Python (`fem_needle.dynamics.model`), which keeps them alive as long as the table.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import config
from numba.extending import intrinsic
from numpy.typing import NDArray

from fem_needle.dynamics.rows import TABLE, Rows, rows_value

TABLE_COLUMNS = 6  # address and up to five sizes


def _lookup(kind: Any, c_type: Any, dimensions: int) -> Any:
    """Return the function (table, name) -> array of some number type and number of axes."""
    rows_type = Rows(kind, dimensions)

    def typed(context: Any, table: Any, name: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            word = ir.IntType(64)
            first = context.cast(builder, arguments[0], signature.args[0], TABLE)
            row = builder.gep(first, [builder.mul(arguments[1], ir.Constant(word, TABLE_COLUMNS))], inbounds=True)
            columns = (builder.gep(row, [ir.Constant(word, column)], inbounds=True) for column in range(dimensions + 1))
            address, *sizes = (builder.load(column) for column in columns)
            steps = sizes[-1:]
            for size in reversed(sizes[1:-1]):
                steps.insert(0, builder.mul(size, steps[0]))
            data = builder.inttoptr(address, context.get_value_type(kind).as_pointer())
            return rows_value(context, builder, rows_type, data, sizes, steps)

        return rows_type(table, types.int64), generate

    def looked_up(table: NDArray[np.int64], name: int) -> NDArray[Any]:
        """Return the array, in Python."""
        shape = tuple(int(size) for size in table[name, 1 : dimensions + 1])
        total = int(np.prod(shape))
        if total == 0:
            return np.zeros(shape, c_type)
        return np.frombuffer((c_type * total).from_address(int(table[name, 0])), dtype=c_type).reshape(shape)

    return looked_up if config.DISABLE_JIT else intrinsic(typed)  # type: ignore[attr-defined]


floats_1 = _lookup(types.float64, ctypes.c_double, 1)
floats_2 = _lookup(types.float64, ctypes.c_double, 2)
floats_3 = _lookup(types.float64, ctypes.c_double, 3)
floats_4 = _lookup(types.float64, ctypes.c_double, 4)
floats_5 = _lookup(types.float64, ctypes.c_double, 5)
integers_1 = _lookup(types.int64, ctypes.c_int64, 1)
integers_2 = _lookup(types.int64, ctypes.c_int64, 2)
