"""The public functions of arenas refuse what they cannot use, and are right about the rest."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped import arenas
from jaxbiped.arenas import Arena, Movers, PopulationConfig
from tests import fuzzing
from tests.fuzzing import mapped, same, spoiled
from tests.sensing.scenes import SLOTS, as_jax, make

KEY = jax.random.key(0)
WAY = Movers(*(jnp.full(SLOTS, value) for value in (0.2, 0.1, 0.02, 0.5)))
ARENA = replace(as_jax(make([(0.8, 0.7, 0.0, 0.05, 0.05, 0.0, 0.3)])), movers=WAY)


def test_bad_arguments_are_refused_and_odd_ones_are_right():
    fuzzing.run(__name__)


def cases():
    population = PopulationConfig().traced()
    drawn = {"index": jnp.int32(3), "families": ("bump",), "population": population}
    optional = ("movers", "population")
    tried = {
        **spoiled("at_time", arenas.at_time, {"arena": ARENA, "time": jnp.float32(1)}, optional),
        **spoiled("only", arenas.only, {"arena": ARENA, "moving": True}, optional),
        **spoiled("sample", lambda **given: arenas.sample(KEY, **given), drawn, optional),
        **spoiled("to_arena", arenas.to_arena, {"scene": "x"}),
        **spoiled("load_scene", arenas.load_scene, {"path": "nowhere.toml"}),
    }

    def refused(function, **given):
        tried[f"{len(tried)}: {function.__name__}({str(given)[:100]})"] = lambda: function(**given)

    for key in (0, None, "x", jax.random.split(KEY, 2), jnp.zeros(2), jnp.zeros(3, jnp.uint32), KEY[None]):
        refused(arenas.sample, key=key, index=0)
    for index in (-1, 2**31, 2**70, 1.0, "0", [0], True):
        refused(arenas.sample, key=KEY, index=index)
    for families in ((), "bump", ("bump", "door"), (3,), None, 3, ("bump", None), np.array(["bump"])):
        refused(arenas.sample, key=KEY, index=0, families=families)
    for time in (np.nan, np.inf, -np.inf):
        refused(arenas.at_time, arena=ARENA, time=time)
    for path in ("", "/", "nowhere.toml", __file__):
        refused(arenas.load_scene, path=path)
    return tried | {
        "keys and indices of all types are the same arena": same_arena,
        "what stands stays the same arena": standing,
        "vmap and scan of sample, at_time, only": in_batches,
    }


@jax.jit
def draw(key, index, population=None):
    return arenas.sample(key, index, ("traffic",), population)


def same_arena():
    one = draw(KEY, jnp.int32(3))
    drawn = PopulationConfig().traced()
    others = [draw(KEY, index) for index in (3, np.int64(3), np.uint8(3))]
    return same(one, *others, draw(jax.random.key_data(KEY), 3), draw(KEY, jnp.int32(3), drawn))


def standing():
    still = replace(ARENA, movers=None)
    return arenas.at_time(still, 3.0) is still and arenas.only(still, moving=False) is still


def in_batches():
    def go(index, time) -> tuple[Arena, Arena]:
        arena = arenas.sample(KEY, index, ["traffic"])
        return arenas.at_time(arena, time), arenas.only(arena, moving=True)

    return mapped(go, jnp.arange(2), jnp.array([0.0, 9.0]))
