"""Products of small blocks of dense matrices, as LLVM instructions: the inner loops of the sparse Cholesky.

A front, a dense symmetric matrix of which the upper half is used, is cut into strips of `WIDTH` columns. In a
strip the rows follow each other, so that every operand below is a run of numbers in the flat array of fronts.
Rows of the factor are kept in groups of `LINES`, the numbers of a column next to each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils as code_helpers
from numba.core import types
from numba.extending import intrinsic

from cadskin.deviation._lanes import COLUMNS

__all__ = [
    "LINES",
    "WIDTH",
    "add_products",
    "eliminate",
    "gather_products",
    "keep_lines",
    "subtract_products",
]

WIDTH = 8  # columns of a strip of a front, in double precision
LINES = 4  # rows of the factor that are kept, and used, together, in single precision

cgutils: Any = code_helpers  # has no type hints
_INT = ir.IntType(64)
_BLOCK_ROW = ir.VectorType(ir.DoubleType(), WIDTH)
_COLUMNS = ir.VectorType(ir.FloatType(), COLUMNS)
_FAST = ("contract",)  # a product and a sum may become one instruction


def _instruction(function: Callable[..., Any]) -> Any:
    """Make numba write the instructions that ``function`` generates where it is called."""
    return intrinsic(function)


@_instruction
def subtract_products(_: Any, fronts: Any, left: Any, right: Any, block: Any, count: Any) -> Any:
    """block[i, j] -= sum of left[k, i] right[k, j] over k < count; i and j below WIDTH, float64."""
    signature = types.void(fronts, types.intp, types.intp, types.intp, types.intp)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        (data,) = _data(context, builder, signature, values, 0)
        sums = _read_block(builder, data, values[3])

        def step(k: Any) -> None:
            row = builder.mul(k, _int(WIDTH))
            line = _load(builder, data, builder.add(values[2], row), _BLOCK_ROW)
            for i, total in enumerate(sums):
                factor = _number(builder, data, builder.add(values[1], row), i)
                _add_product(builder, total, builder.fneg(factor), line)

        _loop(builder, values[4], step)
        _write_block(builder, data, values[3], sums)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def eliminate(_: Any, fronts: Any, diagonal: Any, inverse: Any, first: Any, block: Any, count: Any) -> Any:
    """For rows k < count: block[k] *= inverse[first + k], then block[i] -= diagonal[k, i] block[k], i > k."""
    signature = types.void(fronts, types.intp, inverse, types.intp, types.intp, types.intp)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data, scales = _data(context, builder, signature, values, 0, 2)
        sums = _read_block(builder, data, values[4])
        for k in range(WIDTH):
            with builder.if_then(builder.icmp_signed("<", _int(k), values[5])):
                scale = _spread(builder, _number(builder, scales, values[3], k), _BLOCK_ROW)
                row = builder.fmul(builder.load(sums[k]), scale)
                builder.store(row, sums[k])
                for i in range(k + 1, WIDTH):
                    factor = _number(builder, data, values[1], k * WIDTH + i)
                    _add_product(builder, sums[i], builder.fneg(factor), row)
        _write_block(builder, data, values[4], sums)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def keep_lines(_: Any, fronts: Any, source: Any, kept: Any, target: Any, count: Any) -> Any:
    """kept[target + LINES k + q] = -fronts[source + WIDTH k + q] in float32, for k < count and q < LINES."""
    signature = types.void(fronts, types.intp, kept, types.intp, types.intp)
    wide, narrow = (ir.VectorType(kind, LINES) for kind in (ir.DoubleType(), ir.FloatType()))

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data, single = _data(context, builder, signature, values, 0, 2)

        def step(k: Any) -> None:
            numbers = _load(builder, data, builder.add(values[1], builder.mul(k, _int(WIDTH))), wide)
            place = builder.add(values[3], builder.mul(k, _int(LINES)))
            _store(builder, builder.fneg(builder.fptrunc(numbers, narrow)), single, place)

        _loop(builder, values[4], step)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def add_products(
    _: Any, kept: Any, place: Any, count: Any, x: Any, first: Any, old: Any, rows: Any, at: Any, lines: Any
) -> Any:
    """x[rows[at + q]] = old x[rows[at + q]] + sum over k < count of kept[place + LINES k + q] x[first + k].

    q is below ``lines``, at most LINES; x (n, COLUMNS) and ``kept`` are float32, ``rows`` uint32.
    """
    whole = types.intp
    signature = types.void(kept, whole, whole, x, whole, types.float32, rows, whole, whole)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        factors, data, numbers = _data(context, builder, signature, values, 0, 3, 6)
        sums = _empty_sums(builder)

        def step(k: Any) -> None:
            line = _load(builder, data, _row(builder, builder.add(values[4], k)), _COLUMNS)
            begin = builder.add(values[1], builder.mul(k, _int(LINES)))
            for q, total in enumerate(sums):
                _add_product(builder, total, _number(builder, factors, begin, q), line)

        _loop(builder, values[2], step)
        for q, total in enumerate(sums):
            with builder.if_then(builder.icmp_signed("<", _int(q), values[8])):
                number = builder.zext(_number(builder, numbers, values[7], q), _INT)
                _update(builder, data, number, values[5], total)
        return context.get_dummy_value()

    return signature, generate


@_instruction
def gather_products(
    _: Any, kept: Any, place: Any, step: Any, rows: Any, span: Any, x: Any, first: Any, old: Any, lines: Any
) -> Any:
    """x[first + k] = old x[first + k] + sum kept[place + step i + LINES k + q] x[rows[begin + LINES i + q]].

    k is below ``lines``, at most LINES, q below LINES, and i runs from 0 until the end of ``span`` = (begin,
    end) is reached; x (n, COLUMNS) and ``kept`` are float32, ``rows`` uint32.
    """
    whole = types.intp
    signature = types.void(kept, whole, whole, rows, span, x, whole, types.float32, whole)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        factors, numbers, data = _data(context, builder, signature, values, 0, 3, 5)
        low, stop = cgutils.unpack_tuple(builder, values[4])
        sums = _empty_sums(builder)
        last = builder.sub(builder.sdiv(builder.sub(stop, low), _int(LINES)), _int(1))

        def step(k: Any) -> None:
            i = builder.sub(last, k)  # backwards through the memory, as the panels go
            begin = builder.add(values[1], builder.mul(values[2], i))
            lines = builder.add(low, builder.mul(i, _int(LINES)))
            for q in range(LINES):
                number = builder.zext(_number(builder, numbers, lines, q), _INT)
                line = _load(builder, data, _row(builder, number), _COLUMNS)
                for k, total in enumerate(sums):
                    _add_product(builder, total, _number(builder, factors, begin, LINES * k + q), line)

        _loop(builder, builder.add(last, _int(1)), step)
        for k, total in enumerate(sums):
            with builder.if_then(builder.icmp_signed("<", _int(k), values[8])):
                _update(builder, data, builder.add(values[6], _int(k)), values[7], total)
        return context.get_dummy_value()

    return signature, generate


def _int(value: int) -> Any:
    return ir.Constant(_INT, value)


def _row(builder: Any, number: Any) -> Any:
    return builder.mul(number, _int(COLUMNS))


def _data(context: Any, builder: Any, signature: Any, values: Any, *which: int) -> list[Any]:
    return [context.make_array(signature.args[i])(context, builder, value=values[i]).data for i in which]


def _number(builder: Any, data: Any, place: Any, more: int) -> Any:
    return builder.load(builder.gep(data, [builder.add(place, _int(more))]))


def _load(builder: Any, data: Any, place: Any, kind: Any) -> Any:
    """Load a vector that begins anywhere in an array."""
    loaded = builder.load(builder.bitcast(builder.gep(data, [place]), kind.as_pointer()))
    loaded.align = 4
    return loaded


def _store(builder: Any, vector: Any, data: Any, place: Any) -> None:
    pointer = builder.bitcast(builder.gep(data, [place]), vector.type.as_pointer())
    builder.store(vector, pointer).align = 4


def _spread(builder: Any, number: Any, kind: Any) -> Any:
    """Return a vector of equal numbers."""
    empty = ir.Constant(kind, ir.Undefined)
    single = builder.insert_element(empty, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(single, empty, ir.Constant(ir.VectorType(ir.IntType(32), kind.count), None))


def _add_product(builder: Any, total: Any, factor: Any, line: Any) -> None:
    product = builder.fmul(_spread(builder, factor, line.type), line, flags=_FAST)
    builder.store(builder.fadd(builder.load(total), product, flags=_FAST), total)


def _read_block(builder: Any, data: Any, place: Any) -> list[Any]:
    """Return variables, registers after optimisation, that hold the rows of a block."""
    sums = [cgutils.alloca_once(builder, _BLOCK_ROW) for _ in range(WIDTH)]
    for i, total in enumerate(sums):
        builder.store(_load(builder, data, builder.add(place, _int(i * WIDTH)), _BLOCK_ROW), total)
    return sums


def _write_block(builder: Any, data: Any, place: Any, sums: Sequence[Any]) -> None:
    for i, total in enumerate(sums):
        _store(builder, builder.load(total), data, builder.add(place, _int(i * WIDTH)))


def _empty_sums(builder: Any) -> list[Any]:
    sums = [cgutils.alloca_once(builder, _COLUMNS) for _ in range(LINES)]
    for total in sums:
        builder.store(ir.Constant(_COLUMNS, [0.0] * COLUMNS), total)
    return sums


def _update(builder: Any, data: Any, number: Any, old: Any, total: Any) -> None:
    """Row ``number`` of the columns becomes ``old`` times itself plus a sum."""
    place = _row(builder, number)
    before = builder.fmul(_spread(builder, old, _COLUMNS), _load(builder, data, place, _COLUMNS), flags=_FAST)
    _store(builder, builder.fadd(before, builder.load(total), flags=_FAST), data, place)


def _loop(builder: Any, stop: Any, body: Callable[[Any], None]) -> None:
    with cgutils.for_range(builder, stop) as loop:
        body(loop.index)
