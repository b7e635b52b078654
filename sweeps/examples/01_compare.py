"""Two strategies on the same random arenas, with paired statistics: 01_compare.py [ARENAS]"""

import sys

import jaxbiped as jb

count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
study = jb.Study(jb.RandomArenas(families=["bump", "stairs"], count=count), ["bump_aware", "floor_only"])
results = jb.evaluate(study)
print(results.compare("bump_aware", "floor_only"))
