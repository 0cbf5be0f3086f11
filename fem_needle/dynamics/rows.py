"""Arrays as compiled functions hand them on: an address, sizes and steps, no more.

Numba's own arrays are ten numbers and more, of owners, bytes and layouts, which cost more time to compile than what is done with
them, and their indices may be negative, for which every access pays. Here an index counts from the start, which is checked where
numba is told to (NUMBA_BOUNDSCHECK), slices have no steps, parts of arrays are of one type, and loops go over indices.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import lower_builtin, lower_cast, lower_getattr, models, register_model

_WORD = ir.IntType(64)


class Rows(types.Type):
    """Numbers of one type along some axes; the last axis has no gaps."""

    mutable = True

    def __init__(self, dtype: Any, ndim: int) -> None:
        self.dtype, self.ndim = dtype, ndim
        super().__init__(name=f"Rows({dtype}, {ndim})")


class Table(types.Type):
    """The table of all arrays: its address."""

    def __init__(self) -> None:
        super().__init__(name="Table")


TABLE = Table()


@register_model(Rows)
class _RowsModel(models.StructModel):
    """Address, sizes, and steps of all axes but the last."""

    def __init__(self, manager: Any, rows: Any) -> None:
        words = [(f"word{number}", types.intp) for number in range(2 * rows.ndim - 1)]
        super().__init__(manager, rows, [("data", types.CPointer(rows.dtype)), *words])


@register_model(Table)
class _TableModel(models.PrimitiveModel):
    def __init__(self, manager: Any, table: Any) -> None:
        super().__init__(manager, table, _WORD.as_pointer())


@lower_cast(types.Array, Table)
def _address(context: Any, builder: Any, before: Any, after: Any, value: Any) -> Any:
    return context.make_array(before)(context, builder, value).data


def rows_value(context: Any, builder: Any, rows: Rows, data: Any, sizes: list[Any], steps: list[Any]) -> Any:
    """Return the value of rows in LLVM."""
    value = ir.Constant(context.get_value_type(rows), ir.Undefined)
    for position, part in enumerate((data, *sizes, *steps[: rows.ndim - 1])):
        value = builder.insert_value(value, part, position)
    return value


def _kinds(index: Any) -> tuple[Any, ...]:
    return tuple(getattr(index, "types", (index,)))


def _can_index(kind: Any) -> bool:
    return isinstance(kind, types.Integer) or (isinstance(kind, types.SliceType) and not kind.has_step)


def _indexed(rows: Rows, index: Any) -> Any:
    """Return the type of a part, None where it cannot be taken."""
    kinds = _kinds(index)
    if len(kinds) > rows.ndim or not all(map(_can_index, kinds)):
        return None
    left = rows.ndim - sum(isinstance(kind, types.Integer) for kind in kinds)
    if left and len(kinds) == rows.ndim and isinstance(kinds[-1], types.Integer):
        return None  # the last axis would have gaps
    return Rows(rows.dtype, left) if left else rows.dtype


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Type rows[index]."""
        rows, index = args
        part = _indexed(rows, index) if isinstance(rows, Rows) else None
        return None if part is None else signature(part, rows, index)


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Type rows[index] = value."""
        rows, index, value = args
        part = _indexed(rows, index) if isinstance(rows, Rows) else None
        if part is None:
            return None
        return signature(types.void, rows, index, value if part == value else rows.dtype)


@infer_global(len)
class _Length(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Type len(rows)."""
        return signature(types.intp, args[0]) if isinstance(args[0], Rows) else None


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Rows

    def resolve_shape(self, rows: Any) -> Any:
        """Type rows.shape."""
        return types.UniTuple(types.intp, rows.ndim)


@lower_builtin(len, Rows)
def _length(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.extract_value(args[0], 1)


@lower_getattr(Rows, "shape")
def _shape(context: Any, builder: Any, rows: Any, value: Any) -> Any:
    return cgutils.pack_array(builder, [builder.extract_value(value, 1 + axis) for axis in range(rows.ndim)])


def _part(context: Any, builder: Any, rows: Any, value: Any, index_type: Any, index: Any) -> tuple[Any, list[Any], list[Any]]:
    """Return address, sizes and steps of a part, the step of the last axis None."""
    kinds = _kinds(index_type)
    indices = cgutils.unpack_tuple(builder, index, len(kinds)) if isinstance(index_type, types.BaseTuple) else [index]
    steps, all_left, data = _steps(builder, rows, value), [], builder.extract_value(value, 0)
    places: list[Any] = [ir.Constant(_WORD, 0)] * rows.ndim
    for axis in range(rows.ndim):
        size = builder.extract_value(value, 1 + axis)
        if axis >= len(kinds):
            all_left.append((size, steps[axis]))
        elif isinstance(kinds[axis], types.Integer):
            places[axis] = context.cast(builder, indices[axis], kinds[axis], types.intp)
            if context.enable_boundscheck:
                _check(context, builder, places[axis], size)
        else:
            places[axis], count = _cut(context, builder, kinds[axis], indices[axis], size)
            all_left.append((count, steps[axis]))
    return _at(builder, data, places, steps), [size for size, _ in all_left], [step for _, step in all_left]


def _cut(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> tuple[Any, Any]:
    """Return the first number of a slice and how many it has."""
    cut = context.make_helper(builder, kind, value=index)
    last = builder.select(builder.icmp_signed("<", cut.stop, size), cut.stop, size)
    if context.enable_boundscheck:
        _check(context, builder, cut.start, builder.add(last, ir.Constant(_WORD, 1)))
    return cut.start, builder.sub(last, cut.start, flags=("nsw",))


def _check(context: Any, builder: Any, index: Any, size: Any) -> None:
    """Raise IndexError where an index is negative or too large."""
    with builder.if_then(builder.icmp_unsigned(">=", index, size), likely=False):
        context.call_conv.return_user_exc(builder, IndexError, ("index out of bounds",))


@lower_builtin(operator.getitem, Rows, types.Any)
def _get(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    data, sizes, steps = _part(context, builder, sig.args[0], args[0], sig.args[1], args[1])
    if not sizes:
        return builder.load(data)
    return rows_value(context, builder, sig.return_type, data, sizes, steps)


@lower_builtin(operator.setitem, Rows, types.Any, types.Any)
def _set(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    data, sizes, steps = _part(context, builder, sig.args[0], args[0], sig.args[1], args[1])
    if not sizes:
        builder.store(args[2], data)
        return context.get_dummy_value()
    with cgutils.loop_nest(builder, sizes, _WORD) as places:
        value = args[2]
        if isinstance(sig.args[2], Rows):
            value = builder.load(_at(builder, builder.extract_value(value, 0), places, _steps(builder, sig.args[2], value)))
        builder.store(value, _at(builder, data, places, steps))
    return context.get_dummy_value()


def _steps(builder: Any, rows: Any, value: Any) -> list[Any]:
    return [builder.extract_value(value, 1 + rows.ndim + axis) for axis in range(rows.ndim - 1)] + [None]


def _at(builder: Any, data: Any, places: Any, steps: list[Any]) -> Any:
    """Return the address of a place."""
    offset = places[-1]
    for place, step in zip(places[:-1], steps[:-1], strict=True):
        offset = builder.add(offset, builder.mul(place, step, flags=("nsw",)), flags=("nsw",))
    return builder.gep(data, [offset], inbounds=True)
