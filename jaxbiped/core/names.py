"""Names used in the rows and options of a study, in the order of every table and figure."""

REACHED = "reached"
CODES = (
    *(REACHED, "no_path", "stuck", "collided", "fell", "out_of_bounds", "out_of_steps", "invalid"),
    *("planner_failed", "planner_timeout"),
)
STRATEGIES = ("full", "bump_aware", "gate_aware", "floor_only", "blind_stop")  # built-in ones
FAMILIES = ("obstacles", "bump", "stairs", "gate", "mixed", "clutter")  # default of a study
MOVING = frozenset({"traffic"})
KNOWN = (*FAMILIES, *MOVING)
SCENE = "scene"  # the family of a hand-written arena
METRICS = ("spl", "clearance", "replans", "measuring")  # default of a study
BUILT_IN_METRICS = (*METRICS, "energy")
MEASURES = ("success", "distance", "time")  # by which strategies are compared
SIMULATED = ("native", "mjx")  # executors that are simulated bipeds
