"""What a study names in its rows and its options, in the order of every table and figure."""

REACHED = "reached"
CODES = (
    *(REACHED, "no_path", "stuck", "collided", "fell", "out_of_bounds", "out_of_steps", "invalid"),
    *("planner_failed", "planner_timeout"),
)
STRATEGIES = ("full", "bump_aware", "gate_aware", "floor_only", "blind_stop")  # that are built in
FAMILIES = ("obstacles", "bump", "stairs", "gate", "mixed", "clutter")  # of a study that names none
MOVING = frozenset({"traffic"})
KNOWN = (*FAMILIES, *MOVING)
SCENE = "scene"  # the family of an arena that was written by hand
METRICS = ("spl", "clearance", "replans", "measuring")  # of a study that names none
BUILT_IN_METRICS = (*METRICS, "energy")
MEASURES = ("success", "distance", "time")  # whose differences strategies are compared by
