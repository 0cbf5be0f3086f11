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
from numba.core import cgutils, config
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

TABLE_COLUMNS = 6  # address and up to five sizes


def _lookup(kind: Any, c_type: Any, dimensions: int) -> Any:
    """Return the function (table, name) -> array of some number type and number of axes."""
    array_type = types.Array(kind, dimensions, "C")

    def typed(context: Any, table: Any, name: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            rows = make_array(signature.args[0])(context, builder, arguments[0])
            word = ir.IntType(64)
            first = builder.mul(arguments[1], ir.Constant(word, TABLE_COLUMNS))
            entries = [
                builder.load(builder.gep(rows.data, [builder.add(first, ir.Constant(word, column))]))
                for column in range(dimensions + 1)
            ]
            size = context.get_abi_sizeof(context.get_data_type(kind))
            strides: list[Any] = []
            stride: Any = ir.Constant(word, size)
            for extent in reversed(entries[1:]):
                strides.insert(0, stride)
                stride = builder.mul(stride, extent)
            found = make_array(array_type)(context, builder)
            data = builder.inttoptr(entries[0], context.get_value_type(kind).as_pointer())
            populate_array(
                found,
                data=data,
                shape=cgutils.pack_array(builder, entries[1:]),
                strides=cgutils.pack_array(builder, strides),
                itemsize=ir.Constant(word, size),
                meminfo=None,
            )
            return found._getvalue()

        return array_type(table, types.int64), generate

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
