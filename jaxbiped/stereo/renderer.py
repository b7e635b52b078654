"""Stereo pairs of an arena, rendered by MuJoCo without a window, with the noise that every image sensor has."""

from __future__ import annotations

import importlib
import os
import sys
import threading
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, UInt8

from jaxbiped import surroundings
from jaxbiped.arenas.arena import Arena
from jaxbiped.errors import InputError
from jaxbiped.sensing.config import CameraConfig

try:
    import mujoco

    from jaxbiped.stereo.scene import arena_model
except Exception as error:  # of whatever library MUJOCO_GL names
    raise surroundings.named_window_system(error) or error from None

NEAR, FAR = 0.01, 20.0  # [m] range of rendered depths
SAMPLES = 4  # samples per pixel of an image
PACKAGES = {"egl": "libegl1", "osmesa": "libosmesa6"}  # of Debian and Ubuntu
MODULES = {"egl": "mujoco.egl", "osmesa": "mujoco.osmesa", "glfw": "mujoco.glfw", "cgl": "mujoco.cgl"}


@dataclass(frozen=True)
class Pair:
    """A left and a right image, and the depth of each pixel of the left one along the optical axis."""

    left: UInt8[np.ndarray, "H W 3"]
    right: UInt8[np.ndarray, "H W 3"]
    depth: Float32[np.ndarray, "H W"] | None = None  # [m]; inf where there is nothing


class Renderer:
    """Renders one arena after another. To be used, and closed, in the thread that created it."""

    def __init__(self, camera: CameraConfig):
        """
        Raises:
          InputError: no OpenGL works without a window.
        """
        self.camera = camera
        self.gl = context(camera.width, camera.height)
        self.thread = threading.get_ident()
        self.model = self.scene = None
        self.targets: dict[bool, mujoco.MjrContext] = {}  # for pictures, and for depth

    def show(self, arena: Arena) -> None:
        """Render this arena (no batch axis) from now on."""
        self.gl.make_current()
        self.free()
        model = arena_model(arena)
        model.vis.global_.offwidth, model.vis.global_.offheight = self.camera.width, self.camera.height
        model.vis.quality.shadowsize = 0
        self.scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 8)
        data, everything = mujoco.MjData(model), mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mj_forward(model, data)
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), everything, self.scene)
        for flag in (mujoco.mjtRndFlag.mjRND_HAZE, mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self.scene.flags[flag] = False
        self.model = model

    def target(self, depth: bool) -> mujoco.MjrContext:
        """The render target. If pixels are the mean of several samples, depth is not that of their centres."""
        if depth not in self.targets:
            self.model.vis.quality.offsamples = 0 if depth else SAMPLES
            made = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_50)
            made.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
            self.targets[depth] = made
        return self.targets[depth]

    def pair(
        self,
        origin: Float[np.ndarray, "3"],
        basis: Float[np.ndarray, "3 3"],
        noise: float,
        seed: int,
        depth: bool = False,
    ) -> Pair:
        """Render the views of the two cameras.

        Args:
          origin: [m] position of the left camera, world frame.
          basis: takes directions in the camera's frame (x right, y down, z forward) to the world's.
          noise: standard deviation of each channel of each pixel, in grey levels.
          seed: seed of that noise.
          depth: also measure the left image's true depth.
        """
        if threading.get_ident() != self.thread:
            raise RuntimeError("OpenGL must be used in the thread that created it")
        self.gl.make_current()
        origin, basis = np.asarray(origin, float), np.asarray(basis, float)
        left = self.picture(origin, basis)
        right = self.picture(origin + basis[:, 0] * self.camera.baseline, basis)
        rng = np.random.Generator(np.random.SFC64(seed))
        return Pair(grain(left, noise, rng), grain(right, noise, rng), self.depth(origin, basis) if depth else None)

    def picture(self, eye: Float[np.ndarray, "3"], basis: Float[np.ndarray, "3 3"]) -> UInt8[np.ndarray, "H W 3"]:
        """One image, without noise."""
        viewport, target = self.draw(eye, basis, depth=False)
        pixels = np.empty((viewport.height, viewport.width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, viewport, target)
        return np.flipud(pixels)

    def depth(self, eye: Float[np.ndarray, "3"], basis: Float[np.ndarray, "3 3"]) -> Float32[np.ndarray, "H W"]:
        """[m] along the optical axis; inf where there is nothing."""
        viewport, target = self.draw(eye, basis, depth=True)
        share = np.empty((viewport.height, viewport.width), np.float32)  # near depth over this one, except for FAR
        mujoco.mjr_readPixels(None, share, viewport, target)
        depth = NEAR * FAR / (np.flipud(share).astype(float) * (FAR - NEAR) + NEAR)
        return np.where(depth < 0.99 * FAR, depth, np.inf).astype(np.float32)

    def draw(self, eye, basis, depth: bool) -> tuple[mujoco.MjrRect, mujoco.MjrContext]:
        """Draw the view of a camera, to be read back."""
        camera = self.camera
        half_x, half_y = (NEAR * size / (2 * camera.focal) for size in (camera.width, camera.height))
        for view in self.scene.camera:  # MuJoCo's own stereo cameras; one picture is drawn from their mean
            view.pos, view.forward, view.up = eye, basis[:, 2], -basis[:, 1]
            view.frustum_center, view.frustum_width = 0.0, half_x
            view.frustum_bottom, view.frustum_top = -half_y, half_y
            view.frustum_near, view.frustum_far = NEAR, FAR
        viewport = mujoco.MjrRect(0, 0, camera.width, camera.height)
        self.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = not depth  # it has its own depth
        target = self.target(depth)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, target)
        mujoco.mjr_render(viewport, self.scene, target)
        return viewport, target

    def free(self) -> None:
        """Free the resources of an arena."""
        for target in self.targets.values():
            target.free()
        self.targets, self.scene = {}, None

    def close(self) -> None:
        """Free the resources of the graphics driver."""
        self.gl.make_current()
        self.free()
        self.gl.free()


def grain(image: UInt8[np.ndarray, "H W 3"], noise: float, rng: np.random.Generator) -> UInt8[np.ndarray, "H W 3"]:
    """An image with normal noise of a standard deviation in grey levels; one value of `rng` per number."""
    values = rng.standard_normal(image.shape, np.float32)
    values *= np.float32(noise)
    values += image
    return np.clip(np.rint(values, out=values), 0, 255, out=values).astype(np.uint8)


def context(width: int, height: int):
    """OpenGL without a window: the one named by MUJOCO_GL; else, on Linux, the first of EGL and OSMesa that works.

    Raises:
      InputError: none works; names the package to install.
    """
    asked = os.environ.get("MUJOCO_GL", "").lower().strip()
    known = asked if asked in MODULES else ""
    names = (known,) if known else ("egl", "osmesa") if sys.platform == "linux" else ("glfw",)
    reasons = []
    for name in names:
        try:
            return opened(name, width, height)
        except Exception as error:  # any error of the system's libraries
            said = (str(error).strip() or type(error).__name__).splitlines()[0]
            reasons.append(f"{name}: {said}")
    wanted = " or ".join(PACKAGES[name] for name in names if name in PACKAGES)
    advice = f"install {wanted} (apt install {PACKAGES.get(names[0], '')})" if wanted else "install a graphics driver"
    raise InputError(f"cannot render without OpenGL: {advice}; {'; '.join(reasons)}", field="sensor", value="stereo")


def opened(name: str, width: int, height: int):
    """A current context of one kind. PyOpenGL's modules for another kind are unloaded first."""
    if os.environ.get("PYOPENGL_PLATFORM", name) != name and name in PACKAGES:
        for module in [
            m for m in sys.modules if m.split(".")[0] == "OpenGL" or m.startswith(("mujoco.egl", "mujoco.os"))
        ]:
            del sys.modules[module]
        del os.environ["PYOPENGL_PLATFORM"]
    found = importlib.import_module(MODULES[name]).GLContext(width, height)
    found.make_current()
    return found
