"""`jaxbiped stereo`: a map of what a real stereo pair shows."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

from jaxbiped.commands.charting import chart, say_cells, write_chart, write_json
from jaxbiped.commands.options.stereo import StereoArgs
from jaxbiped.config import config_hash
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing
from jaxbiped.formats.cloud import save_ply
from jaxbiped.mapping.floor import Floor, find_floor
from jaxbiped.stereo.calibration_files import load_rig
from jaxbiped.stereo.images import as_rgb, load_pair
from jaxbiped.stereo.matching import match
from jaxbiped.stereo.order import check_order
from jaxbiped.stereo.points import to_points, useful_range
from jaxbiped.stereo.rectify import Rig
from jaxbiped.terminal import legible

UNKNOWN_CONE = math.radians(65.0)  # for a camera held upright, at any pitch
KNOWN_CONE = math.radians(5.0)  # largest error of a pose from the camera file
DOUBTFUL_SHARE, DOUBTFUL_ROLL = 0.2, math.radians(20.0)  # warn of fewer matched pixels, or of more roll
HEIGHT_OFF = 0.15  # relative error of the height in the camera file that is accepted, or 5 cm


def main(args: StereoArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: unusable pictures or calibration (missing, damaged, blank, of different size, swapped, not
        rectified), no floor in view and no pose in the camera file, a folder that exists or cannot be written.
    """
    out = args.out or Path("results") / f"stereo-{config_hash(args.model_copy(update={'out': None}))}"
    refuse_existing(out)
    left, right = load_pair(args.left, args.right)
    rig = load_rig(args.camera, (left.shape[1], left.shape[0]))
    left, right = rig.rectify(left, right)
    params = args.match
    searched = args.num_disparities or rig.num_disparities
    if searched:
        params = params.model_copy(update={"num_disparities": searched})
    check_order(left, right, params)
    start = time.perf_counter()
    disparity = match(left, right, params)
    seconds = time.perf_counter() - start
    camera = rig.camera
    x, y, z, weight = to_points(disparity, camera)
    reach = args.max_range or useful_range(camera)
    points = np.stack([x, y, z], axis=1)
    kept = (weight > 0) & ((points**2).sum(1) < reach**2)
    points = points[kept]
    if not len(points):
        message = f"must show something within {reach:.3g} m (--max-range); nothing was measured there"
        raise InputError(message, file=args.left)
    up, height, floor = attitude(points, rig, args)
    R = level_frame(up)
    points = points @ R.T.astype(np.float32) + np.array([0, 0, height], np.float32)
    made = chart(points, args)

    pitch, roll = math.asin(-up[2]), math.atan2(-up[0], -up[1])
    warn(float(disparity.valid.mean()), roll if floor and rig.pose is None else 0.0)
    nearest = camera.focal * camera.baseline / max(params.min_disparity + params.num_disparities - 1 + camera.doffs, 1)
    with new_folder(out) as folder:
        from jaxbiped.report import measured  # loads matplotlib

        save_ply(folder / "points.ply", points, as_rgb(left)[kept])
        measured.save_disparity(folder / "disparity.png", left, disparity.value, disparity.valid)
        names = write_chart(made, folder, args, legible(args.left.name), camera_xy=(0.0, 0.0))
        write_json(
            folder / "stereo.json",
            {
                "config": args.model_dump(mode="json"),
                "camera": vars(camera),
                "num_disparities": params.num_disparities,
                "measured": float(disparity.valid.mean()),
                "floor_found": floor is not None,
                "T_map_camera": transform(R, height),
                "pitch_degrees": math.degrees(pitch),
                "roll_degrees": math.degrees(roll),
                "height": height,
            },
        )
    print(f"pair      {args.left}, {args.right}: {camera.size[0]} x {camera.size[1]} px")
    print(
        f"camera    {args.camera}: focal length {camera.focal:.6g} px, baseline {camera.baseline:.4g} m; measures from "
        f"{nearest:.2f} to {reach:.2f} m"
    )
    print(f"matched   {disparity.valid.mean():.1%} of the pixels, in {seconds:.2f} s; {len(points)} points in range")
    print(
        f"{'floor' if floor else 'pose'}     {' ' * (not floor)}"
        f"{'found' if floor else 'from the camera file, as no floor was found'}: camera {height:.3f} m high, pitched "
        f"{math.degrees(pitch):.2f} and rolled {math.degrees(roll):.2f} degrees"
        + (f"; {floor.share:.0%} of the surface, within {floor.spread * 1000:.1f} mm" if floor else "")
    )
    print(f"map       {say_cells(made.grid)}")
    print(f"written   {out}: {', '.join(['points.ply', 'disparity.png', *names, 'stereo.json'])}")
    return 0


def warn(matched: float, roll: float) -> None:
    """Warn on stderr about what makes a map doubtful, one line each: few matched pixels, a floor that leans sideways.

    A roll given in the camera file does not count.

    Args:
      matched: share of the pixels.
      roll: [rad] of the camera relative to the floor that was found.
    """
    if matched < DOUBTFUL_SHARE:
        print(
            f"jaxbiped: warning: only {matched:.1%} of the pixels match, below {DOUBTFUL_SHARE:.0%}: the map may be "
            "unreliable; check that the camera file belongs to this pair, and that there is texture and light",
            file=sys.stderr,
        )
    if abs(roll) > DOUBTFUL_ROLL:
        print(
            f"jaxbiped: warning: the floor that was found is rolled by {math.degrees(roll):.0f} degrees, above "
            f"{math.degrees(DOUBTFUL_ROLL):.0f}: it may be a wall or a slope; give [pose] in the camera file to decide",
            file=sys.stderr,
        )


def attitude(points: np.ndarray, rig: Rig, args: StereoArgs) -> tuple[np.ndarray, float, Floor | None]:
    """Up in the rectified camera frame, height [m] of the camera above the floor, and the floor if one was found.

    A pose from the camera file is refined with a floor that agrees with it. Without a pose, the camera is assumed to be
    held upright, with the floor below it.
    """
    given = rig.up
    cone = UNKNOWN_CONE if given is None else KNOWN_CONE
    about = np.array([0.0, -1.0, 0.0]) if given is None else given
    floor = find_floor(points, about, cone, above=np.zeros(3), seed=args.seed)
    said = None if rig.pose is None else rig.pose.height
    if floor is not None and said is not None and abs(-floor.offset - said) > max(HEIGHT_OFF * said, 0.05):
        floor = None
    if floor is not None:
        return floor.up, -floor.offset, floor
    if given is None or said is None:
        message = "shows no detectable floor; give pitch and height of the camera as [pose] in the camera file"
        raise InputError(message, file=args.left)
    return given, said, None


def level_frame(up: np.ndarray) -> np.ndarray:
    """Rotation [3, 3] from the camera frame to x ahead (the picture's top, if the camera looks straight down), z up."""
    ahead = np.array([0.0, 0.0, 1.0]) if abs(up[2]) < 0.99 else np.array([0.0, -1.0, 0.0])
    x = ahead - (ahead @ up) * up
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def transform(R: np.ndarray, height: float) -> list[list[float]]:
    """The rigid motion [4, 4] from the rectified camera frame to the map frame."""
    T = np.eye(4)
    T[:3, :3], T[2, 3] = R, height
    return T.tolist()
