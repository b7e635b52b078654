"""Executors: what becomes of a command in the true world, and the rules of its referee."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "built_in": "Kinematic Sampled",
        "execution": "Execution Executor find_executor",
        "kinematic_executor": "kinematic",
        "motion_library": "Library load_library",
        "world_state": "BodyPose WorldState",
    },
)
