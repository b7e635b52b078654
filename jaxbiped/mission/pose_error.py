"""The pose error of a mission's robot, and whether it saw landmarks: facts and a sentence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxbiped.mission.log import MissionLog


def pose_errors(log: MissionLog) -> Float[np.ndarray, "T 2"]:
    """Distance [m] and angle [rad, 0 to pi] between the believed and the true pose, at each moment of a log."""
    off = np.asarray(log.estimated_xyyaw, float) - np.asarray(log.true_xyyaw, float)
    turned = np.abs((off[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    return np.stack([np.hypot(off[:, 0], off[:, 1]), turned], axis=1)


def pose_facts(log: MissionLog) -> dict[str, Any]:
    """The errors in metres and radians, final and maximum, and how many measurements saw a landmark, as JSON.

    `landmarks_seen` is None for a log that does not record it.
    """
    errors = pose_errors(log)
    measured = None if log.seen is None else log.seen[:-1]  # nothing is measured at the end
    return {
        "pose_error_end": errors[-1].tolist(),
        "pose_error_greatest": errors.max(0).tolist(),
        "landmarks": len(log.landmarks),
        "landmarks_seen": None if measured is None else int((measured > 0).sum()),
    }


def pose_sentence(log: MissionLog) -> str:
    """The same as text: the pose error, and whether a landmark was seen."""
    facts = pose_facts(log)
    (off, turned), (furthest, _) = facts["pose_error_end"], facts["pose_error_greatest"]
    said = f"pose error {100 * off:.1f} cm and {math.degrees(turned):.1f}° at the end, "
    said += f"{100 * furthest:.1f} cm at most"
    if not facts["landmarks"]:
        return f"{said}; the scene has no landmarks"
    if facts["landmarks_seen"] is None:
        return said
    if not facts["landmarks_seen"]:
        return f"{said}; no landmark was seen"
    return f"{said}; landmarks seen in {facts['landmarks_seen']} of {len(log.time) - 1} measurements"
