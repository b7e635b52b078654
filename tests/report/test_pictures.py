"""Pictures and films: the paper's colours in the right cells, and files that are whole or not there."""

import errno
import itertools
import os
import time
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from jaxbiped.core.class_grid import ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import Ground, Mark, MissionLog, Outline, Picture
from jaxbiped.report import animation, pictures


def rgb(colour):
    return tuple(round(channel * 255) for channel in to_rgb(colour))


def mission(moments=5, rows=7, columns=9):
    """A walk along x over a map that is seen column by column."""
    full = np.tile(np.array([1, 1, 1, 2, 2, 3, 4, 1, 1], np.int8)[:columns], (rows, 1))
    up = np.tile(np.array([0, 0, 0, 1, 2, 0, 0, 0, 0], np.int8)[:columns], (rows, 1))
    seen = [np.arange(columns) < columns * (t + 1) / moments for t in range(moments)]
    x = np.linspace(0.1, 0.35, moments)
    xyyaw = np.stack([x, np.full(moments, 0.2), np.linspace(0, 1, moments)], 1)
    plans = [np.stack([np.linspace(a, 0.4, 4), np.full(4, 0.2)], 1) for a in x[:-1]] + [np.zeros((0, 2))]
    corners = np.array([[0.15, 0.0], [0.25, 0.0], [0.25, 0.35], [0.15, 0.35]])
    return MissionLog(
        classes=np.stack([np.where(s, full, 0) for s in seen]).astype(np.int8),
        levels=np.stack([np.where(s, up, 0) for s in seen]).astype(np.int8),
        true_xyyaw=xyyaw,
        estimated_xyyaw=xyyaw + 0.01,
        plan=tuple(plans),
        time=np.arange(moments) * 26.0,
        action=("Start",) + ("Straight-forward",) * (moments - 1),
        pitch=0.05,
        origin_xy=np.zeros(2),
        size_xy=np.array([columns, rows]) * 0.05,
        goal_xy=np.array([0.4, 0.2]),
        outlines=(Outline(corners, "bump"), Outline(corners + 0.1, "gate"), Outline(corners + 0.2, "obstacle")),
        landmarks=(Mark((0.1, 0.3), 0.0, "circle"), Mark((0.1, 0.1), 0.5, "square")),
        outcome="reached",
    )


def test_each_class_has_the_colour_of_the_paper():
    classes = np.array([[0, 1, 2, 2, 2, 2, 3, 4]], np.int8)
    levels = np.array([[0, 0, 1, 2, 9, -2, 0, 0]], np.int8)
    image = pictures.class_image(classes, levels)
    shades = [rgb(shade) for shade in pictures.BUMP_SHADES]
    expected = [pictures.COLOURS[Cell.UNMEASURED], pictures.COLOURS[Cell.FLOOR]]
    expected = [rgb(c) for c in expected] + [shades[0], shades[1], shades[2], shades[1]]
    expected += [rgb(pictures.COLOURS[Cell.GATE]), rgb(pictures.COLOURS[Cell.OBSTACLE])]
    assert [tuple(pixel) for pixel in image[0].tolist()] == expected
    assert expected[0] == (255, 255, 255)
    red, green, blue = rgb(pictures.COLOURS[Cell.OBSTACLE])
    assert red > 2 * max(green, blue) - 60 and shades[0][2] > shades[0][0]


def drawn(grid, **what):
    """What the middle of each cell looks like once drawn, row 0 first."""
    figure = Figure(figsize=(4, 4 * grid.shape[0] / grid.shape[1]), dpi=100)
    ax = figure.add_axes((0, 0, 1, 1))
    pictures.draw_map(ax, grid, pictures.MapOverlay(**what))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    centres = ax.transData.transform(grid.centres_xy(np.argwhere(np.ones(grid.shape))) * 100 + [1.7, 1.7])
    rows = pixels.shape[0] - 1 - np.floor(centres[:, 1]).astype(int)
    return pixels[rows, np.floor(centres[:, 0]).astype(int)].reshape(*grid.shape, 3)


def test_cells_are_drawn_where_they_are():
    classes = np.array([[1, 4, 0], [3, 1, 2]], np.int8)
    grid = ClassGrid(classes, (classes == 2).astype(np.int8), np.array([1.0, -2.0]), 0.05)
    np.testing.assert_array_equal(drawn(grid), pictures.class_image(grid.classes, grid.levels))


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (150, 100)])
def test_maps_of_any_size_are_drawn(shape, tmp_path):
    grid = ClassGrid(np.ones(shape, np.int8), np.zeros(shape, np.int8), np.zeros(2), 0.05)
    path = grid.centres_xy(np.argwhere(grid.classes)[:200])
    overlay = pictures.MapOverlay(plan_xy=path, start_xy=(0.0, 0.0), goal_xy=(0.02, 0.02))
    pictures.save_map(tmp_path / "a.png", grid, overlay, title="a")
    with Image.open(tmp_path / "a.png") as image:
        assert image.format == "PNG" and min(image.size) > 300


def labels(figure):
    """What the legend of a figure says."""
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_legend_of_a_mission_names_all_that_is_drawn():
    figure = Figure()
    pictures.mission_legend(figure, log := mission(3))
    said = labels(figure)
    assert "obstacle + robot's radius" in said and "reached within 10 cm" in said
    assert "landmark (circle)" in said and "landmark (square)" in said and "true outline" in said
    figure = Figure()
    pictures.mission_legend(figure, replace(log, landmarks=log.landmarks[:1], outlines=()))
    assert "landmark (circle)" in labels(figure) and not {"landmark (square)", "true outline"} & set(labels(figure))


def test_the_legend_of_a_map_that_somebody_brings_claims_no_growing(tmp_path, monkeypatch):
    grid, kept = ClassGrid(np.ones((3, 4), np.int8), np.zeros((3, 4), np.int8), np.zeros(2), 0.05), []
    monkeypatch.setattr(pictures, "save_figure", lambda figure, _: kept.append(figure))
    pictures.save_map(tmp_path / "a.png", grid, pictures.MapOverlay(goal_xy=(0.1, 0.1), goal_radius=None))
    pictures.save_map(tmp_path / "a.png", grid, pictures.MapOverlay(goal_xy=(0.1, 0.1)))
    assert "obstacle" in labels(kept[0]) and not any("reached" in said for said in labels(kept[0]))
    assert "reached within 10 cm" in labels(kept[1])


@pytest.mark.parametrize("moments", [1, 2, 3, 5])
def test_a_mission_picture_is_written(moments, tmp_path):
    pictures.save_mission(tmp_path / "m.png", mission(moments), title="a mission")
    assert os.listdir(tmp_path) == ["m.png"]
    with Image.open(tmp_path / "m.png") as image:
        assert image.size[0] > 700


def test_a_film_has_a_frame_a_moment(tmp_path):
    animation.save_gif(tmp_path / "m.gif", mission(5))
    with Image.open(tmp_path / "m.gif") as film:
        assert film.n_frames == 5
        frames, durations = [], []
        for k in range(5):
            film.seek(k)
            durations.append(film.info["duration"])
            frames.append(np.asarray(film.convert("RGB")).astype(int))
    assert durations == [200, 200, 200, 200, 2000]
    assert all((a != b).any() for a, b in itertools.pairwise(frames))

    def share(frame, cell):
        return (np.abs(frame - rgb(pictures.COLOURS[cell])).max(-1) == 0).mean()

    for cell in (Cell.GATE, Cell.OBSTACLE):  # seen at the end, not at the start
        assert share(frames[-1], cell) > share(frames[0], cell) + 0.02
    assert os.listdir(tmp_path) == ["m.gif"]


def test_a_film_of_one_moment(tmp_path):
    animation.save_gif(tmp_path / "m.gif", mission(1))
    with Image.open(tmp_path / "m.gif") as film:
        assert film.n_frames == 1


def test_a_film_shows_what_the_robot_sees_beside_the_map(tmp_path):
    plain, seen = mission(3), (np.full((60, 80, 3), grey, np.uint8) for grey in (40, 90, 200))
    blank = np.zeros((60, 80), np.float32)
    shown = tuple(Picture(left, np.where(np.arange(80) < 40, np.float32(30), blank)) for left in seen)
    animation.save_gif(tmp_path / "plain.gif", plain)
    animation.save_gif(tmp_path / "seen.gif", replace(plain, pictures=shown))
    with Image.open(tmp_path / "plain.gif") as film, Image.open(tmp_path / "seen.gif") as wide:
        assert wide.width > 1.3 * film.width and wide.height == film.height
        for k, grey in enumerate((40, 90, 200)):
            wide.seek(k)
            frame = np.asarray(wide.convert("RGB")).astype(int)[:, : wide.width // 4]
            assert (np.abs(frame - grey).max(-1) < 12).mean() > 0.15  # the left image
            assert ((frame[..., 0] > 100) & (frame[..., 2] < 60)).mean() > 0.05  # the near half of the disparities
    with pytest.raises(ValueError, match="pictures has 2 moments, time has 3"):
        replace(plain, pictures=shown[:2])


# Greatest difference in grey levels, and share of the pixels: ticks are drawn before the frame that they touch.
TICKS = 32, 1e-4


@pytest.mark.parametrize("seeing", [False, True])
def test_frames_are_as_if_all_of_the_figure_were_drawn_anew(seeing):
    log = mission(5)
    if seeing:
        rng = np.random.default_rng(0)
        images = rng.integers(0, 255, (5, 12, 16, 3), np.uint8), rng.uniform(0, 60, (5, 12, 16)).astype(np.float32)
        log = replace(log, pictures=tuple(Picture(*each) for each in zip(*images, strict=True)))
    scene = animation.Scene(log, "a film", 60)
    frames = [np.asarray(scene.pixels(t)).copy() for t in range(5)]
    for artist in scene.inside:
        artist.set_animated(False)
    for t, frame in enumerate(frames):
        scene.show(t)
        scene.canvas.draw()
        apart = np.abs(frame.astype(int) - np.asarray(scene.canvas.buffer_rgba())[..., :3])
        assert apart.max() <= TICKS[0] and np.count_nonzero(apart) <= TICKS[1] * apart.size
    assert len({frame.tobytes() for frame in frames}) == 5


def test_thirty_frames_take_seconds_and_little_room(tmp_path):
    start = time.perf_counter()
    animation.save_gif(tmp_path / "m.gif", mission(30, 28, 9))
    assert time.perf_counter() - start < 30  # 3 s on two idle cores
    assert (tmp_path / "m.gif").stat().st_size < 3e6


@pytest.mark.parametrize("save", [pictures.save_mission, animation.save_gif])
def test_a_full_disk_leaves_nothing(save, tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError) as caught:
        save(tmp_path / "m.x", mission(2))
    assert str(caught.value) == f"{tmp_path / 'm.x'}: cannot be written: no space left on device"
    assert os.listdir(tmp_path) == []


def test_a_log_whose_parts_differ_in_length_is_refused():
    whole = vars(mission(3))
    with pytest.raises(ValueError, match="action has 2 moments, time has 3"):
        MissionLog(**whole | {"action": ("Start", "Turn-direction")})


@pytest.mark.parametrize("yaw", [0.0, 0.6, -2.5])
def test_a_map_that_lies_turned_is_drawn_turned(yaw):
    """Each cell's colour is where the cell is, and all of the map is in the picture."""
    classes = np.array([[1, 1, 4, 2], [3, 1, 4, 1], [1, 2, 1, 3]], np.int8)
    grid = ClassGrid(classes, np.zeros_like(classes), np.array([-1.0, 2.0]), 0.1, yaw)
    figure = Figure(figsize=(6, 6), dpi=100)
    canvas, ax = FigureCanvasAgg(figure), figure.subplots()
    pictures.draw_map(ax, grid)
    canvas.draw()
    shown = np.asarray(canvas.buffer_rgba())[..., :3]
    cells = np.argwhere(classes)
    for (i, j), xy in zip(cells, grid.centres_xy(cells) * 100, strict=True):
        x, y = ax.transData.transform(xy + 2.0)  # [cm] beside the number in the cell
        assert ax.bbox.contains(x, y)
        expected = np.array(rgb(pictures.COLOURS[Cell(classes[i, j])]))
        assert np.abs(shown[int(shown.shape[0] - y), int(x)].astype(int) - expected).max() < 30


def test_slopes_to_the_light_are_bright():
    """From the upper left, at 45 degrees: level ground, ground facing it and facing away, and beside a hole."""
    i, j = np.indices((4, 5)) * 0.1
    level = np.sqrt(0.5)
    np.testing.assert_allclose(pictures.hillshade(0 * i, 0.1), level)
    np.testing.assert_allclose(pictures.hillshade((j - i) / np.sqrt(2), 0.1), 1.0)
    np.testing.assert_allclose(pictures.hillshade((i - j) / np.sqrt(2), 0.1), 0.0, atol=1e-12)
    holed = np.where((i == 0) & (j == 0), np.nan, i)
    assert np.isfinite(pictures.hillshade(holed, 0.1)).all()


def test_terrain_is_shaded_where_it_lies_and_holes_are_hatched(tmp_path):
    """A ridge across the middle darkens one of its sides and leaves level ground as it is."""
    heights = np.zeros((71, 91), np.float32)
    heights[:, 40:50] = 0.05
    heights[:20, 60:80] = np.nan
    grid = ClassGrid(np.ones((14, 18), np.int8), np.zeros((14, 18), np.int8), np.zeros(2), 0.05)
    bare, shaded = (drawn(grid, **what).astype(int) for what in ({}, {"terrain": Ground(heights, np.zeros(2), 0.01)}))
    changed = np.abs(bare - shaded).sum(-1)
    # past the holes; the far side of the ridge, from 49 to 50 cm, lies where the column from 45 cm on is looked at
    assert (changed[6:-1, [4, 5, 12, 16]] < 3).all()
    assert (shaded[6:-1, 9].sum(-1) < bare[6:-1, 9].sum(-1) - 10).all()


def test_holes_are_hatched(tmp_path):
    heights = np.zeros((71, 91), np.float32)
    heights[20:50, 30:60] = np.nan
    grid = ClassGrid(np.ones((14, 18), np.int8), np.zeros((14, 18), np.int8), np.zeros(2), 0.05)
    images = []
    for name, terrain in (("a", None), ("b", Ground(heights, np.zeros(2), 0.01))):
        pictures.save_map(tmp_path / f"{name}.png", grid, pictures.MapOverlay(terrain=terrain))
        images.append(np.asarray(Image.open(tmp_path / f"{name}.png").convert("L"), int))
    rows, columns = np.nonzero(np.abs(images[0] - images[1]) > 50)
    assert len(rows) > 500
    height, width = images[0].shape
    assert columns.min() > 0.3 * width and columns.max() < 0.75 * width and rows.max() < 0.75 * height
