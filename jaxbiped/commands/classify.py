"""`jaxbiped classify`: a map of a point cloud, or of an elevation map."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np

from jaxbiped.commands.charting import chart, say_cells, write_chart, write_json
from jaxbiped.commands.options.classify import ClassifyArgs
from jaxbiped.config import config_hash
from jaxbiped.errors import InputError
from jaxbiped.files import new_folder, refuse_existing
from jaxbiped.formats import cloud as clouds
from jaxbiped.formats.cloud import Cloud
from jaxbiped.mapping.gravity import FRAMES, Upright, find_upright, set_upright
from jaxbiped.terminal import legible


def main(args: ClassifyArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: an unusable cloud (missing, damaged, empty, too wide for the pitch), options that do not go together,
        no floor, a folder that exists or cannot be written.
    """
    out = args.out or Path("results") / f"classify-{config_hash(args.model_copy(update={'out': None}))}"
    refuse_existing(out)
    if args.heightmap:
        from jaxbiped.commands import heightmap

        return heightmap.main(args, out)
    check_options(args)
    start = time.perf_counter()
    cloud = clouds.load(args.cloud, args.scale)
    upright = stand(cloud, args)
    away = FRAMES[upright.frame] @ cloud.origin  # in double precision; the points' own coordinates are small
    made = chart(upright.apply(cloud.points), args, (float(away[0]), float(away[1])), sparse=True)
    seconds = time.perf_counter() - start

    T = np.eye(4)
    T[:3, :3] = upright.R
    T[:3, 3] = upright.shift - upright.R @ cloud.origin + np.array([away[0], away[1], 0])
    with new_folder(out) as folder:
        names = write_chart(made, folder, args, legible(args.cloud.name))
        summary = {
            "config": args.model_dump(mode="json"),
            "points": len(cloud.points),
            "dropped": cloud.dropped,
            "origin": cloud.origin.tolist(),
            "floor_found": upright.floor is not None,
            "T_map_cloud": T.tolist(),
        }
        write_json(folder / "classify.json", summary)
    print(f"cloud     {args.cloud}: {len(cloud.points)} points{dropped(cloud)}")
    if cloud.origin.any():
        print(f"origin    far from 0: computed from {', '.join(f'{v:.0f}' for v in cloud.origin)} m")
    print(f"floor     {say_floor(upright, cloud)}")
    print(f"map       {say_cells(made.grid)}, in {seconds:.1f} s")
    print(f"written   {out}: {', '.join([*names, 'classify.json'])}")
    return 0


def check_options(args: ClassifyArgs) -> None:
    """Raise `InputError` unless the options go together."""
    for name in ("cell", "range", "hole"):
        if getattr(args, name) is not None:
            raise InputError("goes with --heightmap only", field=name, value=getattr(args, name))
    if args.floor is not None and args.up is None:
        raise InputError("goes with --up only", field="floor", value=args.floor)
    if args.up is not None and not 0 < math.hypot(*args.up) < math.inf:
        raise InputError("must be a direction, not 0 0 0", field="up", value=args.up)


def stand(cloud: Cloud, args: ClassifyArgs) -> Upright:
    """Set the cloud upright; raise `InputError` if it shows no floor, or a larger plane outside the search cone."""
    up = None if args.up is None else np.array(args.up) / math.hypot(*args.up)
    if args.floor is not None:
        return set_upright(up, args.floor - float(up @ cloud.origin), np.median(cloud.points, axis=0).astype(float))
    upright = find_upright(cloud.points, up, math.radians(args.tilt), seed=args.seed)
    if upright is None:
        known = "--floor" if up is not None else "--up X Y Z, and --floor if the floor is not in it"
        size = " x ".join(f"{float(f'{side:.3g}'):g}" for side in np.ptp(cloud.points, axis=0))
        message = f"has no detectable floor in its {size} m; give {known} (and --scale, if it is not in metres)"
        raise InputError(message, file=args.cloud)
    if upright.rival is not None:
        x, y, z = (f"{v:.2f}" for v in upright.rival.up)
        message = (
            f"shows a plane larger than the floor that was found and tilted by more than 30 degrees; give --up X Y Z "
            f"({x} {y} {z} if that plane is the floor)"
        )
        raise InputError(message, file=args.cloud)
    return upright


def dropped(cloud: Cloud) -> str:
    """A note on points that were not finite."""
    return f"; {cloud.dropped} NaN or infinite points dropped" if cloud.dropped else ""


def say_floor(upright: Upright, cloud: Cloud) -> str:
    """How the cloud was set upright, as text."""
    if upright.floor is None:
        return f"given: {upright.frame} is up"
    floor = upright.floor
    height = upright.height + float(FRAMES[upright.frame][2] @ cloud.origin)
    return (
        f"found: {upright.frame} is up, tilted by {math.degrees(upright.tilt):.2f} degrees, height {height:.3f} m; "
        f"{floor.share:.0%} of the surface, within {floor.spread * 1000:.1f} mm"
    )
