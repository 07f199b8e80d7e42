"""Random scenes with impacts, and derivatives of their runs held against differences."""

import numpy as np

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from tests.sensitivity.differences import differences, off

ROUND_OFF = 2e-12
"""What iterations of a run and round-off leave of its end [m, rad, s]."""


def judged(model, scheme, dt=5e-3, until=0.8, step=3e-4):
    """How far derivatives of a scene are off, over the largest of each, and how well they are known; or why not.

    By two coordinates, a speed and gravity. Differences that are not known well by themselves are left out.
    """
    try:
        start = mbd.assemble(model)
        run = mbd.simulate(model, start, scheme, dt=dt, until=until)
    except (mbd.SimulationError, mbd.AssemblyError, mbd.ModelError) as error:
        return f"no run: {error}"
    names = [*start.names[:2], start.velocity_names[-1]]
    names += [name for name in ("gravity.x", "gravity.y") if name in run.record.parameter_names]
    try:
        state, time = final_state_derivative(run, names)
    except mbd.CapabilityError as error:
        return f"refused: {error}"
    try:
        found = differences(model, start, scheme, names, step, dt=dt, until=until)
    except mbd.SimulationError as error:
        return f"no neighbours: {error}"
    if found is None:
        return "another sequence of events"
    wanted, noise = found
    noise = noise + ROUND_OFF / (step * np.max(np.abs(wanted), axis=0))
    known = noise < 1e-5
    return off(np.vstack([state, time]), wanted)[known], noise[known]
