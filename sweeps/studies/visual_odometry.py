"""How well pictures tell a robot's own motion: rendered pairs of views of random arenas, a command apart.

    python -m sweeps.studies.visual_odometry [--arenas N] [--views N] [--seed N]

Printed are the errors of the motion that `stereo.tracking` finds, for each kind of command, how often it finds
one, and the errors as multiples of what it claims; then the figures of `sensing.motion.VisualConfig` that fit them:
errors times the square root of the share of the image that both views measure.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from jaxbiped.fitting.sensor_agreement import Place, worlds
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.params import MissionConfig
from jaxbiped.sensing.camera import MountedCamera, mount, placed
from jaxbiped.sensing.config import VisualConfig
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.motion import SHARE, overlap
from jaxbiped.sensing.noise import attitude_error
from jaxbiped.sensing.view import View
from jaxbiped.stereo.matching import grey
from jaxbiped.stereo.measure import StereoSensor
from jaxbiped.stereo.tracking import find_features, find_motion


@dataclass(frozen=True)
class Command:
    """What a robot does between two views."""

    name: str
    turn: float  # [rad]
    length: float  # [m] after it
    look: tuple[bool, bool] = (False, False)  # down, at the two views


COMMANDS = (
    Command("straight", 0.0, 0.05),
    Command("diagonal", 0.0, 0.05 * np.sqrt(2)),
    Command("left 45", np.pi / 4, 0.05 * np.sqrt(2)),
    Command("right 45", -np.pi / 4, 0.05 * np.sqrt(2)),
    Command("left 90", np.pi / 2, 0.05),
    Command("right 90", -np.pi / 2, 0.0),
    Command("to the feet", 0.0, 0.05, (False, True)),
    Command("from the feet", 0.0, 0.05, (True, False)),
)


@dataclass(frozen=True)
class Trial:
    """One pair of views."""

    command: str
    share: float  # of the image that both views measure
    seen: bool
    error: np.ndarray  # [3] (m, m, rad)
    claimed: float  # squared error by what was claimed
    seconds: float  # CPU time of finding features in one view, and the motion


def after(pose: Pose, command: Command, rng: np.random.Generator) -> tuple[Pose, np.ndarray]:
    """Where a command leads, nearly, and the motion (x, y, yaw)."""
    turn = command.turn + rng.normal(0, 0.02)
    x, y = command.length * np.cos(turn) + rng.normal(0, 0.003), command.length * np.sin(turn) + rng.normal(0, 0.003)
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    moved = Pose(pose.x + cos * x - sin * y, pose.y + sin * x + cos * y, pose.z, pose.yaw + turn)
    return jax.tree.map(np.float32, moved), np.array([x, y, turn])


def trial(place: Place, pose: Pose, number: int, sensor: StereoSensor, config: MissionConfig) -> Trial:
    """Two views of one arena, a command apart."""
    rng = np.random.default_rng([place.seed, number])
    command = COMMANDS[number % len(COMMANDS)]
    second, true = after(pose, command, rng)
    camera, noise = config.camera.traced(), config.stereo.traced()
    found, view, seconds = [], None, 0.0
    sensor.show(place.arena)
    for k, (stand, look) in enumerate(zip((pose, second), command.look, strict=True)):
        at = jax.device_get(mount(camera, look))
        tilt = attitude_error(noise, fold(jnp.uint32(place.seed), 2 * number + k))
        origin, basis = jax.device_get(placed(jax.tree.map(jnp.float32, stand), at, *tilt))
        pair = sensor.renderer.pair(origin, basis, config.camera.image_noise, 2 * number + k)
        disparity = sensor.match(pair)
        view = sensor.view(disparity, at, float(noise.max_range))
        begun = time.process_time()
        found.append(find_features(grey(pair.left), disparity.value, sensor.rig, at))
        seconds = time.process_time() - begun
    begun = time.process_time()
    nominal = np.array([command.length * np.cos(command.turn), command.length * np.sin(command.turn), command.turn])
    motion = find_motion(*found, sensor.rig, nominal)
    seconds += time.process_time() - begun
    error = np.array([motion.x, motion.y, motion.yaw], float) - true
    claimed = float(error @ np.linalg.solve(motion.cov.astype(float), error)) if motion.seen else np.nan
    eye = MountedCamera(camera, mount(camera, command.look[0]), config.camera.image)
    view, stands = View(*(jnp.asarray(v) for v in (view.x, view.y, view.z, view.weight))), (second, pose)
    stands = (jax.tree.map(jnp.float32, stand) for stand in stands)
    share = float(shared(view, *stands, eye, noise.max_range))
    return Trial(command.name, share, bool(motion.seen), error, claimed, seconds)


shared = jax.jit(overlap)


def main(arenas: int = 24, views: int = 16, seed: int = 2) -> None:
    """Look at `arenas` random arenas from `views` places each."""
    config = MissionConfig(sensor="stereo", localisation="visual")
    with contextlib.closing(StereoSensor(config.camera)) as sensor:
        trials = [
            trial(place, pose, number, sensor, config)
            for place in worlds(seed, 0, arenas, views, config)
            for number, pose in enumerate(place.poses)
        ]
    table = Table("command", "pairs", "found", "in both", "x", "y", "yaw", "95 % of x", "y", "yaw", "claimed")
    for name in [*(command.name for command in COMMANDS), "all"]:
        some = [t for t in trials if name in (t.command, "all")]
        seen = [t for t in some if t.seen]
        error = np.abs([t.error for t in seen]).reshape(-1, 3) * [1e3, 1e3, 180 / np.pi]
        units = "mm", "mm", "deg"
        percentiles = np.percentile(error, (50, 95), axis=0)
        row = [f"{value:.2f} {unit}" for values in percentiles for value, unit in zip(values, units, strict=True)]
        share = f"{np.median([t.share for t in some]):.2f}"
        root = f"{np.sqrt(np.mean([t.claimed for t in seen]) / 3):.2f}"
        table.add_row(name, str(len(some)), f"{len(seen) / len(some):.1%}", share, *row, root)
    console = Console(width=140)
    console.print(table)
    fit(trials, console)
    print(f"CPU time   {1e3 * np.median([t.seconds for t in trials]):.0f} ms a view, beside matching")


def fit(trials: list[Trial], console: Console) -> None:
    """Print what the model of the ray-cast sensor should say."""
    least = VisualConfig().least_share
    for low, high in ((0, least), (least, 0.05), (0.05, 0.1), (0.1, 0.2), (0.2, 0.4), (0.4, 1.0)):
        some = [t for t in trials if low <= t.share < high]
        seen = np.array([t.error for t in some if t.seen]).reshape(-1, 3)
        spread = np.sqrt(np.mean(seen**2, axis=0)) if len(seen) else np.full(3, np.nan)
        x, y, yaw = 1e3 * spread[0], 1e3 * spread[1], np.rad2deg(spread[2])
        told = f"in both {low:.2f} to {high:.2f}: {len(some)} pairs, {len(seen)} found, root mean square "
        console.print(told + f"{x:.2f} and {y:.2f} mm, {yaw:.3f} deg")
    enough = [t for t in trials if t.share >= least]
    scaled = np.array([t.error * np.sqrt(t.share / SHARE) for t in enough if t.seen])
    x, y, yaw = np.sqrt(np.mean(scaled**2, axis=0))
    lost = np.mean([not t.seen for t in enough])
    console.print(f"model      forward {x:.5f}, left {y:.5f}, yaw {np.rad2deg(yaw):.3f}, least_share {least:g}, "
                  f"failure {lost:.3f}")  # fmt: skip


if __name__ == "__main__":
    tyro.cli(main)
