"""An arena for rendering: a MuJoCo model of textured boxes, a floor, and landmarks on it.

Each face carries several octaves of noise, one millimetre per texel, with its own offset, so that no two places look
alike; surfaces with low contrast in the arena have low contrast here. MuJoCo cannot scale a texture per face on its
boxes, hence meshes with texture coordinates in metres.
"""

from __future__ import annotations

import functools

import jax
import mujoco
import numpy as np
from jaxtyping import Float, Float64, UInt8

from jaxbiped.arenas.arena import CIRCLE, DISC_RADIUS, SQUARE_SIDE, Arena

TEXELS = 1024  # of a texture, across and down
TEXEL = 0.001  # [m]
OCTAVES = 6  # of noise, from one texel to 2^5
GREY, SPREAD = 128.0, 45.0  # mean and, at full contrast, standard deviation of a texture, in grey levels
SHADES = 16  # steps of contrast; one texture each
FLOOR_DEPTH = 0.05  # [m] depth of the floor's body
PRINT = 0.0001  # [m] thickness of a landmark
FLOOR_TINT, BOX_TINT = (1.0, 0.98, 0.94, 1.0), (0.92, 0.97, 1.0, 1.0)
RED, BLUE = (0.85, 0.06, 0.06, 1.0), (0.06, 0.16, 0.85, 1.0)
SLICES = 180  # sides of the polygon that represents a disc, accurate to 0.02 mm
SUN, AMBIENT, DIFFUSE = (0.35, 0.25, -1.0), 0.55, 0.45  # light from behind the start, equal on all sides
SKY = (0.80, 0.86, 0.92)

# Faces of a box: outward axis, its sign, and the two axes of the texture.
FACES = ((0, 1, 1, 2), (0, -1, 1, 2), (1, 1, 0, 2), (1, -1, 0, 2), (2, 1, 0, 1), (2, -1, 0, 1))


def arena_model(arena: Arena) -> mujoco.MjModel:
    """The model of one arena (no batch axis), without motion and contacts.

    Args:
      arena: contrasts are rounded to `1 / SHADES`.
    """
    arena = jax.device_get(arena)
    spec = mujoco.MjSpec()
    spec.visual.quality.numslices = SLICES
    spec.visual.headlight.active = 0
    light = spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, dir=SUN, castshadow=False)
    light.ambient, light.diffuse, light.specular = (AMBIENT,) * 3, (DIFFUSE,) * 3, (0.0,) * 3
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=SKY, rgb2=SKY, width=16, height=16,
    )  # fmt: skip
    half = arena.size_xy.astype(float) / 2
    middle = np.array([half[0], half[1], -FLOOR_DEPTH / 2])
    add_box(
        spec, 0, middle, 0.0, np.array([half[0], half[1], FLOOR_DEPTH / 2]), float(arena.floor_contrast), FLOOR_TINT
    )
    boxes = arena.boxes
    for m in np.flatnonzero(boxes.used):
        middle = np.array([boxes.x[m], boxes.y[m], (boxes.bottom[m] + boxes.top[m]) / 2], float)
        sizes = np.array([boxes.half_x[m], boxes.half_y[m], (boxes.top[m] - boxes.bottom[m]) / 2], float)
        add_box(spec, m + 1, middle, float(boxes.yaw[m]), sizes, float(boxes.contrast[m]), BOX_TINT)
    add_landmarks(spec, arena.landmarks)
    return spec.compile()


def add_box(
    spec: mujoco.MjSpec,
    number: int | np.integer,
    middle: Float64[np.ndarray, "3"],
    yaw: float,
    half: Float64[np.ndarray, "3"],
    contrast: float,
    tint: tuple[float, float, float, float],
) -> None:
    """A textured box; `number` names it and selects the texture offset of its faces."""
    shade = round(np.clip(contrast, 0, 1) * SHADES)
    material = f"shade_{shade}_{tint}"
    if spec.material(material) is None:
        if spec.texture(f"shade_{shade}") is None:
            texture = spec.add_texture(name=f"shade_{shade}", type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
            texture.width = texture.height = TEXELS
            texture.data = texels(shade).tobytes()
        spec.add_material(name=material, rgba=tint).textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = f"shade_{shade}"
    vertices, normals, coordinates, faces = [], [], [], []
    shift = np.random.default_rng(number).uniform(0, 1, (len(FACES), 2))
    for k, (axis, sign, u, v) in enumerate(FACES):
        corners = np.zeros((4, 3))
        corners[:, axis] = sign * half[axis]
        corners[:, u], corners[:, v] = half[u] * np.array([-1, 1, 1, -1]), half[v] * np.array([-1, -1, 1, 1])
        normal = np.zeros(3)
        normal[axis] = sign
        outward = np.cross(corners[1] - corners[0], corners[2] - corners[0])[axis] * sign > 0
        order = (0, 1, 2, 3) if outward else (0, 3, 2, 1)
        vertices.append(corners)
        normals.append(np.tile(normal, (4, 1)))
        coordinates.append(corners[:, [u, v]] / (TEXEL * TEXELS) + shift[k])
        faces += [[4 * k + order[0], 4 * k + order[i], 4 * k + order[i + 1]] for i in (1, 2)]
    mesh = spec.add_mesh(name=f"box_{number}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.usernormal = np.concatenate(vertices).ravel(), np.concatenate(normals).ravel()
    mesh.usertexcoord, mesh.userface = np.concatenate(coordinates).ravel(), np.ravel(faces)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"box_{number}", material=material, pos=middle,
        quat=about_z(yaw), contype=0, conaffinity=0,
    )  # fmt: skip


def add_landmarks(spec: mujoco.MjSpec, marks) -> None:
    """Red discs and blue squares on the floor."""
    side = SQUARE_SIDE / 2
    for n in np.flatnonzero(marks.used):
        disc = marks.kind[n] == CIRCLE
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER if disc else mujoco.mjtGeom.mjGEOM_BOX,
            size=(DISC_RADIUS, PRINT / 2, 0) if disc else (side, side, PRINT / 2),
            pos=(marks.x[n], marks.y[n], PRINT / 2), quat=about_z(float(marks.yaw[n])), rgba=RED if disc else BLUE,
            contype=0, conaffinity=0,
        )  # fmt: skip


def about_z(yaw: float) -> tuple[float, float, float, float]:
    """A quaternion."""
    return float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2))


@functools.lru_cache(maxsize=SHADES + 1)
def texels(shade: int) -> UInt8[np.ndarray, "n n 3"]:
    """The texture with a contrast of shade / SHADES."""
    grey = GREY + SPREAD * shade / SHADES * octaves()
    return np.repeat(np.clip(np.round(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@functools.lru_cache(maxsize=1)
def octaves() -> Float[np.ndarray, "n n"]:
    """Noise of mean 0 and standard deviation 1 that continues seamlessly over its borders; the same in every process.

    Octaves of equal strength: at any distance, there is detail of a few pixels.
    """
    rng = np.random.default_rng(0)
    frequency = np.hypot(np.fft.fftfreq(TEXELS)[:, None], np.fft.rfftfreq(TEXELS)[None, :])
    total = np.zeros((TEXELS, TEXELS))
    for octave in range(OCTAVES):
        white = np.fft.rfft2(rng.standard_normal((TEXELS, TEXELS)))
        middle = 0.35 / 2**octave
        band = np.fft.irfft2(white * np.exp(-(np.log(np.maximum(frequency, 1e-9) / middle) ** 2) / (2 * 0.35**2)))
        total += band / band.std()
    return (total / total.std()).astype(np.float32)
