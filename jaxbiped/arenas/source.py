"""Arenas of a study: built-in families, users' generators, and scenes, taking turns."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, PRNGKeyArray

from jaxbiped.arenas.arena import Arena, Landmarks
from jaxbiped.arenas.families import KNOWN, SIZE_X, SIZE_Y, sample
from jaxbiped.arenas.ground import refuse_terrain
from jaxbiped.arenas.population import Population
from jaxbiped.arenas.scene import load_scene
from jaxbiped.core.code_hash import component_hash
from jaxbiped.core.registry import FAMILIES
from jaxbiped.errors import InputError
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.height_field import HeightField

Generator = Callable[[PRNGKeyArray], Arena]
NAME = re.compile(r"[A-Za-z0-9][\w .+-]{0,39}")  # shown in tables, figures and pages
OWN = 2  # fold_in of an arena's key, for users' generators


@dataclass(frozen=True)
class Family:
    """A user's arenas of one kind: a pure function of a random key.

    Args:
      name: name of the stratum in rows, tables and figures.
      generator: returns one arena, in JAX; all of one size, always with as many boxes and landmarks (unused ones have
        `used` False). Arena k of a study is `generator(fold_in(fold_in(key(seed), k), 2))`.
    """

    name: str
    generator: Generator = field(repr=False, metadata={"static": True})

    def __post_init__(self):
        check_name(self.name)
        try:
            hash(self.generator)
        except TypeError:
            raise InputError("its generator cannot be hashed", field=f"family {self.name}") from None

    def arena(self, key: PRNGKeyArray) -> Arena:
        """One arena, checked.

        Raises:
          InputError: the generator did not return an arena, or not a single one.
        """
        made = self.generator(key)
        where = f"family {self.name}"
        if not isinstance(made, Arena):
            raise InputError(f"its generator must return an Arena, not {type(made).__name__}", field=where)
        refuse_terrain(made, f"a study, by {where}")
        if made.movers is not None:
            raise InputError("its generator returned boxes that move, which only the family traffic has", field=where)
        shapes = {"size_xy": (2,), "start_xyyaw": (3,), "goal_xy": (2,), "floor_contrast": (), "difficulty": ()}
        for name, shape in shapes.items():
            found = np.shape(getattr(made, name))
            if found != shape:
                raise InputError(f"its generator returned {list(found)} where {list(shape)} is required",
                                 field=f"{where}: {name}")  # fmt: skip
        for name, part in (("boxes", made.boxes), ("landmarks", made.landmarks)):
            sizes = {np.shape(leaf) for leaf in jax.tree.leaves(part)}
            if len(sizes) != 1 or len(next(iter(sizes))) != 1:
                message = f"its generator returned fields of the shapes {sorted(map(list, sizes))}, not one row each"
                raise InputError(message, field=f"{where}: {name}")
        return made

    def digest(self) -> str:
        """Digest of its code."""
        return component_hash(self)


@dataclass(frozen=True)
class SceneFamily:
    """A scene file as a family: the same arena each time, with other noise."""

    name: str
    path: Path
    text: str  # digest of the file
    scene: Arena = field(repr=False, compare=False)

    def arena(self, key: PRNGKeyArray) -> Arena:
        """The scene."""
        return jax.tree.map(jnp.asarray, self.scene)

    def digest(self) -> str:
        """Digest of its file."""
        return self.text


OwnFamily = Family | SceneFamily


def check_name(name: object, file: Path | None = None) -> None:
    """Raise `InputError` about a name that cannot be displayed everywhere, or that belongs to a built-in family."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        message = "must begin with a letter or digit and have at most 40 letters, digits, blanks and . _ + -"
        raise InputError(message, file=file, field="name of a family", value=name)
    if name in KNOWN:
        raise InputError("is the name of a built-in family", file=file, field="name of a family", value=name)


def scene_name(path: Path) -> str:
    """The family name of a scene file: the file's name, made distinct from built-in families."""
    return f"scene {path.stem}" if path.stem in KNOWN else path.stem


def scene_family(path: str | Path) -> SceneFamily:
    """A scene file as a family with the file's name (`scene_name`).

    Raises:
      InputError: any error in the file.
    """
    check_name(scene_name(Path(path)), Path(path))
    load_scene(path)
    text = hashlib.sha256(Path(path).read_bytes()).hexdigest()[:12]
    return _scene_family(Path(path), text)


@cache
def _scene_family(path: Path, text: str) -> SceneFamily:
    return SceneFamily(scene_name(path), path, text, jax.device_get(load_scene(path)[1]))


def find_family(name: str) -> str | OwnFamily:
    """The family of a name: the name itself if it is built in, else a scene file, a registered or an imported family.

    Raises:
      InputError: an unknown name, with the known ones; a file or module that cannot be used.
    """
    if name in KNOWN:
        return name
    if name.endswith(".toml"):
        return scene_family(name)
    return FAMILIES.find(name, as_family)


def as_family(thing: object, name: str) -> Family:
    """A family of a generator."""
    if isinstance(thing, Family):
        return thing
    if not callable(thing):
        raise InputError("must be a function of a random key", field="families", value=name)
    return Family(name, thing)


def name_of(family: str | OwnFamily) -> str:
    """The name of the stratum."""
    return family if isinstance(family, str) else family.name


def size_of(family: str | OwnFamily) -> tuple[float, float]:
    """[m] The common size of all arenas of a family."""
    if isinstance(family, str):
        return SIZE_X, SIZE_Y
    x, y = (round(float(side), 6) for side in np.asarray(_one(family).size_xy))
    return x, y


def terrain_of(family: str | OwnFamily) -> HeightField | None:
    """The terrain of a scene; no other family has any."""
    return family.scene.terrain if isinstance(family, SceneFamily) else None


@cache
def _one(family: OwnFamily) -> Arena:
    """An arbitrary arena of a family."""
    return jax.device_get(jax.jit(family.arena)(jax.random.key(0)))


def draw_arena(
    key: PRNGKeyArray,
    index: Int[Array, ""],
    families: tuple[str | OwnFamily, ...],
    population: Population | None = None,
    turn: Int[Array, ""] | None = None,
) -> Arena:
    """Arena `index` of a study whose families take turns.

    Consumes `fold_in(key, index)`.

    Args:
      families: static.
      population: measures that are fixed for built-in families.
      turn: index of its family; by default `index` modulo their number.
    """
    own = [item for item in families if not isinstance(item, str)]
    if not own:
        return sample(key, index, families, population, turn)
    turn = index % len(families) if turn is None else turn
    built_in = tuple(item for item in families if isinstance(item, str))
    each = [item.arena(jax.random.fold_in(jax.random.fold_in(key, index), OWN)) for item in own]
    places = [k for k, item in enumerate(families) if not isinstance(item, str)]
    if built_in:
        each.append(sample(key, index, built_in, population, turn=_turn(turn, families)))
        places.append(-1)
    each = [replace(arena, family=jnp.int32(-1), movers=None) for arena in each]
    each = padded(each)
    chosen = jnp.select([turn == place for place in places], list(range(len(each))), len(each) - 1)
    return jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(v, leaves[0].dtype) for v in leaves])[chosen], *each)


def _turn(turn: Int[Array, ""], families: tuple[str | OwnFamily, ...]) -> Int[Array, ""]:
    """The position, among the built-in families, of the family whose turn it is."""
    before = np.cumsum([isinstance(item, str) for item in families]) - 1
    return jnp.asarray(np.maximum(before, 0))[turn]


def padded(arenas: Sequence[Arena]) -> list[Arena]:
    """Arenas padded to equally many slots for boxes and landmarks, with the types of the first."""
    boxes = max(arena.boxes.x.shape[0] for arena in arenas)
    marks = max(arena.landmarks.x.shape[0] for arena in arenas)

    def fill(tree: Boxes | Landmarks, size: int):
        return jax.tree.map(lambda leaf: jnp.pad(jnp.asarray(leaf), (0, size - leaf.shape[0])), tree)

    return [replace(a, boxes=fill(a.boxes, boxes), landmarks=fill(a.landmarks, marks)) for a in arenas]
