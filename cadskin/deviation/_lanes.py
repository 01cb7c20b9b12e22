"""Rows of `COLUMNS` numbers as one value: the innermost loops of all samplers, written as LLVM instructions.

The compiler cannot know that two numpy arrays do not overlap, and asks at every row; here it need not. The
sums have one order on every machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils as code_helpers
from numba.core import errors, types
from numba.extending import intrinsic

__all__ = [
    "COLUMNS",
    "TILE",
    "add_rows",
    "add_square",
    "four_products",
    "one_product",
    "read_tile",
    "write_tile",
]

COLUMNS = 32  # a literal, a multiple of TILE: the compiled code has it inside, its cache does not look here
TILE = 16  # numbers on a side of the squares that are transposed

cgutils: Any = code_helpers  # has no type hints
_INT = ir.IntType(64)
_FLOAT = ir.FloatType()
_ROW = ir.VectorType(_FLOAT, COLUMNS)
_SIDE = ir.VectorType(_FLOAT, TILE)
_WIDE_SIDE = ir.VectorType(ir.DoubleType(), TILE)


def _instruction(function: Callable[..., Any]) -> Any:
    """Make numba write the instructions that ``function`` generates where it is called."""
    return intrinsic(function)


@_instruction
def add_rows(_: Any, rows: Any, ids: Any, weights: Any, line: Any, kept: Any, out: Any, place: Any) -> Any:
    """out[place] = kept out[place] + sum_k weights[line, k] rows[ids[line, k]]; k runs to a multiple of 4.

    ``rows`` and ``out`` are (any, COLUMNS) float32 and may be the same array, ``ids`` are uint32 and
    ``weights`` float32, all of them contiguous.
    """
    _demand(rows, types.float32, out, types.float32, weights, types.float32, ids, types.uint32)
    signature = types.void(rows, ids, weights, types.intp, types.float32, out, types.intp)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        source, numbers, factors, target = _arrays(context, builder, signature, values, (0, 1, 2, 5))
        count = cgutils.unpack_tuple(builder, numbers.shape)[1]
        first = builder.mul(values[3], count)
        destination = _row_at(builder, target, values[6])
        start = builder.fmul(_load(builder, destination), _all(builder, values[4]))

        def step(k: Any, sums: Sequence[Any]) -> list[Any]:
            totals = list(sums)
            for t in range(4):
                at = builder.add(first, builder.add(k, _int(t)))
                number = builder.zext(builder.load(builder.gep(numbers.data, [at])), _INT)
                factor = _all(builder, builder.load(builder.gep(factors.data, [at])))
                row = _load(builder, _row_at(builder, source, number))
                totals[t % 2] = _multiply_add(builder, factor, row, totals[t % 2])
            return totals

        even, odd = _loop(builder, count, 4, [start, ir.Constant(_ROW, [0.0] * COLUMNS)], step)
        _store(builder, builder.fadd(even, odd), destination)
        return context.get_dummy_value()

    return signature, generate


def _product_of(lines: int) -> Any:
    @_instruction
    def product(_: Any, weights: Any, rows: Any, line: Any, count: Any, out: Any) -> Any:
        _demand(rows, types.float32, out, types.float32, weights, types.float32)
        signature = types.void(weights, rows, types.intp, types.intp, out)

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            factors, source, target = _arrays(context, builder, signature, values, (0, 1, 4))
            width = cgutils.unpack_tuple(builder, factors.shape)[1]
            places = [builder.add(values[2], _int(i)) for i in range(lines)]
            starts = [builder.mul(place, width) for place in places]

            def step(k: Any, sums: Sequence[Any]) -> list[Any]:
                row = _load(builder, _row_at(builder, source, k))
                at = [builder.gep(factors.data, [builder.add(start, k)]) for start in starts]
                factor = [_all(builder, builder.load(one)) for one in at]
                return [_multiply_add(builder, f, row, s) for f, s in zip(factor, sums, strict=True)]

            empty = [ir.Constant(_ROW, [0.0] * COLUMNS)] * lines
            for place, total in zip(places, _loop(builder, values[3], 1, empty, step), strict=True):
                _store(builder, total, _row_at(builder, target, place))
            return context.get_dummy_value()

        return signature, generate

    product.__doc__ = (
        f"""out[i] = sum_k weights[i, k] rows[k], k < count, for {lines} lines i from ``line`` on."""
    )
    return product


one_product = _product_of(1)
four_products = _product_of(4)


@_instruction
def add_square(
    _: Any,
    rows: Any,
    node: Any,
    step: Any,
    weights: Any,
    line: Any,
    outer: Any,
    kept: Any,
    out: Any,
    place: Any,
) -> Any:
    """out[place] = kept out[place] + outer sum_bc v[b] w[c] rows[node + step b + c], b and c below 4.

    v and w are the last two of ``weights[line]`` (d, 4), d being 2 or 3; all arrays are float32.
    """
    _demand(rows, types.float32, out, types.float32, weights, types.float32)
    signature = types.void(
        rows, types.intp, types.intp, weights, types.intp, types.float32, types.float32, out, types.intp
    )

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        source, factors, target = _arrays(context, builder, signature, values, (0, 3, 7))
        axes = cgutils.unpack_tuple(builder, factors.shape)[1]
        last = builder.sub(builder.mul(builder.add(values[4], _int(1)), builder.mul(axes, _int(4))), _int(8))
        pairs = [builder.load(builder.gep(factors.data, [builder.add(last, _int(k))])) for k in range(8)]
        across, along = pairs[:4], [_all(builder, factor) for factor in pairs[4:]]
        destination = _row_at(builder, target, values[8])
        total = builder.fmul(_load(builder, destination), _all(builder, values[6]))
        for b in range(4):
            first = builder.add(values[1], builder.mul(values[2], _int(b)))
            line = ir.Constant(_ROW, [0.0] * COLUMNS)
            for c in range(4):
                row = _load(builder, _row_at(builder, source, builder.add(first, _int(c))))
                line = _multiply_add(builder, along[c], row, line)
            total = _multiply_add(builder, _all(builder, builder.fmul(across[b], values[5])), line, total)
        _store(builder, total, destination)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def read_tile(_: Any, rows: Any, first: Any, place: Any, out: Any, line: Any) -> Any:
    """out[line + j, first + i] = rows[first + i, place + j] for i and j below TILE; float32."""
    _demand(out, types.float32)
    _demand(rows, types.float32, contiguous=False)
    signature = types.void(rows, types.intp, types.intp, out, types.intp)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        source, target = _arrays(context, builder, signature, values, (0, 3))
        sides = [
            _load(builder, _address(builder, source, builder.add(values[1], _int(i)), values[2], _SIDE))
            for i in range(TILE)
        ]
        for j, side in enumerate(_transposed(builder, sides)):
            place = _address(builder, target, builder.add(values[4], _int(j)), values[1], _SIDE)
            _store(builder, side, place)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def write_tile(
    _: Any, columns: Any, lines: Any, scale: Any, first: Any, part: Any, out: Any, place: Any
) -> Any:
    """out[part + i, place + j] = scale[first + j] columns[lines[first + j], part + i], i and j below TILE.

    ``columns`` is float32, ``lines`` uint32, ``scale`` and ``out`` are float64.
    """
    _demand(columns, types.float32, lines, types.uint32, scale, types.float64)
    _demand(out, types.float64, contiguous=False)
    signature = types.void(columns, lines, scale, types.intp, types.intp, out, types.intp)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        source, numbers, factors, target = _arrays(context, builder, signature, values, (0, 1, 2, 5))
        sides = []
        for j in range(TILE):
            at = builder.gep(numbers.data, [builder.add(values[3], _int(j))])
            number = builder.zext(builder.load(at), _INT)
            sides.append(_load(builder, _address(builder, source, number, values[4], _SIDE)))
        pointer = builder.bitcast(builder.gep(factors.data, [values[3]]), _WIDE_SIDE.as_pointer())
        factor = _load(builder, pointer)
        for i, side in enumerate(_transposed(builder, sides)):
            wide = builder.fmul(builder.fpext(side, _WIDE_SIDE), factor)
            row = builder.add(values[4], _int(i))
            _store(builder, wide, _address(builder, target, row, values[6], _WIDE_SIDE))
        return context.get_dummy_value()

    return signature, generate


def _demand(*pairs: Any, contiguous: bool = True) -> None:
    """Refuse to compile for other arrays than those the instructions are written for."""
    for array, number in zip(pairs[::2], pairs[1::2], strict=True):
        if array.dtype != number or (contiguous and array.layout != "C"):
            raise errors.TypingError(f"expected a contiguous array of {number}, got {array}")


def _int(value: int) -> Any:
    return ir.Constant(_INT, value)


def _arrays(context: Any, builder: Any, signature: Any, values: Any, which: Sequence[int]) -> list[Any]:
    return [context.make_array(signature.args[i])(context, builder, value=values[i]) for i in which]


def _row_at(builder: Any, array: Any, line: Any) -> Any:
    pointer = builder.gep(array.data, [builder.mul(line, _int(COLUMNS))])
    return builder.bitcast(pointer, _ROW.as_pointer())


def _address(builder: Any, array: Any, row: Any, column: Any, kind: Any) -> Any:
    """Pointer to an entry of a matrix whose rows may be apart, as a vector."""
    step, size = cgutils.unpack_tuple(builder, array.strides)
    offset = builder.add(builder.mul(row, step), builder.mul(column, size))
    return builder.inttoptr(builder.add(builder.ptrtoint(array.data, _INT), offset), kind.as_pointer())


def _load(builder: Any, pointer: Any) -> Any:
    loaded = builder.load(pointer)
    loaded.align = 4  # numpy's rows begin anywhere
    return loaded


def _store(builder: Any, value: Any, pointer: Any) -> None:
    builder.store(value, pointer).align = 4


def _all(builder: Any, number: Any) -> Any:
    """One number in every column."""
    empty = ir.Constant(_ROW, ir.Undefined)
    single = builder.insert_element(empty, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(single, empty, ir.Constant(ir.VectorType(ir.IntType(32), COLUMNS), None))


def _multiply_add(builder: Any, factor: Any, row: Any, total: Any) -> Any:
    kind = ir.FunctionType(_ROW, [_ROW] * 3)
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fmuladd.v{COLUMNS}f32")
    return builder.call(function, [factor, row, total])


def _loop(
    builder: Any, stop: Any, step: int, sums: Sequence[Any], body: Callable[[Any, Sequence[Any]], list[Any]]
) -> list[Any]:
    """Run ``body(k, sums)`` for k = 0, step, ... below ``stop``, at least once; return the last sums."""
    before = builder.block
    inside, after = (builder.append_basic_block(name) for name in ("row", "rows.done"))
    builder.branch(inside)
    builder.position_at_end(inside)
    k = builder.phi(_INT)
    running = [builder.phi(_ROW) for _ in sums]
    totals = body(k, running)
    following = builder.add(k, _int(step))
    k.add_incoming(_int(0), before)
    k.add_incoming(following, builder.block)
    for one, start, total in zip(running, sums, totals, strict=True):
        one.add_incoming(start, before)
        one.add_incoming(total, builder.block)
    builder.cbranch(builder.icmp_signed("<", following, stop), inside, after)
    builder.position_at_end(after)
    return totals


def _transposed(builder: Any, sides: Sequence[Any]) -> Sequence[Any]:
    """Transpose TILE vectors of TILE numbers: each pass deals two halves into each other, like cards."""
    half = TILE // 2
    numbers = ir.VectorType(ir.IntType(32), TILE)
    low, high = (
        ir.Constant(numbers, [c for i in range(start, start + half) for c in (i, i + TILE)])
        for start in (0, half)
    )
    for _ in range(TILE.bit_length() - 1):
        sides = [
            builder.shuffle_vector(sides[i], sides[i + half], mask)
            for i in range(half)
            for mask in (low, high)
        ]
    return sides
