"""Derivatives of runs of mechanisms that turn freely, held against differences of runs from starts q ⊕ δq, v + δv."""

from dataclasses import replace

import numpy as np

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.sensitivity.derivative import final_state_derivative
from mbd.sensitivity.tangent_names import place_names


def all_names(model):
    """Of every direction of the configuration, and of every velocity."""
    equations = mechanism_of(model).equations
    return [*place_names(equations), *equations.velocity_names]


def judged(model, start, scheme, ways=2, seed=0, parameters=(), step=2e-4, speeds=True, alike=False, **settings):
    """How far derivatives of (q, v, t) at the end are off differences, over the largest; and how well these are known.

    In random directions of the whole start, and by parameters. None where a change makes another sequence of events.

    alike : leave out changes with which steps take other numbers of Newton's matrices, in whose metric the
        stabilized form corrects positions; None where that are all
    """
    chance, configuration = np.random.default_rng(seed), mechanism_of(model).equations.configuration
    n, names = configuration.n_v, all_names(model)
    run = mbd.simulate(model, start, scheme, **settings)
    state, time = final_state_derivative(run, [*names, *parameters])
    found = np.vstack([state, time])
    events = [(event.kind, event.name) for event in run.events]
    changes = [(chance.normal(size=2 * n), {}) for _ in range(ways)]
    if not speeds:
        changes = [(np.append(change[:n], np.zeros(n)), {}) for change, _ in changes]
    changes += [(np.zeros(2 * n), {name: model.parameters[name]}) for name in parameters]
    by_metric = alike and getattr(scheme, "formulation", "") == "ggl"
    off, noise = [], []
    for change, values in changes:
        quotients, others = [], False
        for size in (step, step / 2.0):
            ends = []
            for sign in (1.0, -1.0):
                dx, dv = np.split(sign * size * change, [n])
                own = {name: (1.0 + sign * size) * value for name, value in values.items()}
                moved = replace(start, q=configuration.compose(start.q, dx), v=start.v + dv, memory=None)
                moved = mbd.project(model, moved, parameters={**start.parameters, **own})
                other = mbd.simulate(model, moved, scheme, parameters=own, **settings)
                if [(event.kind, event.name) for event in other.events] != events:
                    return None
                others = others or (by_metric and other.stats["tangents"] != run.stats["tangents"])
                last = other.final
                ends.append(np.concatenate([configuration.difference(run.final.q, last.q), last.v, [last.time]]))
            quotients.append((ends[0] - ends[1]) / (2.0 * size))
        if others:
            continue
        wanted = (4.0 * quotients[1] - quotients[0]) / 3.0
        by = np.concatenate([change, [values.get(name, 0.0) for name in parameters]])
        off.append(np.max(np.abs(found @ by - wanted)) / np.max(np.abs(wanted)))
        noise.append(np.max(np.abs(quotients[1] - quotients[0])) / np.max(np.abs(wanted)))
    return (np.array(off), np.array(noise)) if off else None
