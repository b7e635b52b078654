"""Ground of any height on the way: the robot steps on what it can, goes round the rest, or finds no way."""

import jax
import numpy as np
import pytest

from jaxbiped.arenas.scene import SceneConfig, to_arena
from jaxbiped.mission.oracle import oracle_plan
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from tests.mission.conftest import ARENAS, CONFIG, POINTS, SPEC, pad, play

MARKS = tuple(
    {"kind": "circle", "at": at} for at in ((0.55, 0.12), (0.55, 1.28), (1.05, 0.12), (1.05, 1.28), (1.7, 0.35))
)
WHOLE, HALF = 1.4, 0.8  # [m] of a bar that leaves no way round it, and of one that does
HONEST, FALSE = (0.022, 0.025, 0.03, 0.031), (0.013, 0.016, 0.035, 0.04, 0.044, 0.05)
SEEDS = 2


def arena(top, length, width=0.2):
    box = {"centre": (0.86, length / 2), "size": (width, length), "top": top}
    scene = SceneConfig(name="bar", start=(0.3, 0.7, 0.0), goal=(1.4, 0.7), boxes=[box], landmarks=MARKS)
    return jax.device_get(to_arena(scene))


@pytest.fixture(scope="module")
def ended():
    """Height and length of a bar to the codes of its missions."""
    cases = [(top, WHOLE) for top in (*HONEST, *FALSE)] + [(top, HALF) for top in FALSE]
    arenas = [arena(*case) for case in cases]
    setting = jax.device_get(CONFIG.params("full"))
    codes = play(
        [each for each in arenas for _ in range(SEEDS)],
        [setting] * (SEEDS * len(cases)),
        [100 + k for k in range(SEEDS * len(cases))],
    ).code
    return {case: [Code(int(c)) for c in codes[SEEDS * k : SEEDS * (k + 1)]] for k, case in enumerate(cases)}


def test_what_is_a_step_high_is_stepped_over(ended):
    assert {top: ended[top, WHOLE] for top in HONEST} == {top: [Code.REACHED] * SEEDS for top in HONEST}


def test_what_is_no_step_is_never_stepped_on(ended):
    """A bar of 4 cm was rounded to a level of 3 cm: 97 of 100 such missions ended in a collision."""
    assert {top: ended[top, WHOLE] for top in FALSE} == {top: [Code.NO_PATH] * SEEDS for top in FALSE}


def test_what_is_no_step_is_walked_round(ended):
    assert {top: ended[top, HALF] for top in FALSE} == {top: [Code.REACHED] * SEEDS for top in FALSE}


def test_perfect_knowledge_goes_by_the_same_rule():
    arenas = pad([arena(top, WHOLE) for top in (*HONEST, *FALSE)], ARENAS)
    setting = pad([jax.device_get(CONFIG.params("full"))], POINTS)
    reachable = np.asarray(oracle_plan(arenas, setting, SPEC).reachable)[0, : len(HONEST) + len(FALSE)]
    assert reachable.tolist() == [True] * len(HONEST) + [False] * len(FALSE)


def test_the_tolerance_of_the_map_is_that_of_the_executor():
    strict = MissionConfig(limits={"height_tolerance": 0.004})
    assert strict.robot.height_tolerance == 0.004
    assert strict.params("full").body.height_tolerance == pytest.approx(0.004)
    own = MissionConfig(limits={"height_tolerance": 0.004}, robot={"height_tolerance": 0.006})
    assert own.robot.height_tolerance == 0.006 and own.limits.height_tolerance == 0.004
    assert MissionConfig().robot.height_tolerance == MissionConfig().limits.height_tolerance
