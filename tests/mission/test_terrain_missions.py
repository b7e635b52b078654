"""Missions over the terrain of configs/terrain/stairs.toml, by the command, and what is written of them."""

import json
from pathlib import Path

import numpy as np
import pytest

from jaxbiped import cli
from jaxbiped.arenas import load_scene
from jaxbiped.mission.recording import load_log
from sweeps.studies import make_terrain

SCENE = Path(__file__).parents[2] / "configs" / "terrain" / "stairs.toml"


def test_the_map_is_what_the_script_writes():
    """Within half a grey level, half a millimetre; smaller than 20 kB."""
    _, arena = load_scene(SCENE)
    np.testing.assert_allclose(arena.terrain.heights, make_terrain.stairs(), atol=make_terrain.GREY / 2 + 1e-6)
    assert make_terrain.FILE.stat().st_size < 20_000


@pytest.mark.parametrize("sensor", ["oracle", "raycast"])
def test_climbs_the_stairs(tmp_path, sensor):
    """Up three steps of 3 cm and on to the landing, past the rubble; the ground under the robot is the terrain's."""
    out = tmp_path / "out"
    assert cli.main(["run", str(SCENE), "--sensor", sensor, "--out", str(out)]) == 0
    facts = json.loads((out / "mission.json").read_text())
    assert facts["code"] == "reached"
    assert sum(played["name"] == "Step-up-bump" for played in facts["played"]) >= 3
    log, _ = load_log(out / "mission.npz")
    truth = make_terrain.stairs()
    np.testing.assert_allclose(log.terrain.heights, truth, atol=make_terrain.GREY / 2 + 1e-6)
    assert log.terrain.pitch == pytest.approx(0.01) and log.terrain.origin_xy.tolist() == [0, 0]
    x, y = log.true_xyyaw[:, :2].T
    # an edge may lie up to 2 cm off under the robot, whose ground is then that on its better side
    near = [
        truth[max(i - 2, 0) : i + 4, max(j - 2, 0) : j + 4] for i, j in np.floor(np.stack([y, x], 1) * 100).astype(int)
    ]
    assert all(patch.min() - 1e-3 <= z <= patch.max() + 1e-3 for patch, z in zip(near, log.true_z, strict=True))
    assert log.true_z[0] < 0.01 and log.true_z[-1] == pytest.approx(0.09, abs=0.01)
    assert {path.name for path in out.iterdir()} == {"map.png", "mission.gif", "mission.json", "mission.npz"}
