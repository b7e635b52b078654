"""A number of a planner of your own as the axis of a sweep: 03_sweep_own_number.py [ARENAS]"""

import sys

import jaxbiped as jb
from planners.clearance import Clearance

count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
study = jb.Study(jb.RandomArenas(count=count), ["full", Clearance()])
results = jb.sweep(study, {"planner.price": [0, 2, 4, 8]})
print(results)
results.plot("time").savefig("own_number.png")
