"""All measurements that `jaxbiped fit-sensor` makes of a rendered stereo camera, and the resulting sensor file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.arenas.arena import Arena
from jaxbiped.config import field_docs
from jaxbiped.fitting.sensor_agreement import AREA, Place, agreement, fused, looking, setup_in, standing, with_rays
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.params import MissionConfig, MissionParams, mission_spec
from jaxbiped.mission.sensor_rig import StereoRig, where
from jaxbiped.sensing.camera import Mount
from jaxbiped.sensing.config import CameraConfig, LandmarkConfig
from jaxbiped.sensing.landmarks import sight
from jaxbiped.sensing.presets import RayConfig, SensorConfig
from jaxbiped.stereo.fit import Quality, Watched, fit_noise, quality, share, together, watch
from jaxbiped.stereo.landmark_fit import Sight, fit_landmarks

CONTRASTS = (0.0, 0.0625, 0.125, 0.1875, 0.25, 0.375, 0.5)  # where the lowest one that can be matched is searched
CONTRAST_PLACES, CONTRAST_VIEWS = 3, 2
# Multiples of the camera's columns, and thirds of its rows: far cells are low in a picture.
MORE_RAYS = (1, 3), (1, 4), (2, 6), (2, 8), (4, 12)
# Required share of cells that equal those of rendered pairs, which repeat 0.99 of them with other noise. Maps that
# share 0.92 still differ at edges that few rays hit, and so do their missions (`sweeps/benchmarks/stereo.py`).
ALIKE = 0.975
NEVER_FURTHER = LandmarkConfig(sd=0, sd_per_metre=0, nearest=0, furthest_circle=100, furthest_square=100)


@dataclass(frozen=True)
class Fit:
    """A sensor file, and the measurements it was fitted to."""

    sensor: SensorConfig
    quality: Quality  # of the matcher, on textured surfaces
    plain: float  # share of untextured surfaces, without their rims, that is matched
    sights: tuple[Sight, ...]  # landmarks
    views: int
    same: float  # share of the fused cells on which the fitted ray-cast sensor agrees with rendered pairs


def fit(places: Sequence[Place], rig: StereoRig, config: MissionConfig, tell: Callable[[], None] = lambda: None) -> Fit:
    """Evaluate the matcher and the landmark detector in all places, and fit the models of both.

    Args:
      config: config of the missions; its own noise is the base, for what cannot be measured in pictures.
      tell: called after each view.
    """
    params = config.params("full")
    watched, sights, count = [], [], 0
    for place in places:
        count += len(place.poses)
        sights += [one for n in range(len(place.poses)) for one in landmarks_of(place, n, rig, params, config)]
        bare = replace(place, arena=unmarked(place.arena))
        for n in range(len(place.poses)):
            watched.append(watch_from(bare, n, rig, params, config))
            tell()
    least, plain = least_contrast(places, rig, params, config)
    seen = together(watched)
    stereo = fit_noise(seen, config.stereo).model_copy(update={"min_contrast": round(least, 4)})
    marks = fit_landmarks(sights, config.landmarks)
    cast, same = fewest_rays(places, rig, config.model_copy(update={"stereo": stereo, "landmarks": marks}))
    return Fit(
        SensorConfig(stereo=stereo, landmarks=marks, rays=cast), quality(seen), plain, tuple(sights), count, same
    )


def choices(camera: CameraConfig) -> list[RayConfig]:
    """Numbers of rays that divide a camera's picture, fewest first: its own, and `MORE_RAYS`."""
    several = [(camera.columns * across, camera.rows * thirds // 3) for across, thirds in MORE_RAYS]
    return [
        RayConfig(columns=columns, rows=rows)
        for columns, rows in several
        if camera.width % columns == camera.height % rows == 0
    ]


def fewest_rays(places: Sequence[Place], rig: StereoRig, config: MissionConfig) -> tuple[RayConfig, float]:
    """The fewest rays with which `ALIKE` of the cells agree with rendered pairs (else the most), and their share.

    Args:
      config: config of the missions that see rendered pairs, with the fitted noise.
    """
    stereo = np.stack([fused(place, looking(config, rig), config)[0] for place in places])
    for rays in choices(config.camera):
        how = with_rays(config, rays)
        same, _ = agreement(stereo, np.stack([fused(place, looking(how, None), how)[0] for place in places]))
        if same >= ALIKE:
            break
    return rays, same


def eye(
    place: Place, number: int, params: MissionParams, config: MissionConfig
) -> tuple[np.ndarray, np.ndarray, Mount, int]:
    """The true and the believed camera pose in view `number` of a place, and the view's seed."""
    setup = setup_in(place, params, mission_spec(config, AREA))
    seed = jnp.asarray(place.seed, jnp.uint32)[None]
    world, agent = standing(setup, seed, place.poses[number], jnp.int32(number))
    seen_from = jax.device_get(where(world, agent, setup.params, None))
    origin, basis, at, drawn = jax.tree.map(lambda leaf: leaf[0], seen_from)
    return origin, basis, at, int(drawn)


def watch_from(place: Place, number: int, rig: StereoRig, params: MissionParams, config: MissionConfig) -> Watched:
    """Evaluate the matcher in one view."""
    origin, basis, _, seed = eye(place, number, params, config)
    rig.sensor.show(place.arena)
    return watch(rig.sensor, origin, basis, int(seed))


def landmarks_of(
    place: Place, number: int, rig: StereoRig, params: MissionParams, config: MissionConfig
) -> list[Sight]:
    """Landmarks in view of both cameras, found or not."""
    pose = place.poses[number]
    setup = setup_in(place, params, mission_spec(config, AREA))
    seed = jnp.asarray(place.seed, jnp.uint32)[None]
    world, agent = standing(setup, seed, pose, jnp.int32(number))
    _, found = rig.see(world, agent, setup)
    there = in_view(place.arena, pose, params, config)
    sights = []
    for n in np.flatnonzero(there.seen):
        x, y = float(there.x[n]), float(there.y[n])
        error = (float(found.x[0, n]) - x, float(found.y[0, n]) - y) if found.seen[0, n] else None
        sights.append(Sight(int(place.arena.landmarks.kind[n]), float(np.hypot(x, y)), error))
    return sights


def in_view(arena: Arena, pose: Pose, params: MissionParams, config: MissionConfig):
    """Landmarks whose centres both cameras see, at any range."""
    return jax.device_get(
        sight_all(arena, pose, params.camera, NEVER_FURTHER.traced(), config.camera.image, jnp.uint32(0))
    )


sight_all = jax.jit(sight, static_argnames=("image",))


def least_contrast(
    places: Sequence[Place], rig: StereoRig, params: MissionParams, config: MissionConfig
) -> tuple[float, float]:
    """Contrast at which half as much is measured as at `CONTRASTS[-1]`; and the share that is measured at none."""
    shares = []
    for contrast in CONTRASTS:
        seen = []
        for place in places[:CONTRAST_PLACES]:
            bare = unmarked(place.arena)
            even = replace(
                bare,
                boxes=replace(bare.boxes, contrast=np.full_like(bare.boxes.contrast, contrast)),
                floor_contrast=np.float32(contrast),
            )
            for n in range(min(CONTRAST_VIEWS, len(place.poses))):
                seen.append(watch_from(replace(place, arena=even), n, rig, params, config))
        w = together(seen)
        shares.append(share(w.found > 0, w.common & ~w.near & w.inner))
    risen = np.maximum.accumulate(shares) + 1e-9 * np.arange(len(shares))
    return float(np.interp(0.5 * risen[-1], risen, CONTRASTS)), shares[0]


def unmarked(arena: Arena) -> Arena:
    """An arena without landmarks, which are untextured."""
    return replace(arena, landmarks=replace(arena.landmarks, used=np.zeros_like(arena.landmarks.used)))


def sensor_toml(fit: Fit, heading: Sequence[str]) -> str:
    """A sensor file, with the meaning of each number."""
    lines = [f"# {line}" for line in heading]
    for name in ("stereo", "landmarks", "rays"):
        part, docs = getattr(fit.sensor, name), field_docs(type(getattr(fit.sensor, name)))
        lines += ["", f"[{name}]"]
        known = part.model_dump(exclude_none=True)
        values = {field: f"{field} = {value if name == 'rays' else float(value)!r}" for field, value in known.items()}
        width = max(map(len, values.values())) + 2
        lines += [f"{text:<{width}}# {docs[field]}" for field, text in values.items()]
    return "\n".join(lines) + "\n"
