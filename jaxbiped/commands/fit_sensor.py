"""`jaxbiped fit-sensor`: fit the noise of the ray-cast sensor to rendered pairs of a camera."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from jaxbiped import config
from jaxbiped.arenas.arena import CIRCLE
from jaxbiped.commands.options.fit_sensor import FitSensorArgs
from jaxbiped.config import config_hash
from jaxbiped.files import refuse_existing, write_whole
from jaxbiped.fitting.ray_sensor_fit import ALIKE, Fit, choices, fit, sensor_toml
from jaxbiped.fitting.sensor_agreement import Place, agreement, fused, looking, mission, same, score, with_rays, worlds
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.sensor_rig import StereoRig
from jaxbiped.sensing.config import CameraConfig, NoiseConfig


def main(args: FitSensorArgs) -> int:
    """Run the command.

    Returns:
      Exit status 0.

    Raises:
      InputError: a bad camera file, no way to render here, or an output file that exists or cannot be written.
    """
    camera = config.load(CameraConfig, args.camera) if args.camera else CameraConfig()
    out = args.out or Path("results") / f"fit-sensor-{config_hash(args.model_copy(update={'out': None}))}.toml"
    refuse_existing(out)
    rendered = MissionConfig(sensor="stereo", camera=camera)
    with contextlib.closing(StereoRig(camera)) as rig:
        places = list(worlds(args.seed, 0, args.arenas, args.views, rendered))
        print(f"camera     {camera.width} x {camera.height} px, {camera.field_of_view:g} degrees, "
              f"baseline {100 * camera.baseline:g} cm, {camera.image_noise:g} grey levels of noise")  # fmt: skip
        found = fit(places, rig, rendered)
        said = sentences(found, args)
        store(out, found, args, said)
        print("\n".join(said))
        others = list(worlds(args.seed, args.arenas, args.arenas, args.views, rendered))
        more = compared(others, rig, rendered, found, args.missions)
        store(out, found, args, [*said, *more])
        print("\n".join(more))
    print(f"written    {out}")
    return 0


def store(out: Path, found: Fit, args: FitSensorArgs, said: list[str]) -> None:
    """Write the sensor file and its comments; first without the comparison, which takes as long as the fit."""
    heading = [f"Written by `jaxbiped fit-sensor --arenas {args.arenas} --views {args.views} --seed {args.seed}`.",
               *said, "Fitted: what pictures can tell. The rest, say the attitude error, is the base's."]  # fmt: skip
    text = sensor_toml(found, heading)
    write_whole(out, lambda file: file.write(text.encode()), parents=True)


def sentences(found: Fit, args: FitSensorArgs) -> list[str]:
    """The measurements, as text."""
    q, stereo, marks, cast = found.quality, found.sensor.stereo, found.sensor.landmarks, found.sensor.rays
    seen = [sight for sight in found.sights if sight.error is not None]
    discs = sum(sight.kind == CIRCLE for sight in seen)
    off = np.median([np.hypot(*sight.error) for sight in seen]) if seen else np.nan
    return [
        f"matcher    {args.arenas} arenas, {found.views} views: bias {q.bias:+.3f} px, sd {q.sd:.3f} px; "
        f"{q.measured:.1%} of what both cameras see is measured, {q.wrong:.1%} of that with an error above 1 px",
        f"nothing    {q.phantoms:.1%} of what only one camera sees is matched at random; {found.plain:.1%} of plain "
        f"surfaces are; half is measured at a contrast of {stereo.min_contrast:.2f}",
        f"landmarks  {len(seen)} found ({discs} discs) of {len(found.sights)} in view, median error {1e3 * off:.1f} "
        f"mm; sd {1e3 * marks.sd:.1f} mm + {1e3 * marks.sd_per_metre:.1f} mm/m; discs to "
        f"{marks.furthest_circle:.2f} m, squares to {marks.furthest_square:.2f} m",
        f"rays       {cast.columns} x {cast.rows}: {found.same:.1%} of these arenas' cells agree with stereo "
        f"(wanted: {ALIKE:.1%})",
    ]


def compared(places: list[Place], rig: StereoRig, rendered: MissionConfig, found: Fit, missions: int) -> list[str]:
    """Agreement of the two sensors on arenas that were not used for the fit, with the fitted and the original noise."""
    rendered = rendered.model_copy(update={"stereo": found.sensor.stereo, "landmarks": found.sensor.landmarks})
    fitted = with_rays(rendered, found.sensor.rays)
    before = fitted.model_copy(update={"stereo": NoiseConfig()})
    others = {f"{rays.columns} x {rays.rows}": (with_rays(rendered, rays), None)
              for rays in choices(rendered.camera) if rays != found.sensor.rays}  # fmt: skip
    each = {"stereo": (rendered, rig), "fitted": (fitted, None)} | others | {"before": (before, None)}
    maps = {name: [] for name in each}
    show = Console(stderr=True)
    for place in track(places, description="maps", console=show, transient=True):
        for name, (how, sees) in each.items():
            maps[name].append(fused(place, looking(how, sees), how)[0])
    stereo = np.stack(maps["stereo"])
    count = len(places) * len(places[0].poses)
    said = [f"maps       {len(places)} other arenas, {count} views; cells that agree with stereo:"]
    for name in list(each)[1:]:
        how = each[name][0].camera
        share, measured = agreement(stereo, np.stack(maps[name]))
        noise = "the preset `rendered`" if name == "before" else "the fitted noise"
        said.append(f"           {share:.1%} with {noise} and {how.columns} x {how.rows} rays, "
                    f"{measured:.1%} of what both measured")  # fmt: skip
    for name in ("stereo", "fitted"):
        rated = score(maps[name], [place.classes for place in places])
        kinds = ", ".join(f"{kind} {rated.recall[kind]:.3f} / {rated.precision[kind]:.3f}" for kind in rated.recall)
        said.append(f"{name:<10} accuracy {rated.right:.3f}; recall / precision within one cell: {kinds}")
    if missions:
        pairs = [(mission(place, rendered, rig), mission(place, fitted, None)) for place in
                 track(places[:missions], description="missions", console=show, transient=True)]  # fmt: skip
        alike = sum(same(*pair) for pair in pairs)
        said.append(f"missions   {alike} of {len(pairs)} ended alike (code, and distance and time within 10 %)")
        for k, pair in enumerate(pairs):
            if not same(*pair):
                told = " and ".join(f"{o.code.label} {100 * o.distance:.0f} cm {o.time:.0f} s" for o in pair)
                said.append(f"           other arena {k}: {told}")
    return said
