"""A mission as a movement: the robot's state at every time of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxbiped.mission.log import MissionLog
from jaxbiped.report.viewer.puppet import Puppet

MEASURE = 10.0  # [s] of a measurement, where the mission's config does not say


@dataclass(frozen=True)
class Motion:
    """States of `physics.robot.robot_spec` at times that rise."""

    time: Float[np.ndarray, "F"]  # [s] of the mission's clock
    qpos: Float[np.ndarray, "F 19"]

    def at(self, time: float) -> Float[np.ndarray, "19"]:
        """The state at a time [s], in between the nearest; before the first and after the last, that one."""
        k = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1))
        if k == len(self.time) - 1 or time <= self.time[0]:
            return np.array(self.qpos[k], float)
        share = (time - self.time[k]) / (self.time[k + 1] - self.time[k])
        before, after = self.qpos[k].astype(float), self.qpos[k + 1].astype(float)
        after[3:7] *= 1.0 if before[3:7] @ after[3:7] >= 0 else -1.0  # a quaternion and its opposite are one attitude
        state = before + share * (after - before)
        state[3:7] /= np.linalg.norm(state[3:7])
        return state


def motion(log: MissionLog, puppet: Puppet, measure: float = MEASURE) -> Motion:
    """The whole of a mission.

    A simulated biped moves as it did, its movements stretched over the time that the mission's clock counts for them;
    while it measures, which takes `measure` [s] before each moment, it stands. Others stand, or squat, at the places
    of the log, and glide from one to the next: they turn, and then go.
    """
    return walked(log, puppet, measure) if log.walk is not None else glided(log, puppet, measure)


def walked(log: MissionLog, puppet: Puppet, measure: float) -> Motion:
    """Of a simulated biped."""
    moment = np.asarray(log.walk.moment, float)
    t = np.minimum(moment.astype(int), len(log.time) - 2)
    ends = arrivals(log, measure)
    time = log.time[t] + (moment - t) * (ends[t] - log.time[t])
    last = puppet.model.nq
    return rising(np.append(time, ends[-1]), np.concatenate([log.walk.qpos[:, :last], log.walk.qpos[-1:, :last]]))


def glided(log: MissionLog, puppet: Puppet, measure: float) -> Motion:
    """Of a robot whose places alone are known."""
    count = len(log.time)
    z = log.true_z if log.true_z is not None else np.zeros(count)
    squat = log.squat if log.squat is not None else np.zeros(count, bool)
    states = [puppet.home(*log.true_xyyaw[t, :2], z[t], log.true_xyyaw[t, 2], bool(squat[t])) for t in range(count)]
    ends, time, qpos = arrivals(log, measure), [float(log.time[0])], [states[0]]
    for t in range(count - 1):
        (x, y, yaw), (x2, y2, yaw2) = log.true_xyyaw[t], log.true_xyyaw[t + 1]
        turned = abs(math.remainder(yaw2 - yaw, 2 * math.pi))
        share = turned / (turned + 4 * math.hypot(x2 - x, y2 - y) + 1e-9)  # [rad] against [m]: a turn is fast
        middle = puppet.home(x, y, z[t], yaw2, bool(squat[t]))
        time += [log.time[t] + share * (ends[t] - log.time[t]), ends[t], log.time[t + 1]]
        qpos += [middle, states[t + 1], states[t + 1]]
    return rising(np.array(time), np.array(qpos))


def arrivals(log: MissionLog, measure: float) -> Float[np.ndarray, "n"]:
    """When [s] what was done after each moment but the last had been done: a measurement before the next moment."""
    ends = log.time[1:] - measure
    if len(ends):
        ends[-1] = log.time[-1]  # nothing is measured any more
    return np.maximum(ends, log.time[:-1])


def rising(time: Float[np.ndarray, "F"], qpos: Float[np.ndarray, "F nq"]) -> Motion:
    """Without states of the same time but the last of them."""
    time = np.maximum.accumulate(time)
    keep = np.append(np.diff(time) > 1e-9, True)
    return Motion(time[keep], qpos[keep])
