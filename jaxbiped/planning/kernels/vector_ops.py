"""Instructions on whole vectors of arenas, for kernels that Numba compiles.

Loops over the batch are what a vectorising compiler should see to, but it must prove that the arrays do not overlap,
and here some are one and the same. So the instructions that matter are spelled out. All arrays are one-dimensional and
contiguous, indices are not checked, and `x[i : i + lanes]` is written `x[i:]` below.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from jaxbiped.planning.costs import FORBIDDEN, STEP, UNMEASURED

BYTE, WORD = ir.IntType(8), ir.IntType(64)


class Vectors:
    """Loads and stores of vectors of `lanes` elements in the arrays that an intrinsic was given."""

    def __init__(self, context, builder, lanes: int):
        self.context, self.builder, self.lanes = context, builder, lanes

    def place(self, kind, array, index):
        """Pointer to the vector at an index, and the alignment that is sure."""
        data = self.context.make_array(kind)(self.context, self.builder, array).data
        vector = ir.VectorType(self.context.get_value_type(kind.dtype), self.lanes)
        pointer = self.builder.bitcast(self.builder.gep(data, [index]), vector.as_pointer())
        return pointer, kind.dtype.bitwidth // 8

    def load(self, kind, array, index):
        pointer, align = self.place(kind, array, index)
        return self.builder.load(pointer, align=align)

    def store(self, value, kind, array, index):
        pointer, align = self.place(kind, array, index)
        self.builder.store(value, pointer, align=align)

    def chosen(self, key, size: int, default: int, kind, table):
        """`table[key * lanes :]` for bytes `key`; that of `default` for keys not below `size`."""
        result = self.load(kind, table, ir.Constant(WORD, default * self.lanes))
        for k in range(size):
            if k != default:
                same = self.builder.icmp_signed("==", key, self.all(k))
                result = self.builder.select(same, self.load(kind, table, ir.Constant(WORD, k * self.lanes)), result)
        return result

    def all(self, value: int):
        """A vector of bytes, all of one value."""
        return ir.Constant(ir.VectorType(BYTE, self.lanes), [value] * self.lanes)


def relaxation(lanes: int):
    """The instruction `relax(cost, here, there, edges, edge) -> changed` for vectors of so many arenas.

    `cost[here:]` becomes the least of itself and `cost[there:] + edges[edge:]`; sums are of the type of `cost`.
    `changed` is an integer of `lanes` bits, set where the cost has become less. NaN never wins.
    """

    @intrinsic
    def relax(typing_context, cost, here, there, edges, edge):
        def generate(context, builder, signature, arguments):
            vectors, (costs, _, _, lengths, _) = Vectors(context, builder, lanes), signature.args
            length = vectors.load(lengths, arguments[3], arguments[4])
            old, new = (vectors.load(costs, arguments[0], arguments[k]) for k in (1, 2))
            if costs.dtype != lengths.dtype:
                length = builder.fpext(length, old.type)
            new = builder.fadd(new, length)
            less = builder.fcmp_ordered("<", new, old)
            vectors.store(builder.select(less, new, old), costs, arguments[0], arguments[1])
            return builder.zext(builder.bitcast(less, ir.IntType(lanes)), WORD)

        return types.uint64(cost, types.intp, types.intp, edges, types.intp), generate

    return relax


def translation(lanes: int, size: int, default: int):
    """The instruction `translate(keys, table, values, at)`: `values[at:]` becomes `table[k * lanes:]` for each key k in
    `keys[at:]`, that of `default` for a key that is not below `size`."""

    @intrinsic
    def translate(typing_context, keys, table, values, at):
        def generate(context, builder, signature, arguments):
            vectors, given = Vectors(context, builder, lanes), signature.args
            key = vectors.load(given[0], arguments[0], arguments[3])
            value = vectors.chosen(key, size, default, given[1], arguments[1])
            vectors.store(value, given[2], arguments[2], arguments[3])
            return context.get_dummy_value()

        return types.void(keys, table, values, types.intp), generate

    return translate


def pricing(lanes: int, diagonal: bool):
    """The instruction `price(edges, edge, kinds, levels, here, there, side, other, prices, cutting)`.

    `edges[edge:]` becomes what a move from `here` to `there` costs, by the rules of `costs.move_kind`, of which this is
    the same in other words. `kinds` and `levels` are of cells, `side` and `other` are the orthogonal neighbours of an
    diagonal move. `prices[k * lanes :]` is the cost of a move of kind k, `cutting` is not 0 where corners may be cut.
    """

    @intrinsic
    def price(typing_context, edges, edge, kinds, levels, here, there, side, other, prices, cutting):
        def generate(context, builder, signature, arguments):
            vectors, given = Vectors(context, builder, lanes), signature.args

            def load(array, index):
                return vectors.load(given[array], arguments[array], index)

            def largest(a, b):
                return builder.select(builder.icmp_signed(">", a, b), a, b)

            def equal(a, value: int):
                return builder.icmp_signed("==", a, vectors.all(value))

            (a, b), (up, down) = ((load(k, arguments[4]), load(k, arguments[5])) for k in (2, 3))
            # the difference of two bytes may need nine bits with a sign, but eight without
            higher = builder.icmp_signed(">", up, down)
            rise = builder.select(higher, builder.sub(up, down), builder.sub(down, up))
            step = builder.select(equal(rise, 1), vectors.all(STEP), vectors.all(FORBIDDEN))
            ends = largest(a, b)
            kind = largest(ends, builder.select(equal(rise, 0), vectors.all(0), step))
            kind = builder.select(equal(ends, UNMEASURED), ends, kind)
            if diagonal:
                one, two = (equal(load(2, arguments[k]), FORBIDDEN) for k in (6, 7))
                careful = equal(load(9, ir.Constant(WORD, 0)), 0)
                blocked = builder.or_(builder.and_(one, two), builder.and_(builder.or_(one, two), careful))
                kind = builder.select(blocked, vectors.all(FORBIDDEN), kind)
            cost = vectors.chosen(kind, FORBIDDEN, FORBIDDEN, given[8], arguments[8])
            vectors.store(cost, given[0], arguments[0], arguments[1])
            return context.get_dummy_value()

        at = types.intp
        return types.void(edges, at, kinds, levels, at, at, at, at, prices, cutting), generate

    return price


def transposition(size: int):
    """The instruction `transpose(rows, row, stride, columns, column, step)` of `size` x `size` elements.

    `columns[column + j * step + i]` becomes `rows[row + i * stride + j]` for all i and j below `size`, a power of two.
    """

    @intrinsic
    def transpose(typing_context, rows, row, stride, columns, column, step):
        def generate(context, builder, signature, arguments):
            vectors, (source, *_), result = Vectors(context, builder, size), signature.args, signature.args[3]

            def places(start, stride):
                return [builder.add(start, builder.mul(stride, ir.Constant(WORD, i))) for i in range(size)]

            block = [vectors.load(source, arguments[0], place) for place in places(*arguments[1:3])]
            if source.dtype != result.dtype:
                narrow = ir.VectorType(context.get_value_type(result.dtype), size)
                block = [builder.fptrunc(vector, narrow) for vector in block]
            width = 1
            while width < size:  # swaps the off-diagonal halves of blocks of twice this width
                upper = [j if not j & width else size + j - width for j in range(size)]
                lower = [j + width if not j & width else size + j for j in range(size)]
                masks = [ir.Constant(ir.VectorType(ir.IntType(32), size), mask) for mask in (upper, lower)]
                for i in range(size):
                    if not i & width:
                        pair = block[i], block[i + width]
                        block[i], block[i + width] = (builder.shuffle_vector(*pair, mask) for mask in masks)
                width *= 2
            for vector, place in zip(block, places(*arguments[4:]), strict=True):
                vectors.store(vector, result, arguments[3], place)
            return context.get_dummy_value()

        at = types.intp
        return types.void(rows, at, at, columns, at, at), generate

    return transpose
