"""One mission in a scene, with its log, a picture and a film: 05_one_mission.py [FOLDER]"""

import sys
from pathlib import Path

import jaxbiped as jb

scene = Path(__file__).parents[2] / "configs" / "scenes" / "experiment_5.toml"
mission = jb.play(scene, "full", on_decision=lambda played: print(f"{played.time:6.0f} s  {played.name}"))
print(mission)
if len(sys.argv) > 1:
    print(*mission.save(sys.argv[1]), sep="\n")
