"""A movement as a score: phases in time, and in each phase which channels move by how much."""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.request import Request

PHASES, RAMPS = 32, 96  # static sizes: enough for six pairs of steps
FEET = tuple(f"{side}_{c}" for side in ("left", "right") for c in ("x", "y", "z", "yaw"))
CHANNELS = ("zmp_x", "zmp_y", "load", "hip", *FEET)
CLEARANCE = 0.015  # [m] clearance of a swinging foot above the higher of the two grounds
SLACK = 0.006  # [m] distance of the stretched leg from straight
SHORTEST_REST = 0.30  # [s] twice the pendulum's time constant: the centre of mass is at rest at both ends


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Score:
    """Every channel is the sum of minimum-jerk ramps, each within a part of one phase; unused rows are zero."""

    durations: Float[Array, "P"]  # [s] of the phases
    start: Float[Array, "C"]  # values of CHANNELS at time 0
    phase: Float[Array, "R"]  # phase index of each ramp
    window: Float[Array, "R 2"]  # fractions of that phase at which it starts and ends
    delta: Float[Array, "R C"]  # change of each channel
    swing: Float[Array, "P 2"]  # 1 where the left, the right foot is in the air


class Composer:
    """Writes a score phase by phase, keeping track of feet, hips and zero moment point."""

    def __init__(self, start: dict[str, float]):
        self.start, self.now = dict(start), dict(start)
        self.names: list[str] = []
        self.weights: list[float] = []
        self.swing: list[tuple[int, int]] = []
        self.ramps: list[tuple[int, float, float, dict[str, float]]] = []

    def phase(self, name: str, weight: float, swing: tuple[int, int] = (0, 0)) -> None:
        """Begin a phase; `weight` is its share of the time."""
        self.names.append(name)
        self.weights.append(weight)
        self.swing.append(swing)

    def to(self, window: tuple[float, float] = (0.0, 1.0), **targets: float) -> None:
        """Move channels to values, within a part of the phase."""
        moved = {name: value - self.now[name] for name, value in targets.items()}
        self.ramps.append((len(self.names) - 1, *window, moved))
        self.now.update(targets)

    def score(self, durations: np.ndarray) -> Score:
        """The score, padded to static sizes. Too many phases or ramps are a programming error."""
        P, R, C = PHASES, RAMPS, len(CHANNELS)
        padded, swing = np.zeros(P), np.zeros((P, 2))
        padded[: len(durations)], swing[: len(self.swing)] = durations, self.swing
        phase, window, delta = np.zeros(R), np.tile([0.0, 1.0], (R, 1)), np.zeros((R, C))
        for r, (index, begin, end, moved) in enumerate(self.ramps):
            phase[r], window[r] = index, (begin, end)
            for name, value in moved.items():
                delta[r, CHANNELS.index(name)] = value
        start = np.array([self.start[name] for name in CHANNELS])
        return Score(*(jnp.asarray(v, jnp.float32) for v in (padded, start, phase, window, delta, swing)))


def compose(request: Request, robot: RobotModelConfig) -> Composer:
    """The phases of a request: rest, then pairs of steps (shift, swing, shift, swing), shift to the middle, rest.

    The foot on the side of the motion steps first: the left one for forward, left and left turns. Heights of the hips
    change while the zero moment point rests. A rising foot is up before it moves ahead, a falling one is ahead before
    it moves down, so that neither touches the edge.
    """
    stance, offset = robot.stance, robot.proportions.hip_offset
    upright = {False: stance.standing, True: stance.squatting}
    begin, end = upright[request.squat_start], upright[request.squat_end]
    low = min(0.0, request.rise)
    inward = stance.inward_climbing if request.rise else stance.inward
    lean = math.copysign(request.lean, request.rise)
    walk = hip_height(request, robot)
    pairs = request.pairs
    song = Composer(_home(begin, offset))
    if pairs == 0:
        song.phase("rest", 0.3)
        song.phase("bend", 1.0)
        song.to(hip=end)
        song.phase("rest", 0.3)
        return song

    song.phase("rest", 0.4 + abs(walk + low - begin) / 0.06)
    song.to(hip=walk + low)
    first = "right" if request.left < 0 or (request.left == 0 and request.turn < 0) else "left"
    sides = (first, "right" if first == "left" else "left")
    for k in range(1, pairs + 1):
        rise = request.rise * k / pairs
        x, y, yaw = (v * k / pairs for v in (request.forward, request.left, request.turn))
        for side in sides:
            sign = 1.0 if side == "left" else -1.0
            other = "right" if side == "left" else "left"
            song.phase(f"shift to {other}", 1.0)
            above = song.now[f"{other}_z"] > low + 1e-6
            px, py = _pressure(song.now, other, lean if above else 0.0, inward)
            song.to(zmp_x=px, zmp_y=py, load=1.0 if other == "left" else 0.0)
            song.phase(f"swing {side}", 1.1, (int(side == "left"), int(side == "right")))
            there = {
                f"{side}_x": x - sign * offset * math.sin(yaw),
                f"{side}_y": y + sign * offset * math.cos(yaw),
                f"{side}_yaw": yaw,
            }
            climbs = abs(request.rise) > 1e-6
            song.to((0.0, 0.4), **{f"{side}_z": max(song.now[f"{side}_z"], rise) + CLEARANCE})
            song.to((0.3, 0.8) if climbs else (0.1, 0.9), **there)
            song.to((0.65, 1.0) if climbs else (0.6, 1.0), **{f"{side}_z": rise})
    song.phase("shift to middle", 1.0)
    song.to(zmp_x=request.forward, zmp_y=request.left, load=0.5)
    song.phase("rest", 0.4 + abs(end + request.rise - walk - low) / 0.06)
    song.to(hip=end + request.rise)
    return song


def hip_height(request: Request, robot: RobotModelConfig) -> float:
    """Height [m] of the hips above the lower ground while walking: the stance's, or as low as the stride needs.

    Never lower than a squat.

    When all weight is on one foot, the other leg is stretched by the stride and by the sway of the pelvis, which leads
    the centre of mass because the other leg lags behind.
    """
    stance, body, masses = robot.stance, robot.proportions, robot.masses
    height = stance.squatting if request.squat else stance.climbing if request.rise else stance.walking
    pairs = max(1, request.pairs)
    moving = masses.torso + 1.5 * masses.thigh + 0.5 * masses.shank  # the part of both legs that moves with the pelvis
    lead = 1.0 + (masses.foot + 0.75 * masses.shank + 0.25 * masses.thigh) / moving
    ahead = lead * (abs(request.forward) / pairs + max(0.0, request.lean))
    inward = stance.inward_climbing if request.rise else stance.inward
    aside = masses.total / moving * (body.hip_offset - inward) + lead * abs(request.left) / pairs
    left_over = (body.thigh + body.shank - SLACK) ** 2 - ahead**2 - aside**2
    needed = body.ankle_height + math.sqrt(max(0.0, left_over))
    return max(min(height, needed), stance.squatting)


def schedule(song: Composer, duration: float) -> np.ndarray:
    """Durations [s] of the phases: by weight, but with rests at the ends no shorter than the pendulum needs."""
    weights = np.array(song.weights)
    durations = duration * weights / weights.sum()
    ends = np.zeros(len(weights), bool)
    ends[[0, -1]] = True
    if durations[ends].min() < SHORTEST_REST:
        rest = np.maximum(durations[ends], SHORTEST_REST)
        durations[~ends] *= (duration - rest.sum()) / durations[~ends].sum()
        durations[ends] = rest
    return durations


def _home(hip: float, offset: float) -> dict[str, float]:
    values = dict.fromkeys(CHANNELS, 0.0)
    return values | {"load": 0.5, "hip": hip, "left_y": offset, "right_y": -offset}


def _pressure(now: dict[str, float], side: str, ahead: float, inward: float) -> tuple[float, float]:
    """Where a foot carries the whole weight: `ahead` of its middle and `inward` of it."""
    cos, sin = math.cos(now[f"{side}_yaw"]), math.sin(now[f"{side}_yaw"])
    left = -inward if side == "left" else inward
    return now[f"{side}_x"] + ahead * cos - left * sin, now[f"{side}_y"] + ahead * sin + left * cos


def ramp(part: Float[Array, "*N"]) -> Float[Array, "*N"]:
    """From 0 to 1 with minimum jerk, at rest at and beyond both ends."""
    s = jnp.clip(part, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def channels(score: Score, time: Float[Array, "N"]) -> tuple[Float[Array, "N C"], Float[Array, "N 2"]]:
    """The channels at given times [s], and which feet swing."""
    ends = jnp.cumsum(score.durations)
    starts = ends - score.durations
    index = score.phase.astype(jnp.int32)
    begin = starts[index] + score.window[:, 0] * score.durations[index]
    length = (score.window[:, 1] - score.window[:, 0]) * score.durations[index]
    risen = ramp((time[:, None] - begin) / jnp.maximum(length, 1e-6))
    inside = (time[:, None] >= starts) & (time[:, None] < ends)
    return score.start + jnp.matmul(risen, score.delta, precision="highest"), inside.astype(jnp.float32) @ score.swing
