"""Missions that cannot go well end with a code that names what happened; by the cheapest fidelity that shows it."""

import numpy as np
import pytest

from jaxbiped.arenas import load_scene
from jaxbiped.errors import InputError
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from jaxbiped.reproduction.mishaps import BLOCK, DROPPED_AFTER, GOAL, MISHAPS, START, arena_of, suffer

CONFIG = MissionConfig()
NAMED = {mishap.name: mishap for mishap in MISHAPS}


@pytest.fixture(scope="module")
def endings():
    return {name: suffer(mishap, CONFIG, 0) for name, mishap in NAMED.items()}


def test_scene_without_a_solution_has_no_path(endings):
    assert endings["no_solution"].mission.code == Code.NO_PATH and endings["no_solution"].named


def test_landmarks_out_of_sight_throughout(endings):
    """It goes by odometry alone: it may arrive, or believe to have arrived; it ends long before its last decision."""
    ending = endings["no_landmark"]
    assert ending.named and len(ending.mission.played) < CONFIG.limits.max_decisions / 2
    belief = ending.mission.log.estimated_xyyaw[-1] - ending.mission.log.true_xyyaw[-1]
    assert 0.001 < np.hypot(*belief[:2]) < 0.15  # nothing corrected it


def test_arena_without_texture_ends_at_the_wall_that_it_cannot_see(endings):
    ending = endings["no_texture"]
    assert ending.mission.code == Code.COLLIDED and ending.named
    assert ending.mission.distance < 0.55  # the wall's face is 47 cm from the start


def test_obstacle_dropped_on_the_planned_path_is_gone_round(endings):
    ending = endings["dropped"]
    assert ending.mission.code == Code.REACHED and ending.named
    (x, y), (depth, width) = BLOCK["centre"], BLOCK["size"]

    def hits(way):
        return bool(np.any((abs(way[:, 0] - x) < depth / 2) & (abs(way[:, 1] - y) < width / 2)))

    log = ending.mission.log
    assert hits(log.plan[DROPPED_AFTER - 1]) and not hits(log.plan[DROPPED_AFTER + 1])
    assert not hits(log.true_xyyaw[:, :2])


def test_goal_inside_an_obstacle_has_no_path(endings, tmp_path):
    assert endings["goal_inside"].mission.code == Code.NO_PATH and endings["goal_inside"].named
    text = f'name = "x"\nstart = {list(START)}\ngoal = {list(GOAL)}\n'
    text += "boxes = [{ centre = [1.375, 0.70], size = [0.4, 0.4], top = 0.5 }]\n"
    (tmp_path / "x.toml").write_text(text)
    with pytest.raises(InputError, match="must not lie on an obstacle"):
        load_scene(tmp_path / "x.toml")  # a scene file is refused before anything is played


def test_only_what_is_dropped_is_not_there_at_first():
    for name, mishap in NAMED.items():
        before, after = (arena_of(mishap)(n).boxes.used.sum() for n in (0, DROPPED_AFTER))
        assert (before, after) == ((0, 1) if name == "dropped" else (1, 1))
