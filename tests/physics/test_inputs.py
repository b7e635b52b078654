"""Bad input: one line that says what is allowed, before anything is stepped."""

import mujoco
import numpy as np
import pytest

from jaxbiped import physics
from jaxbiped.errors import InputError
from tests.physics.models import BATCH, HOPPER, PENDULUM, WATCH

CONTROLS = np.zeros((BATCH, 10, 1))


def spoiled(array, index, value):
    array = np.array(array, float)
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("model", "options", "words"),
    [
        ("<mujoco><worldbody", {}, "does not parse"),
        ("<mujoco><worldbody><geom typ='box'/></worldbody></mujoco>", {}, "unrecognized attribute: 'typ'"),
        ("<mujoco><worldbody><body><freejoint/></body></worldbody></mujoco>", {}, "not a valid model"),
        ("nowhere.xml", {}, "nowhere.xml: no such file"),
        (3, {}, "must be MJCF"),
        (PENDULUM, {"free_joint": True}, "joint: the model must have a free joint"),
        (HOPPER, {"watch": {"head": [("head", "lintel")]}}, "watch.head: must be pairs of .*beam.*got 'lintel'"),
        (mujoco.MjModel.from_xml_string(PENDULUM), {"watch": WATCH}, "watch: sensors can be added to MJCF"),
        (PENDULUM, {"fields": ("geom_poss",)}, "geom_poss: must be the name of a field"),
        (PENDULUM, {"fields": ("geom_type",)}, "geom_type: is the same in all"),
        (PENDULUM, {"fields": ("opt.timestep",)}, "opt.timestep: is the same in all"),
        (PENDULUM, {"thread": 3}, "thread: unknown option; known ones are .*threads"),
        (PENDULUM, {"threads": -1}, "threads: .*greater than or equal to 0"),
        (PENDULUM, {"impl": "jax"}, "impl: unknown option"),
    ],
)
def test_make_native(model, options, words):
    with pytest.raises(InputError, match=words) as error:
        physics.make("native", model, BATCH, **options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["warp", ""])
def test_make_names_its_backends(name):
    with pytest.raises(InputError, match="backend: must be one of native, mjx, auto"):
        physics.make(name, PENDULUM, BATCH)


@pytest.mark.parametrize("size", [0, -1, True])
def test_batch_size(size):
    with pytest.raises(InputError, match="batch_size: must be a whole number"):
        physics.make("native", PENDULUM, size)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"controls": np.zeros((BATCH, 10, 2))}, r"controls: must have shape \[B, T, nu\] = \[4, any, 1\]"),
        ({"controls": np.zeros((BATCH + 1, 10, 1))}, "controls: must have shape"),
        ({"controls": np.zeros((10, 1))}, "controls: must have shape"),
        ({"controls": np.zeros((BATCH, 0, 1))}, "controls: must hold at least one"),
        ({"controls": "x"}, "controls: must be numbers"),
        ({"controls": [[1], [2, 3]]}, "controls: must be numbers"),
        ({"controls": spoiled(CONTROLS, (2, 5, 0), np.nan)}, r"controls: must be finite; at .* = \[2, 5, 0\]"),
        ({"controls": spoiled(CONTROLS, (0, 0, 0), np.inf)}, "controls: must be finite"),
        ({"qpos": np.zeros((BATCH, 3))}, r"qpos: must have shape \[B, nq\]"),
        ({"qpos": np.full((BATCH, 8), np.nan)}, "qpos: must be finite"),
        ({"qvel": np.zeros(7)}, r"qvel: must have shape \[B, nv\]"),
        ({"fields": {"geom_pos": np.zeros((BATCH, 3))}}, "fields.geom_pos: must have shape"),
        ({"fields": {"nonsense": np.zeros(BATCH)}}, "nonsense: must be the name of a field"),
        ({"fields": {"geom_contype": np.zeros((BATCH, 9))}}, "geom_contype: is the same in all"),
        ({"record_every": 3}, "record_every: must divide the 10 steps"),
        ({"record_every": 0}, "record_every: must be a whole number"),
        ({"hold": 0}, "hold: must be a whole number"),
    ],
)
def test_rollout(backend, arguments, words):
    with pytest.raises(InputError, match=words):
        backend.rollout(**{"controls": CONTROLS} | arguments)


def test_living_batches(backend):
    for call, words in (
        (lambda: backend.advance(spoiled(CONTROLS, (3, 0, 0), np.nan)), "controls: must be finite"),
        (lambda: backend.advance(np.zeros((BATCH, 1, 2))), "controls: must have shape"),
        (lambda: backend.reset(np.ones(BATCH)), "mask: must be"),
        (lambda: backend.reset(np.ones(3, bool)), "mask: must be"),
        (lambda: backend.set_fields({"geom_pos": np.zeros((BATCH, 9))}), "fields.geom_pos: must have shape"),
        (lambda: backend.set_fields({"body_mass": np.full((BATCH, 3), np.nan)}), "fields.body_mass: must be finite"),
    ):
        with pytest.raises(InputError, match=words):
            call()


def test_files_and_specs_are_models_too(tmp_path):
    file = tmp_path / "pendulum.xml"
    file.write_text(PENDULUM)
    spec = mujoco.MjSpec.from_string(PENDULUM)
    results = [
        physics.make("native", model, 2).rollout(np.full((2, 20, 1), 0.2)).qpos
        for model in (PENDULUM, file, str(file), spec, mujoco.MjModel.from_xml_string(PENDULUM))
    ]
    for result in results[1:]:
        np.testing.assert_array_equal(result, results[0])


def test_a_watched_spec_is_left_as_it_is():
    spec = mujoco.MjSpec.from_string(HOPPER)
    sensors = len(spec.sensors)
    made = physics.make("native", spec, 2, watch=WATCH)
    assert len(spec.sensors) == sensors and made.watches == ("step", "overhead")


def test_a_file_that_does_not_parse_is_named(tmp_path):
    file = tmp_path / "broken.xml"
    file.write_text("<mujoco><worldbody><geom size='x'/></worldbody></mujoco>")
    with pytest.raises(InputError, match=r"broken\.xml: the MJCF does not parse: .*size"):
        physics.make("native", file, 1)
