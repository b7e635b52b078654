"""Ground and ceiling heights against a plain loop over boxes and points."""

from math import cos, inf, nan, sin

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.boxes import Boxes, ceiling_height, ground_height

FIELDS = ("x", "y", "yaw", "half_x", "half_y", "bottom", "top", "overhead", "contrast", "used")


def boxes_of(rows):
    """`Boxes` from rows of (x, y, yaw, half_x, half_y, bottom, top, overhead, used)."""
    columns = dict(zip([f for f in FIELDS if f != "contrast"], zip(*rows, strict=True), strict=True))
    flags = {"overhead", "used"}
    leaves = {k: jnp.array(v, bool if k in flags else jnp.float32) for k, v in columns.items()}
    return Boxes(contrast=jnp.ones(len(rows)), **leaves)


def reference(rows, px, py):
    ground, ceiling = 0.0, inf
    for x, y, yaw, hx, hy, bottom, top, overhead, used in rows:
        u = cos(yaw) * (px - x) + sin(yaw) * (py - y)
        v = -sin(yaw) * (px - x) + cos(yaw) * (py - y)
        if not used or abs(u) > hx or abs(v) > hy:
            continue
        if overhead:
            ceiling = min(ceiling, bottom)
        else:
            ground = max(ground, top)
    return ground, ceiling


def test_heights_equal_the_plain_loop():
    rng = np.random.default_rng(0)
    rows = [
        (*rng.uniform(0, 2, 2), rng.uniform(-7, 7), *rng.uniform(0.05, 0.5, 2), *sorted(rng.uniform(0, 0.5, 2)), o, u)
        for o, u in rng.random((12, 2)) < (0.4, 0.8)
    ]
    x, y = rng.uniform(-0.5, 2.5, (2, 20, 30)).astype(np.float32)
    expected = np.array([reference(rows, *p) for p in zip(x.ravel(), y.ravel(), strict=True)]).reshape(20, 30, 2)
    ground = np.asarray(ground_height(boxes_of(rows), jnp.asarray(x), jnp.asarray(y)))
    ceiling = np.asarray(ceiling_height(boxes_of(rows), jnp.asarray(x), jnp.asarray(y)))
    # Random points lie further from the faces than float32 rounds; heights are copied, not computed.
    np.testing.assert_allclose(ground, expected[..., 0], atol=1e-7)
    np.testing.assert_allclose(ceiling, expected[..., 1], atol=1e-7)
    assert 0 < (ground > 0).mean() < 1 and 0 < np.isfinite(ceiling).mean() < 1


def test_edges_belong_to_the_box_and_stacks_take_the_extreme():
    rows = [
        (1, 1, 0, 0.5, 0.5, 0, 0.03, 0, 1),
        (1, 1, 0, 0.25, 0.5, 0, 0.06, 0, 1),
        (1, 1, 0, 0.5, 0.25, 0.37, 1, 1, 1),
    ]
    x, y = jnp.array([0.5, 0.49, 0.75, 1.0]), jnp.array([1.0, 1.0, 1.5, 1.3])
    np.testing.assert_allclose(ground_height(boxes_of(rows), x, y), [0.03, 0, 0.06, 0.06], atol=1e-7)
    np.testing.assert_allclose(ceiling_height(boxes_of(rows), x, y), [0.37, inf, inf, inf], atol=1e-6)


@pytest.mark.parametrize("rubbish", [nan, inf, -1.0])
def test_unused_slots_may_hold_anything(rubbish):
    boxes = boxes_of([(*[rubbish] * 7, o, 0) for o in (0, 1)])
    points = jnp.linspace(-1, 1, 5)
    assert (ground_height(boxes, points, points) == 0).all() and jnp.isinf(ceiling_height(boxes, points, points)).all()
