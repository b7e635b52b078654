"""Rendered stereo: what it measures, maps and locates, how close the ray-cast sensor comes to it, and how fast it is.

    python sweeps/bench_stereo.py [--arenas 12] [--views 10] [--missions 0] [--preset configs/sensors/stereo.toml]

Each line gives what is wanted after what was measured. Arenas are random ones of all families that no preset was fitted
to; views are aimed at gates, bumps and obstacles from 25 to 80 cm. Times are CPU time and, after a slash, time on the
clock, of one measurement: what OpenCV's matcher takes stands apart from what is ours.
"""

from __future__ import annotations

import argparse
import contextlib
import time
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.mapping import Cell
from jaxbiped.mission.eyes import StereoEyes
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.sensing.camera import CameraConfig
from jaxbiped.sensing.localisation import Belief, correct
from jaxbiped.sensing.presets import sensor_preset
from jaxbiped.sensing.stereo import landmarks, matching
from jaxbiped.sensing.stereo.fit import quality, together
from jaxbiped.study.fitting import eye, least_contrast, unmarked, watch_from
from jaxbiped.study.sensors import AREA, around, fused, looking, mission, same, score, standing, worlds

PRESET = Path(__file__).parents[1] / "configs" / "sensors" / "stereo.toml"
SEED, FIRST = 7, 1000  # of arenas that are in no fit
LOST = (0.03, 0.03, np.deg2rad(3))  # [m, m, rad] by which a robot is off before it sees landmarks
NEAR = 1.2  # [m]
REPEATS = 20
update = jax.jit(correct)


def matcher(places, eyes, config) -> None:
    """Disparities of textured and of plain surfaces against the renderer's depth."""
    settings = config.settings("full")
    bare = [replace(place, arena=unmarked(place.arena)) for place in places]
    watched = [watch_from(place, n, eyes, settings, config) for place in bare for n in range(len(place.poses))]
    q = quality(together(watched))
    _, plain = least_contrast(places, eyes, settings, config)
    print(f"matcher   bias {q.bias:+.3f} px (wanted: below 0.1), {q.measured:.3f} of what both cameras see measured "
          f"(0.85), {q.wrong:.4f} of that beyond 1 px; {plain:.4f} of plain surfaces measured (none)")  # fmt: skip


def maps(places, eyes, config) -> None:
    """Fused maps against the truth, within one cell; and bumps that a single view takes for floor."""
    look = looking(config, eyes)
    found = [fused(place, look, config)[0] for place in places]
    rated = score(found, [place.classes for place in places])
    kinds = ", ".join(f"{kind} {rated.recall[kind]:.3f} {rated.precision[kind]:.3f}" for kind in rated.recall)
    print(f"maps      recall and precision: {kinds} (wanted: 0.95 0.90); {rated.right:.3f} of the cells right")
    seen, missed, bad = 0, 0, []
    for k, place in enumerate(places):
        low = place.levels > 0
        sure = low & (place.classes == Cell.BUMP) & ~around(~low[None])[0]  # not at a rim
        for n, pose in enumerate(place.poses):
            classes, _ = fused(replace(place, poses=(pose,)), lambda w, p, _, n=n: look(w, p, n), config)
            rows, columns = np.indices(classes.shape)
            away = np.hypot((columns + 0.5) * config.pitch - pose.x, (rows + 0.5) * config.pitch - pose.y)
            there = sure & (away < NEAR) & (classes != Cell.UNMEASURED)
            seen += int(there.sum())
            floor = there & (classes == Cell.FLOOR)
            missed += int(floor.sum())
            bad += [f"arena {k} view {n}"] * bool(floor.any())
    where = f" in {', '.join(bad)}" if bad else ""
    print(f"bumps     {missed} of {seen} bump cells within {NEAR} m are floor in a single view (wanted: 0){where}")


def poses(places, eyes, config) -> None:
    """Poses of robots that are a little lost, after one view with two or more landmarks."""
    settings, static = config.settings("full"), program(config, AREA)
    rng = np.random.default_rng(0)
    off, views = [], 0
    for place in places:
        batch = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (place.arena, settings))
        for n, pose in enumerate(place.poses):
            seed = jnp.asarray(place.seed, jnp.uint32)[None]
            world, mind = standing(*batch, seed, pose, jnp.int32(n), static)
            error = rng.normal(0, LOST).astype(np.float32)
            lost = replace(pose, x=pose.x + error[0], y=pose.y + error[1], yaw=pose.yaw + error[2])
            lost = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], lost)
            _, found = eyes.see(world, replace(mind, belief=replace(mind.belief, pose=lost)), *batch)
            views += 1
            if found.seen.sum() >= 2:
                belief = Belief(jax.tree.map(lambda leaf: leaf[0], lost), jnp.diag(jnp.square(jnp.array(LOST))))
                after = update(belief, place.arena.landmarks, jax.tree.map(lambda leaf: leaf[0], found)).pose
                off.append((np.hypot(after.x - pose.x, after.y - pose.y), abs(wrap_angle(after.yaw - pose.yaw))))
    if not off:
        print("pose      no view shows two landmarks")
        return
    middle, most = (np.quantile(off, q, axis=0) * (1e3, np.rad2deg(1)) for q in (0.5, 0.95))
    print(f"pose      {len(off)} of {views} views show two landmarks: median {middle[0]:.1f} mm {middle[1]:.2f} deg "
          f"(wanted: 3, 0.3), 95 % within {most[0]:.1f} mm {most[1]:.2f} deg (15, 1.5)")  # fmt: skip


def sensors(places, eyes, config, missions) -> None:
    """The ray-cast sensor with the preset in the same places, and in whole missions."""
    cast = config.model_copy(update={"sensor": "raycast"})
    fine = cast.model_copy(update={"camera": CameraConfig(columns=128, rows=96)})
    each = ("stereo", config, eyes), ("64 x 48", cast, None), ("128 x 96", fine, None)
    made = {name: np.stack([fused(place, looking(how, sees), how)[0] for place in places]) for name, how, sees in each}
    for name in ("64 x 48", "128 x 96"):
        both = (made["stereo"] != Cell.UNMEASURED) & (made[name] != Cell.UNMEASURED)
        equal = made["stereo"] == made[name]
        print(f"sensors   {name} rays: {equal.mean():.3f} of the fused cells are those of stereo (wanted: 0.92), "
              f"{equal[both].mean():.3f} of those that both measured")  # fmt: skip
    if missions:
        alike = sum(same(mission(p, config, eyes), mission(p, cast, None)) for p in places[:missions])
        print(f"missions  {alike} of {missions} end alike (wanted: 90 %)")


def speed(place, eyes, config) -> None:
    """Time of one measurement, by its parts."""
    sensor, settings = eyes.sensor, config.settings("full")
    origin, basis, at, seed = eye(place, 0, settings, config)
    sensor.show(place.arena)
    pair = sensor.renderer.pair(origin, basis, sensor.camera.image_noise, int(seed))
    grey = [matching.grey(image) for image in (pair.left, pair.right)]
    disparity = sensor.match(pair)
    believed, spread = place.poses[0], jax.device_get(settings.landmarks)
    parts = {
        "rendering and noise": lambda: sensor.renderer.pair(origin, basis, sensor.camera.image_noise, 1),
        "OpenCV's matcher": lambda: matching.search(*grey, sensor.params),
        "matching in all": lambda: sensor.match(pair),
        "landmarks": lambda: landmarks.find(pair.left, pair.right, sensor.rig, at, 0.0),
        "points": lambda: sensor.view(disparity, at, 2.0),
        "measuring in all": lambda: sensor.measure(pair, place.arena, at, believed, 2.0, spread),
    }
    spent = {}
    for name, part in parts.items():
        part()
        clocks = []
        for _ in range(REPEATS):
            start = time.process_time(), time.perf_counter()
            part()
            clocks.append((time.process_time() - start[0], time.perf_counter() - start[1]))
        spent[name] = np.median(clocks, axis=0)
        print(f"speed     {name}: {1e3 * spent[name][0]:.0f} / {1e3 * spent[name][1]:.0f} ms")
    whole, own = spent["measuring in all"], spent["measuring in all"] - spent["OpenCV's matcher"]
    rendered = whole + spent["rendering and noise"]
    print(f"speed     {1 / whole[1]:.1f} measurements a second of given pairs (wanted: 10), {1 / rendered[1]:.1f} with "
          f"rendering; of a measurement, ours is {own[0] / whole[0]:.0%} of the CPU time")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arenas", type=int, default=12, help="random arenas")
    parser.add_argument("--views", type=int, default=10, help="views of each")
    parser.add_argument("--missions", type=int, default=0, help="missions of both sensors, at most one an arena")
    parser.add_argument(
        "--preset", default=PRESET, help="sensor file of the ray-cast sensor; what both expect of landmarks"
    )
    options = parser.parse_args()
    known = sensor_preset(str(options.preset))
    config = MissionConfig(sensor="stereo", stereo=known.stereo, landmarks=known.landmarks)
    with contextlib.closing(StereoEyes(config.camera)) as eyes:
        places = list(worlds(SEED, FIRST, options.arenas, options.views, config))
        speed(places[0], eyes, config)
        matcher(places, eyes, config)
        maps(places, eyes, config)
        poses(places, eyes, config)
        sensors(places, eyes, config, min(options.missions, len(places)))


if __name__ == "__main__":
    main()
