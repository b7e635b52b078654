"""The oracle's points against a plain loop over columns and levels."""

import jax
import numpy as np

from jaxbiped.sensing import measure_oracle
from tests.reference import sensing as reference
from tests.sensing.scenes import as_numpy, make, pose, random_scene, stack

SIZE, SPACING = (1.8, 1.4), 0.05
measure_all = jax.jit(jax.vmap(lambda a, p: measure_oracle(a, p, SIZE, spacing=SPACING)))


def measure(scenes):
    return as_numpy(measure_all(*(stack(part) for part in zip(*scenes, strict=True))))


def test_agrees_with_plain_loop():
    scenes = [random_scene(seed) for seed in range(4)] + [(make(), pose(yaw=np.nan))]
    views = measure(scenes)
    for k, (arena, where) in enumerate(scenes[:-1]):
        expected = reference.measure_oracle(arena, where, SIZE, spacing=SPACING)
        there = views.weight[k] > 0
        found = np.stack([axis[k][there] for axis in (views.x, views.y, views.z)], axis=1)
        wanted = np.stack([expected.x, expected.y, expected.z], axis=1)
        assert len(found) == len(wanted)
        assert np.allclose(np.sort(views.weight[k][there]), np.sort(expected.weight))
        order = lambda points: points[np.lexsort(np.round(points, 4).T)]  # noqa: E731
        assert np.allclose(np.sort(found, axis=0), np.sort(wanted, axis=0), atol=1e-5)
        assert np.median(np.abs(order(found) - order(wanted))) < 1e-5
    assert not views.weight[-1].any() and all(np.all(axis[-1] == 0) for axis in (views.x, views.y, views.z))


def test_a_bump_a_wall_and_a_lintel():
    arena = make(
        [(0.5, 0.7, 0, 0.1, 0.1, 0, 0.03), (1.0, 0.7, 0, 0.1, 0.1, 0, 0.6), (1.5, 0.7, 0, 0.1, 0.1, 0.37, 0.5)]
    )
    view = measure([(arena, pose(x=0.0, y=0.0))])
    there = view.weight[0] > 0
    x, y, z = (axis[0][there] for axis in (view.x, view.y, view.z))

    def column(at):
        here = (np.abs(x - at) < 0.01) & (np.abs(y - 0.725) < 0.01)
        return np.round(np.sort(z[here]).astype(float), 4).tolist()

    assert column(0.525) == [0, 0.03]
    assert column(1.025) == [*np.round(np.arange(15) * 0.03, 4), 0.6]
    assert column(1.525) == [0, 0.37, 0.39, 0.42]
    assert column(0.225) == [0]
