"""Beside OpenSim itself, where its package is installed: inverse dynamics and lengths of muscles of `.osim` files.

`MBD_OSIM` may name a folder with further files, which are never copied here: the gait models of `osim-rl` 3.0.11, say.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import mbd
from tests.laboratory.test_read_osim_muscles import muscles, with_muscle

FOLDER = Path(os.environ.get("MBD_OSIM", "nowhere"))
TOYS = ["20303", "30000", "30000+"]
FILES = [*TOYS, *sorted(FOLDER.glob("**/*.osim"))] if FOLDER.is_dir() else list(TOYS)


def opened(path):
    """The model of OpenSim without forces, its state and its coordinates."""
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    theirs = opensim.Model(str(path))
    forces = theirs.updForceSet()
    for k in range(forces.getSize()):
        forces.get(k).set_appliesForce(False)
    state = theirs.initSystem()
    listed = theirs.getCoordinateSet()
    return opensim, theirs, state, [listed.get(k) for k in range(listed.getSize())]


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file if isinstance(file, str) else file.stem)
def test_moments_and_muscles_are_those_of_opensim(file, tmp_path):
    path = file
    if isinstance(file, str):
        path = tmp_path / "leg.osim"
        path.write_text(with_muscle(file.rstrip("+"), muscles(file.rstrip("+"))))
    opensim, theirs, state, coordinates = opened(path)
    if str(file).endswith("+"):  # as OpenSim writes it itself
        theirs.printToXML(str(path))
    try:
        found = mbd.read_model(path, repair=True)
    except mbd.ModelError as error:
        pytest.skip(str(error)[:100])
    if any("made possible" in line for line in found.report.approximated) or theirs.getConstraintSet().getSize():
        pytest.skip("inertia was repaired, or coordinates are coupled")
    model, rng = found.model, np.random.default_rng(0)
    joints = {name: found.joints[name] for c in coordinates if (name := c.getName()) in found.joints}
    if len(joints) < len(coordinates):
        pytest.skip("coordinates of ball joints have other names")
    values = {name: rng.uniform(-0.4, 0.4, 3) for name in joints}
    motion = {"time": np.arange(3.0)}
    for name, q in values.items():
        whole = joints[name].coordinate_names[0]
        motion |= {whole: q, f"{whole}.rate": np.sin(7.0 * q), f"{whole}.acceleration": np.cos(5.0 * q)}
    bare = model.without(*(word.name for word in model.constraints if word.name.endswith(" lock")))
    ours = mbd.inverse_dynamics(bare, motion, joints=list(joints))
    # OpenSim has speeds in an order of its own
    for c in coordinates:
        c.setLocked(state, False)
    place = {}
    for k, c in enumerate(coordinates):
        c.setSpeedValue(state, 1000.0 + k)
    speeds = state.getU()
    for j in range(speeds.size()):
        place[coordinates[round(speeds.get(j) - 1000.0)].getName()] = j
    solver = opensim.InverseDynamicsSolver(theirs)
    worst, size = 0.0, 0.0
    for frame in range(3):
        udot = opensim.Vector(speeds.size(), 0.0)
        for c in coordinates:
            q = values[c.getName()][frame]
            c.setValue(state, q, False)
            c.setSpeedValue(state, np.sin(7.0 * q))
            udot.set(place[c.getName()], np.cos(5.0 * q))
        theirs.realizeDynamics(state)
        tau = solver.solve(state, udot)
        for name in joints:
            kind = "moment" if joints[name].labels[0].unit == "rad" else "force"
            value = tau.get(place[name])
            worst, size = max(worst, abs(value - ours[f"{name}.{kind}"][frame])), max(size, abs(value))
    assert worst < 1e-8 * size
    listed = theirs.getMuscles()
    lengths = mbd.muscle_forces(bare, motion, muscles=found.muscles, joints=list(joints)) if found.muscles else None
    for k in range(listed.getSize()):
        muscle = listed.get(k)
        name = muscle.getName()
        if lengths is not None and f"{name}.length" in lengths and not muscle.getGeometryPath().getWrapSet().getSize():
            length = muscle.getGeometryPath().getLength(state)
            assert lengths[f"{name}.length"][2] == pytest.approx(length, abs=1e-12), name
