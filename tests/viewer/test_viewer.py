"""The viewer: its arrays against plain arithmetic, its server over a real connection, and its page in Chromium."""

import urllib.request
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from jaxbiped.arenas.moving_boxes import Movers, boxes_at
from jaxbiped.arenas.scene import BoxConfig, SceneConfig, to_arena
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.errors import InputError
from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.log import Walk
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.snapshots import outlines
from jaxbiped.report.pictures import COLOURS
from jaxbiped.viewer import layers, triangles
from jaxbiped.viewer.canvas import FIELD_OF_VIEW, viewpoint
from jaxbiped.viewer.mission_file import Shown
from jaxbiped.viewer.mission_motion import motion
from jaxbiped.viewer.puppet import Puppet
from jaxbiped.viewer.server import serving
from tests.report.test_pictures import mission
from tests.viewer.browser import CHROMIUM, browsing

RNG = np.random.default_rng(0)
MEASURE = 10.0


def state(x, yaw, knee=0.6):
    """A state of the biped, somewhere."""
    joints = np.tile([0.0, 0.0, -knee / 2, knee, -knee / 2, 0.0], 2)
    return np.array([x, 0.2, 0.19, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2), *joints], np.float32)


def seen(moments=5):
    """A log of a simulated biped with points and voxels."""
    log = mission(moments)
    heights = ((0.0, 0.03), (0.37, 0.5), (0.0, 0.2))
    boxes = [replace(each, bottom=low, top=high) for each, (low, high) in zip(log.outlines, heights, strict=True)]
    boxes[2] = replace(boxes[2], way=(0.0, 0.2, 0.02, 0.0))
    when = np.arange(0, moments - 1, 0.25, np.float32)
    states = [state(np.interp(m, np.arange(moments), log.true_xyyaw[:, 0]), 0.2 * m) for m in when]
    return replace(
        log,
        outlines=tuple(boxes),
        true_z=np.zeros(moments),
        squat=np.zeros(moments, bool),
        points=tuple(RNG.uniform(0, 0.3, (n, 3)).astype(np.float32) for n in (40, 30, 20, 10, 10)[:moments]),
        voxels=RNG.random((moments, 7, 9, 15)) < 0.1,
        walk=Walk(np.stack(states), when),
    )


@pytest.fixture(scope="module")
def puppet():
    return Puppet(RobotModelConfig())


def test_tiles_have_the_colours_of_the_paper_in_their_cells():
    log = seen()
    bricks = layers.tiles(log, 2)
    assert len(bricks.centre) == log.classes[2].size and Cell.UNMEASURED in log.classes[2]
    for (x, y, z), colour in zip(bricks.centre, bricks.colour, strict=True):
        i, j = int(y / 0.05), int(x / 0.05)
        cell = Cell(log.classes[2][i, j])
        assert (x, y) == pytest.approx(((j + 0.5) * 0.05, (i + 0.5) * 0.05))
        assert z < -0.002 if cell == Cell.UNMEASURED else z == pytest.approx(log.levels[2][i, j] * 0.03 + 0.0015)
        if cell != Cell.BUMP:
            assert colour.tolist() == [round(255 * c) for c in to_rgb(COLOURS[cell])]


def test_voxels_lie_where_they_are_occupied():
    log = seen()
    bricks = layers.voxels(log, 2)
    back = np.round(bricks.centre[:, [1, 0, 2]] / (0.05, 0.05, 0.03) - (0.5, 0.5, 0)).astype(int)
    above = [tuple(each) for each in np.argwhere(log.voxels[2]).tolist() if each[2] > 0]
    assert sorted(tuple(each) for each in back.tolist()) == above and len(above) > 50
    assert len(layers.voxels(replace(log, voxels=None), 2).centre) == 0


def test_points_of_one_measurement_and_of_all():
    log = seen()
    np.testing.assert_array_equal(layers.cloud(log, 1).xyz, log.points[1])
    assert len(layers.cloud(log, 2, earlier=True).xyz) == 40 + 30 + 20
    assert len(layers.cloud(log, 4, earlier=True).xyz) == 40 + 30 + 20 + 10  # the last one repeats the one before
    assert len(layers.cloud(mission(), 1).xyz) == 0
    low, high = triangles.height_colours(np.array([0.0, 0.4])).astype(int)
    assert high.sum() > low.sum() + 100


def test_plan_and_track_join_their_points():
    log = seen()
    arrows = layers.plan_line(log, 0)
    np.testing.assert_allclose(arrows[:, 0, :2], log.plan[0][:-1])
    np.testing.assert_allclose(arrows[:, 1, :2], log.plan[0][1:])
    assert layers.plan_line(log, 4).shape == (0, 2, 3) == layers.track_line(log, 0).shape
    assert layers.track_line(log, 3).shape == (3, 2, 3)


@pytest.mark.parametrize(
    "time,expected", [(-5.0, 0), (0.0, 0), (25.9, 0), (26.0, 1), (51.9999999, 2), (104.0, 4), (1e9, 4)]
)
def test_each_time_has_its_moment(time, expected):
    assert layers.moment_at(seen(), time) == expected


def test_boxes_stand_where_they_do():
    log = seen()
    found = {solid.name: solid for solid in triangles.solids(log)}
    for k, outline in enumerate(log.outlines):
        box = found[f"arena/box_{k}"]
        low, high = box.vertices.min(axis=0), box.vertices.max(axis=0)
        corners = outline.corners_xy
        np.testing.assert_allclose(low, [*corners.min(axis=0), outline.bottom])
        np.testing.assert_allclose(high, [*corners.max(axis=0), outline.top])
        a, b, c = (box.vertices[box.faces[:, n]] for n in range(3))
        outward = np.einsum("fi,fi->f", np.cross(b - a, c - a), (a + b + c) / 3 - box.vertices.mean(axis=0))
        assert np.all(outward > 0)
    assert found["arena/floor"].vertices[:, 2].max() <= 0


def test_boxes_that_move_are_where_the_arena_has_them():
    scene = SceneConfig(
        name="small", size=(0.9, 0.6), start=(0.2, 0.3, 0.0), goal=(0.7, 0.3),
        boxes=(BoxConfig(centre=(0.5, 0.4), size=(0.1, 0.2), top=0.2),),
    )  # fmt: skip
    still = to_arena(scene)
    ways = (np.full(still.boxes.x.shape, value, np.float32) for value in (0.3, -0.1, 0.013, 0.4))
    arena = replace(still, movers=Movers(*ways))
    (outline,) = outlines(arena)
    assert outline.bottom == 0 and outline.top == pytest.approx(0.2)
    for time in (0.0, 7.0, 30.0, 100.0):
        there = boxes_at(arena, time)
        moved = np.add(outline.corners_xy.mean(axis=0), outline.moved(time))
        np.testing.assert_allclose(moved, [there.x[0], there.y[0]], atol=1e-6)


def test_a_simulated_biped_moves_as_it_did(puppet):
    log = seen()
    moved = motion(log, puppet, MEASURE)
    assert np.all(np.diff(moved.time) > 0)
    for m, qpos in zip(log.walk.moment, log.walk.qpos, strict=True):
        t, share = int(m), m - int(m)
        took = log.time[t + 1] - log.time[t] - (MEASURE if t + 1 < len(log.time) - 1 else 0)
        np.testing.assert_allclose(moved.at(log.time[t] + share * took), qpos, atol=1e-6)
    half = moved.at(float(moved.time[:2].mean()))
    np.testing.assert_allclose(half[:3], (moved.qpos[0, :3] + moved.qpos[1, :3]) / 2, atol=1e-6)
    assert np.linalg.norm(half[3:7]) == pytest.approx(1)
    np.testing.assert_array_equal(moved.at(-1e9), moved.qpos[0])
    np.testing.assert_array_equal(moved.at(1e9), moved.qpos[-1])


def test_the_puppet_is_the_robot(puppet):
    """Lowest at its soles, as high as its camera's top; a state moves and turns all of it."""
    parts = puppet.parts()
    assert [each for each in puppet.bodies if each.startswith("foot")] == ["foot_left", "foot_right"]
    home = puppet.home(0.3, 0.4, 0.03, 0.5, False)
    bodies, eye = puppet.poses(home)

    def corners(pose):
        import trimesh.transformations as tf

        return np.concatenate(
            [each.vertices @ tf.quaternion_matrix(pose.wxyz[k])[:3, :3].T + pose.position[k]
             for k, body in enumerate(parts) for each in body]
        )  # fmt: skip

    everything = corners(bodies)
    robot = RobotModelConfig()
    assert everything[:, 2].min() == pytest.approx(0.03, abs=1e-3)
    assert everything[:, 2].max() == pytest.approx(0.03 + robot.head_standing, abs=2e-3)
    np.testing.assert_allclose(eye.position[0, 2], 0.03 + robot.head_standing, atol=0.03)
    low, _ = puppet.poses(puppet.home(0.3, 0.4, 0.03, 0.5, True))
    assert corners(low)[:, 2].max() == pytest.approx(0.03 + robot.head_squatting, abs=2e-3)


def between_the_feet(puppet, qpos):
    """Middle between the soles (x, y) and the lower sole's height [m], and the yaw of the feet [rad]."""
    puppet.poses(qpos)
    left, right = (puppet.data.site(f"sole_{side}").xpos for side in ("left", "right"))
    across = left - right
    return *(left + right)[:2] / 2, min(left[2], right[2]), np.arctan2(-across[0], across[1])


def test_a_robot_whose_places_are_known_walks_from_one_to_the_next(puppet):
    """At each moment it stands where it was; in between a sole is on the ground, and nothing jumps."""
    places = np.array([[0.1, 0.2, 0.0], [0.15, 0.2, 0.0], [0.186, 0.236, np.pi / 4], [0.186, 0.236, np.pi / 4]])
    actions = ("Start", "Straight-forward", "Straight-forward", "Look-down")
    log = replace(mission(4), true_xyyaw=places, action=actions, true_z=np.zeros(4), squat=np.zeros(4, bool))
    moved = motion(log, puppet, MEASURE)
    for t, place in zip(log.time, places, strict=True):
        x, y, z, yaw = between_the_feet(puppet, moved.at(float(t)))
        assert (x, y, yaw) == pytest.approx(tuple(place), abs=1e-3) and z == pytest.approx(0, abs=1e-3)
    soles = [between_the_feet(puppet, moved.at(time))[2] for time in np.arange(0.0, 78.0, 0.5)]
    assert np.abs(soles).max() < 2e-3, "in the air, or in the ground"
    assert np.abs(np.diff(moved.qpos[:, :3], axis=0)).max() < 0.03
    legs = moved.qpos[:, 7:]
    assert np.ptp(legs[:, 3]) > 0.1, "the knees do not bend"


def test_what_cannot_be_walked_is_glided(puppet):
    far = np.array([[0.1, 0.2, 0.0], [1.3, 0.2, 0.0]])
    log = replace(mission(2), true_xyyaw=far, action=("Start", "Straight-forward"))
    moved = motion(log, puppet, MEASURE)
    assert moved.at(0.0)[0] < 0.2 and moved.at(13.0)[0] == pytest.approx(0.7, abs=0.05) and moved.at(26.0)[0] > 1.2


@pytest.mark.parametrize("aspect", [2.2, 1.6, 1.25, 0.75, 0.46])
def test_one_looks_at_the_whole_arena(aspect):
    """Its corners are in the window, left of the panel or above it."""
    log = mission()
    position, at = (np.array(each) for each in viewpoint(log, aspect))
    ahead = (at - position) / np.linalg.norm(at - position)
    right = np.cross(ahead, (0, 0, 1)) / np.linalg.norm(np.cross(ahead, (0, 0, 1)))
    away = np.array([[x, y, 0] for x in (0, log.size_xy[0]) for y in (0, log.size_xy[1])]) - position
    depth = away @ ahead * np.tan(FIELD_OF_VIEW / 2)
    across, up = away @ right / depth / aspect, away @ np.cross(right, ahead) / depth  # -1 to 1 in the window
    assert np.all(away @ ahead > 0) and across.min() > -1 and up.max() < 1
    if aspect > 1:
        assert across.max() < 0.6 and up.min() > -1
    else:
        assert across.max() < 1 and up.min() > -0.25


def shown():
    return Shown(seen(), MissionConfig(), "a scene, full", "reached: 25 cm in 104 s", "seed 0")


@pytest.fixture(scope="module")
def page():
    """The real server on a free port."""
    pytest.importorskip("viser")
    with serving(shown(), "127.0.0.1", 0) as made:
        yield made


def scene_of(page):
    """Names of the scene that the server sends to one who comes, by the types of their messages."""
    import msgspec
    import viser
    import zstandard
    from websockets.sync.client import connect

    address, found = f"ws://127.0.0.1:{page.server.get_port()}", {}
    with connect(address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as socket:
        while "ReplayDoneMessage" not in found:
            data = socket.recv(timeout=20)
            packed = data[16 : 16 + int.from_bytes(data[8:16], "little")]
            for message in msgspec.msgpack.decode(zstandard.decompress(packed))["messages"]:
                found.setdefault(message["type"], set()).add(message.get("name"))
    return found


def test_the_server_gives_page_and_scene(page):
    with urllib.request.urlopen(f"http://127.0.0.1:{page.server.get_port()}/", timeout=20) as answer:
        assert answer.status == 200 and b"<html" in answer.read().lower()
    found = scene_of(page)
    assert {"/arena/floor", "/arena/box_0", "/goal", "/belief", "/robot/torso/0"} <= found["MeshMessage"]
    assert {f"/robot/{name}" for name in page.puppet.bodies} <= found["FrameMessage"]
    assert "/map" in found["BatchedMeshesMessage"] and "/points" in found["PointCloudMessage"]
    assert "/plan" in found["ArrowMessage"] and "/camera" in found["CameraFrustumMessage"]
    assert len(found["GuiCheckboxMessage"]) == 1 and "GuiSliderMessage" in found
    assert "reached: 25 cm" in page.heading.content


def test_time_moves_the_robot_and_its_map(page):
    page.seek(0.0)
    torso, tiles = page.server.scene.get_handle_by_name("/robot/torso"), []
    places, box = [], page.server.scene.get_handle_by_name("/arena/box_2")
    for time in (0.0, 60.0, 104.0):
        page.seek(time)
        places.append(torso.position[0])
        assert tuple(box.position[:2]) == pytest.approx((0.0, 0.2 * (1 - abs((0.1 * time) % 2 - 1))))
        tiles.append(np.sum(page.server.scene.get_handle_by_name("/map").batched_positions[:, 2] > 0))
        assert f"**{time:.0f} s** of 104 s" in page.said.content and page.slider.value == time
        doing = {0.0: "Straight-forward", 104.0: "Straight-forward (reached)"}.get(time, "Straight-forward")
        assert f"**{doing}**" in page.said.content
    page.seek(70.0)
    assert "**measuring**" in page.said.content
    page.seek(104.0)
    assert places[0] < places[1] < places[2] and tiles[0] < tiles[1] < tiles[2]
    assert "reached" in page.said.content
    page.step(-1)
    assert page.time == 78.0


def test_layers_are_switched(page):
    handle = page.server.scene.get_handle_by_name
    page.seek(30.0)
    assert handle("/voxels") is None
    page.boxes["voxels"].value, page.boxes["plan"].value, page.boxes["robot"].value = True, False, False
    for name in ("voxels", "plan", "robot"):
        page.switch(name)
    assert len(handle("/voxels").batched_positions) == np.sum(page.mission.log.voxels[1][..., 1:])
    assert not handle("/plan").visible and not handle("/robot/torso").visible
    page.seek(60.0)
    assert not handle("/plan").visible and not handle("/robot/torso").visible
    for name, on in (("voxels", False), ("plan", True), ("robot", True)):
        page.boxes[name].value = on
        page.switch(name)
    assert handle("/voxels") is None and handle("/plan").visible and handle("/robot/torso").visible


def test_playing_goes_on_to_the_end_and_stops(page):
    page.seek(90.0)
    page.speed.value = "60 x"
    page.toggle()
    end = page.mission.log.time[-1]
    from time import monotonic, sleep

    begun = monotonic()
    while page.playing and monotonic() < begun + 20:
        sleep(0.05)
    assert page.time == end and not page.playing and page.button.label == "Play"


def test_a_taken_port_and_a_foreign_host_are_named(page):
    with pytest.raises(InputError, match="port: is in use"), serving(shown(), "127.0.0.1", page.server.get_port()):
        pass
    with (
        pytest.raises(InputError, match="host: must be an address of this machine"),
        serving(shown(), "203.0.113.7", 0),
    ):
        pass


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_the_page_is_drawn(page, tmp_path):
    """Of many colours where the arena is: neither blank nor one flat grey."""
    page.seek(60.0)
    with browsing(tmp_path, f"http://127.0.0.1:{page.server.get_port()}") as browser:
        assert browser.until(page.server.get_clients, 60), "nobody connected"

        def drawn():
            middle = browser.picture()[150:700, 100:900].reshape(-1, 3)
            return len(np.unique(middle // 16, axis=0)) > 30 and middle.std() > 8

        assert browser.until(drawn, 60), "the canvas stayed blank"
        text = lambda: browser.run("document.body.innerText")  # noqa: E731
        assert "reached: 25 cm" in text()
        click = "[...document.querySelectorAll('button')].find(each => each.textContent.trim() == '{}').click()"
        before, page.speed.value = page.time, "5 x"
        browser.run(click.format("Play"))
        assert browser.until(lambda: page.time > before + 1, 30), "it does not play"
        assert browser.until(lambda: "Pause" in text(), 10)
        browser.run(click.format("Pause"))
        assert browser.until(lambda: not page.playing, 10)
        assert browser.until(lambda: f"{page.time:.0f} s of 104 s" in text(), 10)
