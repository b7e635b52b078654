"""Scenes written by hand: the paper's six load, and whatever is wrong with a file is said in one line."""

from pathlib import Path

import jax
import numpy as np
import pytest

from jaxbiped.arenas import FAMILIES, SceneConfig, load_scene, sample, scene_warnings, to_arena
from jaxbiped.errors import InputError
from jaxbiped.motion.config import RobotConfig

FOLDER = Path(__file__).parents[2] / "configs" / "scenes"
GOOD = """
name = "a scene"
size = [1.8, 1.4]
start = [0.4, 0.7, 0.1]
goal = [1.4, 0.7]
boxes = [
    { centre = [0.9, 0.7], size = [0.2, 0.4], yaw = 0.3, top = 0.2 },
    { centre = [0.9, 0.2], size = [0.1, 0.3], bottom = 0.37, top = 0.5, contrast = 0.4 },
]
landmarks = [ { kind = "square", at = [0.5, 0.1], yaw = 0.2 } ]
"""


def load(tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_scene(path)


@pytest.mark.parametrize("number", range(1, 7))
def test_experiments_load(number):
    name, arena = load_scene(FOLDER / f"experiment_{number}.toml")
    assert name == f"experiment_{number}"
    np.testing.assert_allclose(arena.size_xy, [1.8, 1.4], rtol=1e-6)
    assert arena.boxes.used.any() and arena.landmarks.used.sum() == 6


def test_experiments_4_and_5_are_one_arena():
    four, five = (load_scene(FOLDER / f"experiment_{number}.toml")[1] for number in (4, 5))
    for one, other in zip(jax.tree.leaves(four), jax.tree.leaves(five), strict=True):
        np.testing.assert_array_equal(one, other)


def test_straight_distances_are_the_papers():
    """Table 4: 100 cm in experiment 3, 104 cm in experiment 6."""
    for number, metres in ((3, 1.00), (6, 1.04)):
        _, arena = load_scene(FOLDER / f"experiment_{number}.toml")
        assert np.hypot(*(arena.goal_xy - arena.start_xyyaw[:2])) == pytest.approx(metres, abs=1e-6)


def test_good_scene_is_what_it_says(tmp_path):
    name, arena = load(tmp_path, GOOD)
    boxes = arena.boxes
    assert name == "a scene" and arena.family == -1
    assert boxes.used.tolist() == [True] * 2 + [False] * 10
    np.testing.assert_allclose(boxes.x[:2], 0.9)
    np.testing.assert_allclose(boxes.half_x[:2], [0.1, 0.05])
    np.testing.assert_allclose(boxes.half_y[:2], [0.2, 0.15], rtol=1e-6)
    np.testing.assert_allclose(boxes.yaw[:2], [0.3, 0.0])
    np.testing.assert_allclose(boxes.contrast[:2], [1.0, 0.4])
    assert boxes.overhead[:2].tolist() == [False, True]
    assert arena.landmarks.used.tolist() == [True] + [False] * 5 and arena.landmarks.kind[0] == 1


def test_scenes_and_random_arenas_share_programs():
    scene = to_arena(SceneConfig(name="a", start=(0.4, 0.7, 0), goal=(1.4, 0.7)))
    drawn = jax.eval_shape(lambda: sample(jax.random.key(0), 0))
    for one, other in zip(jax.tree.leaves(scene), jax.tree.leaves(drawn), strict=True):
        assert (one.shape, one.dtype) == (other.shape, other.dtype)


def test_many_boxes_fit():
    box = {"centre": (0.9, 0.7), "size": (0.01, 0.01), "top": 0.03}
    arena = to_arena(SceneConfig(name="a", start=(0.4, 0.7, 0), goal=(1.4, 0.7), boxes=[box] * 40))
    assert arena.boxes.used.sum() == 40


BAD = {  # what: (replace, by, field, value as printed, words that say what is allowed)
    "unknown key": ('name = "a scene"', 'name = "a scene"\ncolour = 3', "colour", "3", "unknown key"),
    "unknown key of a box": ("top = 0.2 }", "top = 0.2, hue = 1 }", "boxes.0.hue", "1", "unknown key"),
    "missing key": ("goal = [1.4, 0.7]", "", "goal", None, "required"),
    "wrong type": ('name = "a scene"', "name = 4", "name", "4", "string"),
    "text for a number": ("top = 0.2 ", 'top = "high" ', "boxes.0.top", "'high'", "number"),
    "too few numbers": ("goal = [1.4, 0.7]", "goal = [1.4]", "goal.1", None, "required"),
    "out of range": ("contrast = 0.4", "contrast = 1.4", "boxes.1.contrast", "1.4", "less than or equal to 1"),
    "negative size": ("size = [0.2, 0.4]", "size = [-0.2, 0.4]", "boxes.0.size.0", "-0.2", "greater than 0"),
    "top below bottom": ("top = 0.5,", "top = 0.3,", "boxes.1", "0.3", "above bottom (0.37 m)"),
    "NaN": ("start = [0.4, 0.7, 0.1]", "start = [0.4, nan, 0.1]", "start.1", "nan", ""),
    "infinity": ("size = [1.8, 1.4]", "size = [inf, 1.4]", "size.0", "inf", ""),
    "start outside": ("start = [0.4, 0.7, 0.1]", "start = [1.9, 0.7, 0.1]", "start", "[1.9, 0.7]", "1.8 x 1.4 m"),
    "goal outside": ("goal = [1.4, 0.7]", "goal = [1.4, -0.1]", "goal", "[1.4, -0.1]", "1.8 x 1.4 m"),
    "start under a low box": (
        "boxes = [",
        "boxes = [\n{ centre = [0.3, 0.7], size = [0.2, 0.2], bottom = 0.05, top = 0.5 },",
        "start",
        "[0.4, 0.7]",
        "0.08 m away from boxes.0",
    ),
    "goal in an obstacle": (
        "goal = [1.4, 0.7]",
        "goal = [0.9, 0.75]",
        "goal",
        "[0.9, 0.75]",
        "must not lie on an obstacle",
    ),
    "start by an obstacle": ("start = [0.4, 0.7", "start = [0.75, 0.65", "start", "[0.75, 0.65]", "boxes.0"),
    "box outside": ("centre = [0.9, 0.7]", "centre = [1.75, 0.7]", "boxes.0", "[1.75, 0.7]", "1.8 x 1.4 m"),
    "landmark outside": ("at = [0.5, 0.1]", "at = [0.5, -0.1]", "landmarks.0.at", "[0.5, -0.1]", "inside the area"),
    "unknown landmark": ('kind = "square"', 'kind = "star"', "landmarks.0.kind", "'star'", "'circle' or 'square'"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_scene_says_file_field_value_and_what_is_allowed(tmp_path, what):
    old, new, field, value, allowed = BAD[what]
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        load(tmp_path, GOOD.replace(old, new, 1))
    text = str(caught.value)
    assert "\n" not in text
    assert str(tmp_path / "scene.toml") in text
    assert f" {field}: " in text, text
    assert value is None or value in text, text
    assert allowed in text, text


BROKEN = (
    (GOOD[:150], "not valid TOML"),
    ("name = ", "not valid TOML"),
    (b"\x89PNG\r\n\x1a\n\x00\xff", "cannot be read as text"),
    (b"", "required"),
)


@pytest.mark.parametrize(("content", "words"), BROKEN)
def test_no_toml_and_files_cut_short(tmp_path, content, words):
    with pytest.raises(InputError, match=words) as caught:
        load(tmp_path, content)
    assert "scene.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(InputError) as caught:
            load_scene(path)
        assert str(path) in str(caught.value)


def warned(*boxes, start=(0.4, 0.7, 0.0), **robot):
    scene = SceneConfig(name="a", start=start, goal=(1.4, 0.7), boxes=boxes)
    return scene_warnings(to_arena(scene), RobotConfig(**robot), level_height=0.03)


def box(top, x=0.9, size=(0.2, 0.2), **fields):
    return {"centre": (x, 0.7), "size": size, "top": top} | fields


@pytest.mark.parametrize("top", [0.033, 0.04, 0.044])
def test_a_box_between_a_step_and_an_obstacle_is_warned_of(top):
    (text,) = warned(box(0.5), box(top))
    assert text == (
        f"boxes.1.top: is {top:g} m high, more than this robot's step of 0.03 m and less than the 0.045 m from which "
        f"it is an obstacle by its level (got {top:g})"
    )


def test_steps_obstacles_and_what_hangs_are_not_warned_of():
    assert warned(box(0.02), box(0.03), box(0.032), box(0.045), box(0.5), box(0.41, bottom=0.37)) == ()
    assert warned(box(0.03, size=(0.6, 0.6)), box(0.06)) == ()  # stairs
    assert warned(box(0.04), step=0.04) == () and warned(box(0.044), step=0.04) != ()
    (text,) = warned(box(0.03, size=(0.6, 0.6)), box(0.07))  # a stair of 4 cm
    assert text.startswith("boxes.1.top: is 0.04 m high, more than") and text.endswith("(got 0.07)")


def test_a_start_in_an_obstacle_of_this_robot_is_warned_of():
    """The box is 0.1 m off: none to the robot of the paper, which `load_scene` goes by."""
    block = box(0.3, x=0.6)
    assert warned(block) == ()
    (text,) = warned(block, body_radius=0.12, radius=0.12)
    assert text == "start: this robot, 0.12 m in radius, starts in boxes.0 (at [0.4, 0.7])"
    low = box(0.5, x=0.4, bottom=0.4)
    assert warned(low) == () and warned(low, standing=0.45)[0].startswith("start: this robot")
    assert warned(box(0.03, x=0.55), step=0.02)[0].startswith("start: this robot")


def test_the_papers_scenes_are_not_warned_of():
    for path in sorted(FOLDER.glob("*.toml")):
        assert scene_warnings(load_scene(path)[1], RobotConfig(), level_height=0.03) == (), path.name


def test_families_are_named():
    assert len(set(FAMILIES)) == 6
