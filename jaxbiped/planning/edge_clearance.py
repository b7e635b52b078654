"""The cost of walking along an edge of the ground: feet are wider than the line of a plan."""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxbiped.mapping.grid import Cell
from jaxbiped.planning.costs import BASE_PITCH, DIRECTIONS

# [m] from the line of a move to the centre of a cell beside it, and the extra cost of a 5 cm move if it is higher:
# within the first the feet would step on it, within the second they might: an edge may be anywhere in its cell
HIGHER = ((0.075, 8.0), (0.11, 5.0))
LOWER = ((0.06, 8.0), (0.11, 3.0))  # the same if it is lower: an ankle beyond the edge has no support
TOES = 0.05  # [m] reach of a foot beyond both ends of a move
# the same beside a move over an edge, for each cell whose ground differs from that at the move's ends
RAGGED = ((0.06, 3.0), (0.11, 1.0))
LEAST = 1e-3  # [m]
NOWHERE = -99  # level of cells that cannot be stepped on


def rim_costs(classes: Int[Array, "B H W"], levels: Int[Array, "B H W"], pitch: float) -> Float[Array, "B 8 H W"]:
    """Surcharge on `edge_costs` for a robot whose feet stand 15 cm wide: it keeps away from edges beside it.

    A move on one level costs more if ground on another level lies beside it, or diagonally before its toes or behind
    its heels. An edge straight ahead does not count: it is crossed perpendicularly. A move over an edge costs more
    where the edge is not straight, as at a corner, since both feet need ground beyond it. A move costs the same in both
    directions. Deviation: the robot of the paper's plan has no feet.

    Args:
      pitch: static [m].
    """
    height, width = classes.shape[1:]
    reach = math.ceil((HIGHER[-1][0] + TOES) / pitch) + 1
    ring = ((0, 0), (reach, reach), (reach, reach))
    ground = (classes == Cell.FLOOR) | (classes == Cell.BUMP)
    level = jnp.where(ground, levels.astype(jnp.int32), NOWHERE)
    padded = jnp.pad(level, ring, constant_values=NOWHERE)

    def at(di, dj):
        return padded[:, reach + di : reach + di + height, reach + dj : reach + dj + width]

    def price(table, beside):
        return next((cost for within, cost in table if beside <= within), 0.0)

    out = []
    for di, dj in (tuple(int(d) for d in direction) for direction in DIRECTIONS):
        length = math.hypot(di, dj)
        there, known = at(di, dj), ground & (at(di, dj) != NOWHERE)
        level_walk, over = known & (there == level), known & (there != level)
        into = at(2 * di, 2 * dj), at(-di, -dj)  # the cells straight ahead and straight behind
        surcharge, ragged = jnp.zeros(classes.shape), jnp.zeros(classes.shape)
        for oi, oj in np.ndindex(2 * reach + 1, 2 * reach + 1):
            oi, oj = oi - reach, oj - reach
            along = ((oi - di / 2) * di + (oj - dj / 2) * dj) / length * pitch
            beside = abs((oi - di / 2) * dj - (oj - dj / 2) * di) / length * pitch
            past = abs(along) - length * pitch / 2  # [m] beyond an end
            if beside < LEAST or past > TOES + LEAST:
                continue
            other = at(oi, oj)
            tread = other != NOWHERE
            if past <= LEAST:
                up, down = price(HIGHER, beside), price(LOWER, beside)
                cost = jnp.where(other > level, up, jnp.where(tread & (other < level), down, 0.0))
                surcharge = jnp.maximum(surcharge, cost)
                if beside <= RAGGED[-1][0]:
                    near = level if along < 0 else there
                    odd = (
                        (tread & (other != near)) if abs(along) > LEAST else tread & (other != level) & (other != there)
                    )
                    ragged = ragged + odd * price(RAGGED, beside)
            else:
                square = (into[0] if along > 0 else into[1]) > level
                surcharge = jnp.maximum(surcharge, jnp.where((other > level) & ~square, price(HIGHER, beside), 0.0))
        scale = length * pitch / BASE_PITCH
        out.append(jnp.where(level_walk, surcharge * scale, jnp.where(over, ragged, 0.0)))
    return jnp.stack(out, axis=1)
