"""Videos of primitives, rendered by MuJoCo."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import PrimitiveTable
from jaxbiped.biped.trial import SETTLE, Disturbance, boxes_of, lay_out, passes_gate
from jaxbiped.biped.verify import roll, trial_spec
from jaxbiped.errors import InputError
from jaxbiped.files import write_whole
from jaxbiped.physics.native import Native
from jaxbiped.physics.native import Options as NativeOptions

SIZE = (400, 300)  # [px] width and height
FRAMES_PER_SECOND, LONGEST = 10.0, 6.0  # [1/s], [s] of a video: longer primitives are played faster
HOLD = 1.0  # [s] duration of the last frame
COLOURS = 96


@contextlib.contextmanager
def rendering(model: mujoco.MjModel, size: tuple[int, int]) -> Iterator[tuple[mujoco.MjvScene, mujoco.MjrContext]]:
    """OpenGL without a window: EGL on Linux, unless the environment variable MUJOCO_GL names another.

    Raises:
      InputError: OpenGL is not available.
    """
    try:
        if sys.platform == "linux" and "MUJOCO_GL" not in os.environ:
            from mujoco.egl import GLContext
        else:
            from mujoco.gl_context import GLContext
        gl = GLContext(*size)
        gl.make_current()
    except Exception as error:  # any error of the system's libraries
        said = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise InputError(f"cannot be rendered without OpenGL (--no-videos skips videos): {said}",
                         field="videos") from None  # fmt: skip
    try:
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
        yield mujoco.MjvScene(model, maxgeom=1000), context
        context.free()
    finally:
        gl.free()


def save_primitive(path: str | Path, name: str, table: PrimitiveTable, robot: RobotModelConfig) -> None:
    """Write one undisturbed trial as an animated GIF.

    Raises:
      InputError: OpenGL is not available, or the file cannot be written.
    """
    spec = trial_spec(robot, boxes_of(table.request))
    paint(spec)
    native = Native(spec, 1, NativeOptions())
    steps = len(table.ctrl) + 2 * round(SETTLE / table.timestep)
    rollout = roll(native, table, robot, [Disturbance()], record=True)
    speed = float(max(1, round(steps * table.timestep / LONGEST)))
    at = np.arange(0, steps, speed / FRAMES_PER_SECOND / table.timestep).astype(int)
    lay_out(native.model, table, robot, Disturbance())
    said = f"{name.replace('_', ' ')}, {table.duration:g} s" + (f", {speed:.0f} times as fast" if speed > 1.5 else "")
    frames = render(native.model, rollout.qpos[0, at], table, said)
    palette = frames[len(frames) // 2].quantize(COLOURS, method=Image.Quantize.MEDIANCUT)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    milliseconds = [round(1000 / FRAMES_PER_SECOND)] * (len(frames) - 1) + [round(1000 * HOLD)]
    options = {"save_all": True, "append_images": frames[1:], "duration": milliseconds, "loop": 0}
    write_whole(path, lambda file: frames[0].save(file, format="GIF", **options))


def paint(spec: mujoco.MjSpec) -> None:
    """Add a floor of 5 cm tiles, one per cell, that makes movement visible."""
    spec.add_texture(name="tiles", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
                     rgb1=(0.62, 0.66, 0.70), rgb2=(0.54, 0.58, 0.62), width=256, height=256)  # fmt: skip
    spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
                     rgb1=(0.93, 0.95, 0.97), width=64, height=64)  # fmt: skip
    material = spec.add_material(name="tiles", texrepeat=(10, 10), texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    floor = spec.geom("floor")
    floor.material, floor.rgba = "tiles", (1, 1, 1, 1)


def render(model: mujoco.MjModel, qpos: np.ndarray, table: PrimitiveTable, said: str) -> list[Image.Image]:
    """Pictures of states [N, nq], from the robot's right and a little in front."""
    data, camera, option = mujoco.MjData(model), mujoco.MjvCamera(), mujoco.MjvOption()
    camera.distance, camera.azimuth, camera.elevation = 0.95, 125.0, -14.0
    middle = table.request.forward / 2
    camera.lookat[:] = middle, table.request.left / 2, 0.19
    model.stat.extent, model.stat.center[:] = 1.0, (middle, 0, 0.2)  # do not spend depth resolution on far unused boxes
    model.vis.quality.shadowsize, model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 1024, 0.35, 0.5
    for k in range(model.ngeom):
        if model.geom(k).name.startswith("box_") and passes_gate(table.request):
            model.geom_rgba[k, 3] = 0.55  # a gate through which the robot is visible
    viewport = mujoco.MjrRect(0, 0, *SIZE)
    pixels = np.empty((SIZE[1], SIZE[0], 3), np.uint8)
    frames, font = [], ImageFont.load_default(15)
    with rendering(model, SIZE) as (scene, context):
        scene.flags[mujoco.mjtRndFlag.mjRND_HAZE] = False
        for state in qpos:
            data.qpos[:] = state
            mujoco.mj_forward(model, data)
            mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
            mujoco.mjr_render(viewport, scene, context)
            mujoco.mjr_readPixels(pixels, None, viewport, context)
            frame = Image.fromarray(np.flipud(pixels).copy())
            ImageDraw.Draw(frame).text((10, 8), said, fill=(30, 34, 42), font=font)
            frames.append(frame)
    return frames
