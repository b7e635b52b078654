"""The closed loop: sense, localise, map, plan, select, execute, until each mission has ended."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "config": "MissionConfig",
        "decision": "decide",
        "log": "MissionLog",
        "oracle": "OraclePlan oracle_plan",
        "outcome": "Code",
        "batched_driver": "Jobs Result Tally compile_queue stack",
        "params": "MissionParams MissionSpec mission_spec",
        "setup": "MissionSetup",
        "state": "AgentState start",
        "recorded_driver": "Mission run_logged",
        "strategies": "STRATEGIES Strategy find_strategy",
    },
)
