"""Verify the biped's primitives in C MuJoCo and print what they bear.

python sweeps/verify_primitives.py            # at speed, 16 draws: about a minute
python sweeps/verify_primitives.py --paper    # at Table 2's durations
python sweeps/verify_primitives.py --draws 128
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import tyro

from jaxbiped.errors import InputError
from jaxbiped.motion import request as ask
from jaxbiped.motion.biped import RobotModelConfig
from jaxbiped.motion.gait import PrimitiveTable, generate
from jaxbiped.physics.trial import Disturbance, Tolerance, play

TOLERANCE = Tolerance()
PRIMITIVES = [  # and how fast each is tried
    (ask.straight(0.05), (4.0, 3.0, 2.5, 2.0, 1.8)),
    (ask.straight(math.sqrt(2) * 0.05), (4.0, 3.0, 2.5, 2.2)),
    (ask.turn(math.pi / 4), (5.0, 4.0, 3.0, 2.7)),
    (ask.step(0.10, 0.03), (12.0, 8.0, 7.0, 6.0)),
    (ask.step(0.10, -0.03), (12.0, 8.0, 7.0, 6.0)),
    (ask.gate(0.15), (12.0, 8.0, 6.0, 5.0)),
]
CHOSEN = (2.5, 3.0, 4.0, 8.0, 8.0, 8.0)  # [s] that the draws are played in
MILLIMETRES = {"rise": (-20, -15, -12, -10, -8, 8, 10, 12, 15, 20), "edge": (-35, -30, -25, -15, -8, 8, 15, 20, 25, 30)}
DEGREES = {"yaw": (-20, -16, -12, -8, 8, 12, 16, 20), "slope": (-10, -7, -5, -3, 3, 5, 7, 10)}


def main(paper: bool = False, draws: int = 16) -> None:
    """Print the table.

    Args:
      paper: play at Table 2's durations, instead of fast.
      draws: of the mild set and of each servo offset; 0 plays each primitive once, undisturbed.
    """
    robot = RobotModelConfig()
    for (request, durations), chosen in zip(PRIMITIVES, CHOSEN, strict=True):
        print(f"\n{request.name} {100 * request.forward:.1f} cm {math.degrees(request.turn):.0f} deg")
        for duration in (request.duration,) if paper else durations:
            print("  " + nominal(request.lasting(duration), robot))
        if draws == 0:
            continue
        table = generate(request if paper else request.lasting(chosen), robot)
        rng = np.random.default_rng(0)
        print(f"  in {table.duration:g} s:")
        print(f"    mild set {rate(table, robot, [Disturbance.mild(rng) for _ in range(draws)])}")
        for name, values in (MILLIMETRES | DEGREES).items():
            if request.rise or name == "slope":
                unit = 1e-3 if name in MILLIMETRES else math.radians(1.0)
                borne = [v for v in values if passes(table, robot, replace(Disturbance(), **{name: v * unit}))]
                print(f"    {name} {'mm' if name in MILLIMETRES else 'deg'}: bears {borne} of {list(values)}")
        for degrees in (0.5, 1.0, 2.0):
            offsets = [np.radians(degrees) * np.random.default_rng(k).standard_normal(12) for k in range(draws)]
            trials = [Disturbance(servo=tuple(o)) for o in offsets]
            print(f"    servo offsets sd {degrees:g} deg {rate(table, robot, trials)}")


def nominal(request: ask.Request, robot: RobotModelConfig) -> str:
    """One undisturbed trial in words."""
    try:
        table = generate(request, robot)
    except InputError as error:
        return f"{request.duration:g} s: {error}"
    outcome = play(table, robot, record=True)
    off = f"{1000 * np.hypot(*outcome.error[:2]):.1f} mm, {math.degrees(outcome.error[2]):.2f} deg"
    margins = f"planned {1000 * table.margin:.0f}, measured {1000 * outcome.zmp_margin:.0f} mm"
    peaks = f"{outcome.peak_torque:.2f} Nm, {math.degrees(outcome.peak_speed):.0f} deg/s"
    return f"{table.duration:g} s: ends {off} off; ZMP margin {margins}; peak {peaks}"


def passes(table: PrimitiveTable, robot: RobotModelConfig, disturbance: Disturbance) -> bool:
    """Whether one trial succeeds."""
    return play(table, robot, disturbance).success(TOLERANCE)


def rate(table: PrimitiveTable, robot: RobotModelConfig, disturbances: Iterable[Disturbance]) -> str:
    """How many trials succeed."""
    results = [passes(table, robot, d) for d in disturbances]
    return f"{sum(results)}/{len(results)}"


if __name__ == "__main__":
    tyro.cli(main)
