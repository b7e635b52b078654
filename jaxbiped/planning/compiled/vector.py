"""Relaxations of many arenas at once, as instructions on whole vectors.

Loops over the batch are what a vectorising compiler should see to, but it must prove that the arrays do not overlap,
and here they are one and the same. So the one instruction that matters is spelled out.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def relaxation(lanes: int):
    """The instruction `relax(cost, here, there, edges, edge) -> changed` for vectors of so many arenas.

    `cost[here : here + lanes]` becomes the least of itself and `cost[there : there + lanes] + edges[edge : edge +
    lanes]`. Both arrays are one-dimensional and contiguous; sums are of the type of `cost`. `changed` is an integer of
    `lanes` bits, set where the cost has become less. NaN never wins. Indices are not checked.
    """

    @intrinsic
    def relax(typing_context, cost, here, there, edges, edge):
        def generate(context, builder, signature, arguments):
            (costs, _, _, lengths, _), arrays = signature.args, {}
            for name, kind, value in (("cost", costs, arguments[0]), ("edges", lengths, arguments[3])):
                vector = ir.VectorType(context.get_value_type(kind.dtype), lanes)
                arrays[name] = context.make_array(kind)(context, builder, value).data, vector, kind.dtype.bitwidth // 8

            def place(name, index):
                data, vector, align = arrays[name]
                return builder.bitcast(builder.gep(data, [index]), vector.as_pointer()), align

            def load(name, index):
                pointer, align = place(name, index)
                return builder.load(pointer, align=align)

            length = load("edges", arguments[4])
            if costs.dtype != lengths.dtype:
                length = builder.fpext(length, arrays["cost"][1])
            old, new = load("cost", arguments[1]), builder.fadd(load("cost", arguments[2]), length)
            less = builder.fcmp_ordered("<", new, old)
            pointer, align = place("cost", arguments[1])
            builder.store(builder.select(less, new, old), pointer, align=align)
            return builder.zext(builder.bitcast(less, ir.IntType(lanes)), ir.IntType(64))

        return types.uint64(cost, types.intp, types.intp, edges, types.intp), generate

    return relax
