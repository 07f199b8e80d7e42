"""Derivatives of a run by central differences of runs with equal steps, extrapolated (Richardson 1911)."""

from dataclasses import replace

import numpy as np

import mbd


def end(model, start, scheme, name, change, parameters=None, **settings):
    """(q, v, t) at the end of a run whose start or parameter `name` is changed; and its events."""
    values, q, v = dict(parameters or {}), np.array(start.q), np.array(start.v)
    if name in start.names:
        q[start.names.index(name)] += change
    elif name in start.velocity_names:
        v[start.velocity_names.index(name)] += change
    elif name:
        values[name] = values.get(name, model.parameters[name]) + change
    moved = mbd.project(model, replace(start, q=q, v=v, memory=None), parameters=values)
    run = mbd.simulate(model, moved, scheme, parameters=values, **settings)
    state = np.concatenate([run.final.q, run.final.v, [run.final.time]])
    return state, [(event.kind, event.name) for event in run.events]


def differences(model, start, scheme, names, step=1e-4, **settings):
    """(n_q + n_v + 1, D) derivatives of (q, v, t) at the end; and how well they are known, relative to the largest.

    None where a change of the start changes the sequence of events.
    """
    expected = end(model, start, scheme, "", 0.0, **settings)[1]
    columns, noise = [], []
    for name in names:
        quotients = []
        for size in (step, step / 2.0):
            (ahead, one), (behind, two) = (
                end(model, start, scheme, name, sign * size, **settings) for sign in (1.0, -1.0)
            )
            if one != expected or two != expected:
                return None
            quotients.append((ahead - behind) / (2.0 * size))
        columns.append((4.0 * quotients[1] - quotients[0]) / 3.0)
        noise.append(np.max(np.abs(quotients[1] - quotients[0])) / np.max(np.abs(columns[-1])))
    return np.column_stack(columns), np.array(noise)


def off(found, wanted):
    """The largest difference of each column over its largest entry."""
    return np.max(np.abs(found - wanted), axis=0) / np.max(np.abs(wanted), axis=0)
