"""A mission as a movement: the robot's state at every time."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate
from jaxbiped.biped.request import Request
from jaxbiped.errors import InputError
from jaxbiped.executors.primitive_schedule import Move, requests
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.recorded_driver import NAMES
from jaxbiped.motion.primitives import Primitive
from jaxbiped.viewer.puppet import Puppet

MEASURE = 10.0  # [s] duration of a measurement if not in the mission's config
ROWS = 48  # states of a movement
PRIMITIVES = {name: primitive for primitive, name in NAMES.items()}
Frame = tuple[float, float, float, float]  # x, y, z [m] and yaw [rad] of the midpoint of the feet


@dataclass(frozen=True)
class Motion:
    """States of `biped.model.robot_spec` at ascending times."""

    time: Float[np.ndarray, "F"]  # [s] of the mission's clock
    qpos: Float[np.ndarray, "F 19"]

    def at(self, time: float) -> Float[np.ndarray, "19"]:
        """The state at a time [s], interpolated; before the first and after the last, that one."""
        k = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1))
        if k == len(self.time) - 1 or time <= self.time[0]:
            return np.array(self.qpos[k], float)
        share = (time - self.time[k]) / (self.time[k + 1] - self.time[k])
        before, after = self.qpos[k].astype(float), self.qpos[k + 1].astype(float)
        after[3:7] *= 1.0 if before[3:7] @ after[3:7] >= 0 else -1.0  # a quaternion and its opposite are one attitude
        state = before + share * (after - before)
        state[3:7] /= np.linalg.norm(state[3:7])
        return state


@dataclass(frozen=True)
class Tape:
    """A movement as `biped.gait` plans it, `K` rows of it, in the frame between the feet at its start."""

    share: Float[np.ndarray, "K"]  # of its duration
    q: Float[np.ndarray, "K 12"]  # [rad]
    pelvis: Float[np.ndarray, "K 3"]  # [m]
    yaw: Float[np.ndarray, "K"]  # [rad] of the torso
    end: Frame  # the frame between the feet at its end
    duration: float  # [s]


def motion(log: MissionLog, puppet: Puppet, measure: float = MEASURE) -> Motion:
    """The movement of a whole mission.

    A simulated biped moves as it did, with its movements stretched to their time on the mission's clock; while it
    measures, which takes `measure` [s] before each moment, it stands still. For other robots only the positions at each
    moment are known: they walk from one to the next as planned by the gait generator. Where that fails (a leg does not
    reach), the robot glides.
    """
    return walked(log, puppet, measure) if log.walk is not None else planned(log, puppet, measure)


def walked(log: MissionLog, puppet: Puppet, measure: float) -> Motion:
    """The movement of a simulated biped."""
    moment = np.asarray(log.walk.moment, float)
    t = np.minimum(moment.astype(int), len(log.time) - 2)
    ends = arrivals(log, measure)
    time = log.time[t] + (moment - t) * (ends[t] - log.time[t])
    return rising(np.append(time, ends[-1]), np.concatenate([log.walk.qpos, log.walk.qpos[-1:]]))


def planned(log: MissionLog, puppet: Puppet, measure: float) -> Motion:
    """The movement of a robot of which only the positions are known."""
    count = len(log.time)
    z = log.true_z if log.true_z is not None else np.zeros(count)
    squat = [bool(each) for each in log.squat] if log.squat is not None else [False] * count
    frames = [(*map(float, log.true_xyyaw[t, :2]), float(z[t]), float(log.true_xyyaw[t, 2])) for t in range(count)]
    ends, time, qpos = arrivals(log, measure), [float(log.time[0])], [puppet.home(*frames[0], squat[0])]
    for t in range(count - 1):
        here, there = frames[t : t + 2]
        rise = round((there[2] - here[2]) / log.level_height)
        move = move_between(here, there, log.action[t + 1], rise, squat[t + 1])
        try:
            shares, states = play(requests(move, squat[t], log.level_height), here, there, puppet)
        except InputError:
            shares, states = glide(here, there, squat[t], squat[t + 1], puppet)
        time += [*(log.time[t] + shares * (ends[t] - log.time[t])), float(log.time[t + 1])]
        qpos += [*states, puppet.home(*there, squat[t + 1])]
    return rising(np.array(time), np.array(qpos))


def move_between(here: Frame, there: Frame, action: str, rise: int, squat: bool) -> Move:
    """The decision that leads from one position to another."""
    turn = math.remainder(there[3] - here[3], 2 * math.pi)
    dx, dy, cos, sin = there[0] - here[0], there[1] - here[1], math.cos(there[3]), math.sin(there[3])
    primitive = PRIMITIVES.get(action, Primitive.NONE)
    return Move(turn, primitive, cos * dx + sin * dy, rise, squat, cos * dy - sin * dx)


def play(
    asked: tuple[Request, ...], here: Frame, there: Frame, puppet: Puppet
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 19"]]:
    """States of successive movements, and the fractions of the time at which they are reached.

    The remaining error in position is distributed over the movement.

    Raises:
      InputError: the robot cannot make this movement.
    """
    tapes = [tape(request, puppet.robot) for request in asked]
    if not tapes:
        raise InputError("nothing to play")
    froms = [here]
    for each in tapes:
        froms.append(joined(froms[-1], each.end))
    off = np.subtract(there, froms[-1])
    off[3] = math.remainder(off[3], 2 * math.pi)
    total = sum(each.duration for each in tapes)
    shares, states, begun = [], [], 0.0
    for each, frame in zip(tapes, froms, strict=False):
        share = (begun + each.share * each.duration) / total
        for k, part in enumerate(share):
            x, y, z, yaw = np.add(frame, part * off)
            states.append(puppet.carried(each.pelvis[k], each.q[k], (x, y, z, yaw), float(each.yaw[k])))
        shares.append(share)
        begun += each.duration
    return np.concatenate(shares), np.array(states)


def glide(
    here: Frame, there: Frame, squat: bool, squats: bool, puppet: Puppet
) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2 19"]]:
    """The robot turns and then glides, in a standing posture."""
    turned = abs(math.remainder(there[3] - here[3], 2 * math.pi))
    share = turned / (turned + 4 * math.dist(here[:2], there[:2]) + 1e-9)  # [rad] against [m]: a turn is fast
    states = puppet.home(*here[:3], there[3], squat), puppet.home(*there, squats)
    return np.array([share, 1.0]), np.array(states)


@functools.lru_cache(maxsize=1024)
def tape(request: Request, robot: RobotModelConfig) -> Tape:
    """A movement. InputError: the robot cannot make it."""
    table = generate(request, robot)
    rows = np.unique(np.linspace(0, len(table.q) - 1, ROWS).round().astype(int))
    feet = table.feet[-1].mean(axis=0)
    return Tape(
        share=(rows + 1) / len(table.q),
        q=table.q[rows],
        pelvis=table.pelvis[rows],
        yaw=table.feet[rows, :, 3].mean(axis=1),
        end=tuple(float(value) for value in feet),
        duration=table.duration,
    )


def joined(frame: Frame, step: Frame) -> Frame:
    """A frame given relative to another frame."""
    x, y, z, yaw = frame
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + cos * step[0] - sin * step[1], y + sin * step[0] + cos * step[1], z + step[2], yaw + step[3]


def arrivals(log: MissionLog, measure: float) -> Float[np.ndarray, "n"]:
    """Times [s] at which the action after each moment but the last ends: one measurement before the next moment."""
    ends = log.time[1:] - measure
    if len(ends):
        ends[-1] = log.time[-1]  # nothing is measured any more
    return np.maximum(ends, log.time[:-1])


def rising(time: Float[np.ndarray, "F"], qpos: Float[np.ndarray, "F nq"]) -> Motion:
    """The motion with only the last of the states that have the same time."""
    time = np.maximum.accumulate(time)
    keep = np.append(np.diff(time) > 1e-9, True)
    return Motion(time[keep], qpos[keep])
