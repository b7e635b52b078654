"""Pictures of what was measured: which faces of blocks are seen, and that everything can be drawn."""

import numpy as np
import pytest
from PIL import Image

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.report import measured
from jaxbiped.report.measured import LOOK, block_faces, exposed_count, halved, save_classes, save_disparity, save_voxels


def test_one_block_shows_three_faces():
    block = np.zeros((3, 4, 5), bool)
    block[1, 2, 3] = True
    faces, heights, _ = block_faces(block, 0.05, 0.03, -1)
    assert len(faces) == 3 and heights == pytest.approx([0.06] * 3)
    centres = faces.mean(1)
    np.testing.assert_allclose(centres[0], [0.125, 0.075, 0.075])  # the upper one
    # Each turns towards the viewer: nearer than the middle of the block.
    assert ((centres - [0.125, 0.075, 0.06]) @ LOOK < 0).all()


def test_hidden_faces_are_left_out():
    blocks = np.ones((3, 4, 5), bool)
    assert exposed_count(blocks) == 3 * 4 + 3 * 5 + 4 * 5
    assert len(block_faces(blocks, 0.1, 0.1, 0)[0]) == exposed_count(blocks)
    assert exposed_count(np.zeros((2, 2, 2), bool)) == 0


def test_eight_blocks_become_one():
    blocks = np.random.default_rng(0).random((5, 7, 3)) < 0.1
    half = halved(blocks)
    assert half.shape == (3, 4, 2)
    for i, j, k in np.ndindex(half.shape):
        assert half[i, j, k] == blocks[2 * i : 2 * i + 2, 2 * j : 2 * j + 2, 2 * k : 2 * k + 2].any()


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3])
def test_any_grid_can_be_drawn(tmp_path, share, monkeypatch):
    monkeypatch.setattr(measured, "MOST_FACES", 500)
    blocks = np.random.default_rng(1).random((20, 30, 10)) < share
    save_voxels(tmp_path / "v.png", blocks, 0.05, 0.03, -1, title="blocks")
    with Image.open(tmp_path / "v.png") as image:
        assert min(image.size) > 500


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("colour", [True, False])
def test_any_disparity_can_be_drawn(tmp_path, share, colour):
    rng = np.random.default_rng(2)
    left = rng.integers(0, 255, (40, 60, 3) if colour else (40, 60)).astype(np.uint8)
    save_disparity(tmp_path / "d.png", left, rng.random((40, 60), np.float32), rng.random((40, 60)) < share)
    assert (tmp_path / "d.png").stat().st_size > 5000


@pytest.mark.parametrize("camera_xy", [None, (0.1, 0.1), (-5.0, 0.0)])
def test_maps_with_and_without_the_camera(tmp_path, camera_xy):
    grid = ClassGrid(np.ones((4, 6), np.int8), np.zeros((4, 6), np.int8), np.zeros(2), 0.05)
    save_classes(tmp_path / "m.png", grid, title="map", camera_xy=camera_xy)
    assert (tmp_path / "m.png").stat().st_size > 5000
