"""The one place that chooses what runs missions: their driver, their sensor and their executor."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import jax
import numpy as np
from jaxtyping import Array, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.component import traced_component, with_numbers
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.mission.batched_driver import Result
from jaxbiped.mission.params import SIMULATED, MissionConfig, MissionParams, MissionSpec
from jaxbiped.mission.recorded_driver import Mission, Played, run_logged
from jaxbiped.mission.sensor_rig import SensorRig, rig_for
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.strategies import Strategy, find_strategy
from jaxbiped.mission.terrain_check import checked_spec
from jaxbiped.sensing.counter_rng import from_key
from jaxbiped.study.batching import Group, numbers_under


def noise_of(seed: int) -> UInt32[Array, ""]:
    """The seed of all noise of one mission, from the user's seed."""
    return noise_of_word(np.uint32(seed & 0xFFFFFFFF))


@ready_jit
def noise_of_word(seed: UInt32[Array, ""]) -> UInt32[Array, ""]:
    """One compiled program, where JAX itself would load six small ones."""
    return from_key(jax.random.key(seed))


def spec_of(config: MissionConfig, arena: Arena) -> MissionSpec:
    """The static part of missions in one arena; see `terrain_check.checked_spec`."""
    return checked_spec(config, tuple(round(float(side), 6) for side in np.asarray(arena.size_xy)), arena.terrain)


def check_mission(config: MissionConfig) -> None:
    """Reject, before anything is printed or written, missions that cannot run on this machine.

    Raises:
      InputError: a biped that cannot play its primitives, a missing device or renderer.
    """
    if config.executor in SIMULATED:
        from jaxbiped.mission.simulated_driver import rehearse  # loads MuJoCo

        rehearse(config)


@contextlib.contextmanager
def seeing(config: MissionConfig) -> Iterator[SensorRig | None]:
    """What missions of a config see with on the host, closed on exit; None if their sensor is in JAX."""
    rig = rig_for(config)
    try:
        yield rig
    finally:
        if rig:
            rig.close()


def play_one(
    arena: Arena,
    config: MissionConfig,
    params: MissionParams,
    noise: UInt32[Array, ""],
    on_decision: Callable[[Played], None] = lambda _: None,
    rig: SensorRig | None = None,
) -> Mission:
    """Play one mission as a study would, with a log of everything.

    Args:
      params: those of the config for one strategy (`MissionConfig.params`, `numbered`).
      noise: seed of all its noise.
      rig: from `seeing`, if the sensor measures on the host.

    Raises:
      InputError: a pitch that does not divide the arena, a biped that cannot be simulated.
    """
    setup = MissionSetup(arena, params, spec_of(config, arena))
    if config.executor in SIMULATED:
        from jaxbiped.mission.simulated_driver import walk_logged  # loads MuJoCo

        return walk_logged(setup, noise, config.walk, on_decision, rig)
    return run_logged(setup, noise, on_decision, rig)


def numbered(params: MissionParams, strategy: str | Strategy, numbers: Mapping[str, float]) -> MissionParams:
    """Parameters of a strategy with other numbers for its components, such as `{"planner.clearance": 0.1}`."""
    strategy = find_strategy(strategy) if isinstance(strategy, str) else strategy
    changed = {"sensor": params.sensor, "executor": params.executor, "planner": strategy.planner}
    for name, component in changed.items():
        own = numbers_under(name, numbers)
        if component is not None and own:
            made = traced_component(with_numbers(component, own))
            params = replace(params, **{name: made})
    return params


@contextlib.contextmanager
def batch_driver(group: Group, workers: int) -> Iterator[Callable[..., Result]]:
    """What plays the missions of a group: a function with the first two arguments of `queues.run_all`."""
    from jaxbiped.study.hosted import open_rig, run_on_host
    from jaxbiped.study.queues import run_all

    with contextlib.ExitStack() as stack:
        see = partial(open_rig, group.camera, group.spec.localisation) if group.camera else None
        if group.walk is not None:
            from jaxbiped.study.walks import walk_all  # loads MuJoCo

            yield partial(walk_all, config=group.walk, rig=stack.enter_context(see()) if see else None)
        elif see:
            yield partial(run_on_host, open_rig=see, workers=workers)
        else:
            yield partial(run_all, workers=workers)
