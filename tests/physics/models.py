"""Tiny models: a hopper on one servoed leg between a step and a beam, and a pendulum."""

import numpy as np

HOPPER = """
<mujoco model="hopper">
  <option timestep="0.005" integrator="implicitfast" solver="Newton" iterations="4" ls_iterations="8"/>
  <default><geom solref="0.01 1"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1"/>
    <geom name="step" type="box" pos="5 0 0.015" size="0.1 0.1 0.015"/>
    <geom name="beam" type="box" pos="5 5 1" size="0.5 0.5 0.02"/>
    <body name="torso" pos="0 0 0.25">
      <freejoint/>
      <geom name="head" type="box" size="0.05 0.05 0.03" mass="1"/>
      <body name="leg" pos="0 0 -0.05">
        <joint name="knee" type="slide" axis="0 0 1" range="-0.1 0.1" damping="1"/>
        <geom name="shin" type="box" size="0.01 0.01 0.1" pos="0 0 -0.08" mass="0.2" contype="0" conaffinity="0"/>
        <geom name="foot0" type="sphere" size="0.01" pos="0.05 0.05 -0.19" mass="0.02"/>
        <geom name="foot1" type="sphere" size="0.01" pos="0.05 -0.05 -0.19" mass="0.02"/>
        <geom name="foot2" type="sphere" size="0.01" pos="-0.05 0.05 -0.19" mass="0.02"/>
        <geom name="foot3" type="sphere" size="0.01" pos="-0.05 -0.05 -0.19" mass="0.02"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="knee" joint="knee" kp="300" kv="10" ctrlrange="-0.1 0.1"/></actuator>
  <sensor><jointpos joint="knee"/><subtreelinvel body="torso"/></sensor>
</mujoco>
"""
FEET = ("foot0", "foot1", "foot2", "foot3")
WATCH = {
    "step": tuple((foot, "step") for foot in FEET),
    "overhead": (("head", "beam"),),
}

PENDULUM = """
<mujoco model="pendulum">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body pos="0 0 1"><joint name="hinge" axis="0 1 0" damping="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02" mass="0.5" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator><motor name="hinge" joint="hinge" gear="1"/></actuator>
</mujoco>
"""

BATCH = 4
FIELDS = ("geom_pos", "body_mass", "actuator_gainprm")


def own_fields(model):
    """The model's own values, [B, ...], of the fields that the tests vary."""
    own = {name: getattr(model, name) for name in FIELDS}
    return {name: np.tile(value, (BATCH, *[1] * value.ndim)) for name, value in own.items()}


def hops(model, steps, seed=0):
    """Random controls [B, steps, 1], initial states, and fields: a step underfoot, a beam overhead, a heavy torso."""
    rng = np.random.default_rng(seed)
    controls = np.repeat(rng.uniform(-0.1, 0.1, (BATCH, -(-steps // 20), 1)), 20, axis=1)[:, :steps]
    qpos = np.tile(model.qpos0, (BATCH, 1))
    qpos[:, 0] += rng.uniform(-0.1, 0.1, BATCH)
    qpos[:, 2] += rng.uniform(0.03, 0.1, BATCH)
    qvel = rng.normal(0, 0.05, (BATCH, model.nv))
    fields = own_fields(model)
    fields["geom_pos"][1, model.geom("step").id, :2] = qpos[1, :2]
    fields["geom_pos"][2, model.geom("beam").id] = 0, 0, 0.35
    fields["body_mass"][3, model.body("torso").id] = 1.5
    return controls, qpos, qvel, fields
