"""Rendered stereo: what it measures, maps and locates, how close the ray-cast sensor comes to it, and how fast it is.

    python -m sweeps.benchmarks.stereo [--arenas 36] [--first 1000] [--views 10] [--missions 0] [--preset FILE]

Each line gives what is wanted after what was measured. Arenas are random ones of all families that no preset and no
threshold was fitted to; views are aimed at gates, bumps and obstacles from 25 to 80 cm. Intervals are at 95 %: of gates
by drawing arenas anew, since cells of one gate are right or wrong together. Times are CPU time and, after a slash, time
on the clock, of one measurement: what OpenCV's matcher takes stands apart from what is ours.
"""

from __future__ import annotations

import argparse
import contextlib
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from statsmodels.stats.proportion import proportion_confint

from jaxbiped.fitting.ray_sensor_fit import choices, eye, least_contrast, unmarked, watch_from
from jaxbiped.fitting.sensor_agreement import (
    AREA,
    Outcome,
    agreement,
    around,
    fused,
    looking,
    mission,
    same,
    score,
    setup_in,
    standing,
    with_rays,
    worlds,
)
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.localisation.kalman_filter import Belief, correct
from jaxbiped.mapping import Cell
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.sensor_rig import StereoRig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.presets import RayConfig
from jaxbiped.stereo import landmarks, matching
from jaxbiped.stereo.fit import quality, together

PRESET = Path(__file__).parents[2] / "configs" / "sensors" / "stereo.toml"
SEED, FIRST = 7, 1000  # of arenas that are in no fit
LOST = (0.03, 0.03, np.deg2rad(3))  # [m, m, rad] by which a robot is off before it sees landmarks
NEAR = 1.2  # [m]
REPEATS, AT_ONCE = 20, 2
DRAWS = 4000
OTHER_NOISE = 0x5BD1E995  # of another mission in the same arena
update = jax.jit(correct)


def matcher(places, rig, config) -> None:
    """Disparities of textured and of plain surfaces against the renderer's depth."""
    params = config.params("full")
    bare = [replace(place, arena=unmarked(place.arena)) for place in places]
    watched = [watch_from(place, n, rig, params, config) for place in bare for n in range(len(place.poses))]
    q = quality(together(watched))
    _, plain = least_contrast(places, rig, params, config)
    print(f"matcher   bias {q.bias:+.3f} px (wanted: below 0.1), {q.measured:.3f} of what both cameras see measured "
          f"(0.85), {q.wrong:.4f} of that beyond 1 px; {plain:.4f} of plain surfaces measured (none)")  # fmt: skip


def remembered(look):
    """The same, but each view is measured once."""
    seen = {}

    def again(place, pose, number):
        if (place.seed, number) not in seen:
            seen[place.seed, number] = look(place, pose, number)
        return seen[place.seed, number]

    return again


def maps(places, look, config) -> None:
    """Fused maps against the truth, within one cell; and bumps that a single view takes for floor."""
    found = [fused(place, look, config)[0] for place in places]
    rated = score(found, [place.classes for place in places])
    kinds = ", ".join(f"{kind} {rated.recall[kind]:.3f} {rated.precision[kind]:.3f}" for kind in rated.recall)
    print(f"maps      recall and precision: {kinds} (wanted: 0.95 0.90); {rated.right:.3f} of the cells right")
    gates(np.stack(found), np.stack([place.classes for place in places]))
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


def gates(found, true) -> None:
    """On how many cells the shares of gates rest, and how sure they are."""
    ours, theirs = found == Cell.GATE, (true == Cell.GATE) & (found != Cell.UNMEASURED)
    parts = theirs & around(ours), theirs, ours & around(true == Cell.GATE), ours
    rows = np.stack([part.sum((1, 2)) for part in parts], axis=1)
    drawn = rows[np.random.default_rng(0).integers(0, len(rows), (DRAWS, len(rows)))].sum(1)
    total, told = rows.sum(0), []
    for name, part in (("recall", 0), ("precision", 2)):
        low, high = np.quantile(drawn[:, part] / np.maximum(drawn[:, part + 1], 1), (0.025, 0.975))
        told.append(f"{name} {total[part]} of {total[part + 1]} cells [{low:.3f}, {high:.3f}]")
    count = int((true == Cell.GATE).any((1, 2)).sum())
    print(f"gates     in {count} of {len(true)} arenas: {', '.join(told)} (wanted: 0.95, 0.90)")


def poses(places, rig, config) -> None:
    """Poses of robots that are a little lost, after one view with two or more landmarks."""
    params, spec = config.params("full"), mission_spec(config, AREA)
    rng = np.random.default_rng(0)
    off, views = [], 0
    for place in places:
        setup = setup_in(place, params, spec)
        for n, pose in enumerate(place.poses):
            seed = jnp.asarray(place.seed, jnp.uint32)[None]
            world, agent = standing(setup, seed, pose, jnp.int32(n))
            error = rng.normal(0, LOST).astype(np.float32)
            lost = replace(pose, x=pose.x + error[0], y=pose.y + error[1], yaw=pose.yaw + error[2])
            lost = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], lost)
            _, found = rig.see(world, replace(agent, belief=replace(agent.belief, pose=lost)), setup)
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


def sensors(places, look, config) -> None:
    """The ray-cast sensor with the preset in the same places."""
    fitted = RayConfig(columns=config.camera.columns, rows=config.camera.rows)
    stereo = np.stack([fused(place, look, config)[0] for place in places])
    for rays in (fitted, *(few for few in choices(CameraConfig()) if few != fitted)):
        how = with_rays(config, rays)
        same_cells, measured = agreement(stereo, np.stack([fused(p, looking(how, None), how)[0] for p in places]))
        whose = "the preset's " if rays == fitted else ""
        print(f"sensors   {whose}{rays.columns} x {rays.rows} rays: {same_cells:.3f} of the fused cells are those of "
              f"stereo (wanted: 0.92), {measured:.3f} of those that both measured", flush=True)  # fmt: skip


def missions(places, config, first: int) -> None:
    """Whole missions with rendered pairs, with the ray-cast sensor, and with that and other noise.

    Args:
      first: number of the first arena.
    """
    cast = with_rays(config, RayConfig(columns=config.camera.columns, rows=config.camera.rows))
    seen, ours = by_pictures(places, config), [mission(p, cast, None) for p in places]
    again = [mission(replace(p, seed=p.seed ^ OTHER_NOISE), cast, None) for p in places]
    print(f"missions  {ending_alike(seen, ours)} end alike (wanted: 90%): code, distance and time")
    print(f"          {ending_alike(seen, ours, lost=False)} if distance and time count only of those that "
          "reach the goal")  # fmt: skip
    print(f"          {ending_alike(ours, again)} of the ray-cast ones as themselves with other noise; "
          f"{ending_alike(ours, again, lost=False)}")  # fmt: skip
    for k, pair in enumerate(zip(seen, ours, strict=True)):
        if not same(*pair):
            told = " and ".join(f"{o.code.label} {100 * o.distance:.0f} cm {o.time:.0f} s" for o in pair)
            print(f"          arena {first + k}: {told}")


def by_pictures(places, config) -> list[Outcome]:
    """Missions with rendered pairs, `AT_ONCE` of them at once: a thread each, and what it renders with."""

    def every(first: int) -> list[Outcome]:
        with contextlib.closing(StereoRig(config.camera)) as rig:
            return [mission(place, config, rig) for place in places[first::AT_ONCE]]

    ended: list = [None] * len(places)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for first, those in enumerate(pool.map(every, range(AT_ONCE))):
            ended[first::AT_ONCE] = those
    return ended


def ending_alike(first, second, lost: bool = True) -> str:
    """How many missions end as those of another list."""
    count, of = sum(same(*pair, lost) for pair in zip(first, second, strict=True)), len(first)
    low, high = proportion_confint(count, of, method="wilson")
    return f"{count} of {of} ({count / of:.1%} [{low:.1%}, {high:.1%}])"


def speed(place, rig, config) -> None:
    """Time of one measurement, by its parts."""
    sensor, params = rig.sensor, config.params("full")
    origin, basis, at, seed = eye(place, 0, params, config)
    sensor.show(place.arena)
    pair = sensor.renderer.pair(origin, basis, sensor.camera.image_noise, int(seed))
    grey = [matching.grey(image) for image in (pair.left, pair.right)]
    disparity = sensor.match(pair)
    believed, spread = place.poses[0], jax.device_get(params.landmarks)
    parts = {
        "rendering and noise": lambda: sensor.renderer.pair(origin, basis, sensor.camera.image_noise, 1),
        "OpenCV's matcher": lambda: matching.search(*grey, sensor.params),
        "second search": lambda: matching.search_slanted(*grey, sensor.params),
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
    whole, own = (
        spent["measuring in all"],
        spent["measuring in all"] - spent["OpenCV's matcher"] - spent["second search"],
    )
    print(f"speed     {1 / whole[1]:.1f} measurements a second of given pairs; but for both searches, ours is "
          f"{own[0] / whole[0]:.0%} of their CPU time")  # fmt: skip


def flight(places, config) -> None:
    """Measurements of missions that are played at once, a thread each, as a study plays them."""
    params, begin = config.params("full"), threading.Barrier(len(places) + 1)

    def measure(place) -> None:
        with contextlib.closing(StereoRig(config.camera)) as rig:
            origin, basis, at, seed = eye(place, 0, params, config)
            rest = at, place.poses[0], 2.0, jax.device_get(params.landmarks)
            rig.sensor(place.arena, origin, basis, *rest, seed)
            begin.wait()
            for n in range(REPEATS):
                rig.sensor(place.arena, origin, basis, *rest, n)

    threads = [threading.Thread(target=measure, args=(place,)) for place in places]
    for thread in threads:
        thread.start()
    begin.wait()
    start = time.process_time(), time.perf_counter()
    for thread in threads:
        thread.join()
    count = REPEATS * len(places)
    busy, passed = (time.process_time() - start[0]) / count, (time.perf_counter() - start[1]) / count
    print(f"speed     {len(places)} missions at once, rendered: {1 / passed:.1f} measurements a second (wanted: 10); "
          f"{1e3 * busy:.0f} ms of CPU time each, so that two free cores do {2 / busy:.1f}")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arenas", type=int, default=36, help="random arenas")
    parser.add_argument("--first", type=int, default=FIRST, help="number of the first of them")
    parser.add_argument("--views", type=int, default=10, help="views of each")
    parser.add_argument("--missions", type=int, default=0, help="missions of both sensors, an arena each")
    parser.add_argument(
        "--preset", default=PRESET, help="sensor file of the ray-cast sensor; what both expect of landmarks"
    )
    options = parser.parse_args()
    config = MissionConfig(sensor="stereo", preset=str(options.preset))
    with contextlib.closing(StereoRig(config.camera)) as rig:
        every = list(worlds(SEED, options.first, max(options.arenas, options.missions), options.views, config))
        places = every[: options.arenas]
        speed(places[0], rig, config)
        flight(places[:AT_ONCE], config)
        look = remembered(looking(config, rig))
        maps(places, look, config)
        matcher(places, rig, config)
        poses(places, rig, config)
        sensors(places, look, config)
    if options.missions:
        missions(every[: options.missions], config, options.first)


if __name__ == "__main__":
    main()
