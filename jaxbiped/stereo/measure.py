"""The rendered stereo camera: from an arena to points and landmarks, by way of two pictures."""

from __future__ import annotations

import jax
import numpy as np
from jaxtyping import Float

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import refuse_terrain
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing.camera import Mount
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.landmarks import LandmarkNoise
from jaxbiped.sensing.shot import Shot
from jaxbiped.sensing.view import Sightings, View
from jaxbiped.stereo.calibration import ideal
from jaxbiped.stereo.landmark_matching import floor_disparity, recognise
from jaxbiped.stereo.landmarks import find
from jaxbiped.stereo.matching import Disparity, MatchParams, grey, match
from jaxbiped.stereo.points import to_points
from jaxbiped.stereo.renderer import Pair, Renderer
from jaxbiped.stereo.texture import textured

STRIDE = 2  # pixels from one point to the next, across and down: a matcher's pixels are correlated over more than that


class StereoSensor:
    """Renders the robot's view, and measures it. To be used, and closed, in the thread that created it."""

    def __init__(self, camera: CameraConfig):
        """
        Raises:
          InputError: nothing can be rendered on this machine.
        """
        self.camera, self.rig = camera, ideal(camera)
        self.params = MatchParams(num_disparities=camera.num_disparities)
        self.renderer = Renderer(camera)
        self.shown: bytes | None = None

    def __call__(
        self,
        arena: Arena,
        origin: Float[np.ndarray, "3"],
        basis: Float[np.ndarray, "3 3"],
        at: Mount,
        believed: Pose,
        max_range: float,
        spread: LandmarkNoise,
        seed: int,
    ) -> Shot:
        """One measurement; all arguments on the host, without a batch axis.

        Args:
          arena: the true one; the measurement itself only reads the known positions of landmarks from it.
          origin, basis: true pose of the left camera (`camera.placed`).
          at: believed pose of the camera on the robot.
          believed: believed pose of the robot, to tell landmarks apart.
          max_range: [m] from the camera; points beyond are dropped.
          spread: accuracy of landmark measurements.
          seed: seed of the image noise.

        Returns:
          The measurement; empty, and black, if the pose is not finite.
        """
        if not np.isfinite(np.sum(origin) + np.sum(basis)):
            return self.nothing(arena)
        self.show(arena)
        pair = self.renderer.pair(origin, basis, self.camera.image_noise, seed)
        return self.measure(pair, arena, at, believed, max_range, spread)

    def show(self, arena: Arena) -> None:
        """Render this arena from now on."""
        refuse_terrain(arena, "sensor stereo")
        drawn = arena.size_xy, arena.boxes, arena.landmarks, arena.floor_contrast
        name = b"".join(np.asarray(leaf).tobytes() for leaf in jax.tree.leaves(drawn))
        if name != self.shown:
            self.renderer.show(arena)
            self.shown = name

    def measure(
        self, pair: Pair, arena: Arena, at: Mount, believed: Pose, max_range: float, spread: LandmarkNoise
    ) -> Shot:
        """The measurement in a pair of pictures."""
        disparity = self.match(pair)
        floor = -float(believed.z)
        marks, patches = find(pair.left, pair.right, self.rig, at, floor)
        below = float(at.height) - floor
        known = floor_disparity(patches, arena.landmarks, believed, self.rig, at, below)
        disparity = Disparity(np.where(known > 0, known, disparity.value), disparity.valid | (known > 0))
        sightings = recognise(marks, arena.landmarks, believed, spread)
        return Shot(self.view(disparity, at, max_range), sightings, pair.left, disparity.value)

    def match(self, pair: Pair) -> Disparity:
        """Disparities of textured pixels (paper, 3.1: stereo is unstable where texture is poor)."""
        found = match(pair.left, pair.right, self.params)
        valid = found.valid & textured(grey(pair.left), self.camera.image_noise)
        return Disparity(np.where(valid, found.value, np.float32(0)), valid)

    def nothing(self, arena: Arena) -> Shot:
        """An empty measurement."""
        black = np.zeros((self.camera.height, self.camera.width, 3), np.uint8)
        blank = np.zeros(black.shape[:2], np.float32)
        none, points = np.zeros(np.shape(arena.landmarks.x), np.float32), blank[::STRIDE, ::STRIDE].reshape(-1)
        return Shot(View(*(points,) * 4), Sightings(none, none, none, none > 0), black, blank)

    def view(self, disparity: Disparity, at: Mount, max_range: float) -> View:
        """Points of a disparity image, in the robot frame, for a robot that stands upright."""
        points = to_points(disparity, self.rig)
        first = STRIDE // 2
        height, width = disparity.value.shape
        x, y, z, weight = (v.reshape(height, width)[first::STRIDE, first::STRIDE].reshape(-1) for v in points)
        near = (weight > 0) & (x * x + y * y + z * z <= max_range**2)
        cos, sin = np.cos(at.pitch), np.sin(at.pitch)
        forward, left, up = at.forward + cos * z - sin * y, -x, at.height - sin * z - cos * y
        forward, left, up = (np.where(near, v, 0).astype(np.float32) for v in (forward, left, up))
        return View(forward, left, up, np.where(near, np.float32(STRIDE**2), np.float32(0)))

    def close(self) -> None:
        """Free the resources of the graphics driver."""
        self.renderer.close()
