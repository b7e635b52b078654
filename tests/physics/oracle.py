"""Plain MuJoCo: one simulation, one `mj_step` at a time."""

import mujoco
import numpy as np


def play(xml, controls, qpos, qvel, fields, watch):
    """(qpos [S, nq], qvel [S, nv], sensors [S, ns], greatest depth a watch [W] or -inf) of one simulation."""
    model = mujoco.MjModel.from_xml_string(xml)
    for name, value in fields.items():
        getattr(model, name)[:] = value
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:] = qpos, qvel
    pairs = [{frozenset(model.geom(name).id for name in pair) for pair in pairs} for pairs in watch.values()]
    states, depth = [], np.full(len(watch), -np.inf)
    for control in controls:
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        states.append((data.qpos.copy(), data.qvel.copy(), data.sensordata.copy()))
        for contact in data.contact:
            for i, group in enumerate(pairs):
                if frozenset(int(g) for g in contact.geom) in group and contact.dist <= 0:
                    depth[i] = max(depth[i], -contact.dist)
    return *(np.array(part) for part in zip(*states, strict=True)), depth
