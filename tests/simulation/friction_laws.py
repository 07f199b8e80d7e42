"""Coulomb's and Stribeck's laws in every row of a run, from the stored numbers and the equations at the row itself."""

from dataclasses import replace

import numpy as np

AT_ONSET = 5e-7
"""Speed [m/s] that stands for the slip in the direction in which sliding begins, with a little room."""


def broken_laws(run):
    """Every row that pulls, leaves a cone, slides by another force than its law, or has pushes that do not hold."""
    columns = run.columns
    record, equations = columns.record, columns.equations
    lam, closed = record.lam, record.closed.astype(bool)
    size = np.maximum(np.max(np.abs(lam), axis=1), 1e-9)
    found = []
    for c, contact in enumerate(equations.contacts):
        push = -lam[:, contact.rows[0]]
        found += [("pull", i, push[i] / size[i]) for i in np.flatnonzero(closed[:, c] & (push < -1e-7 * size))]
    frictions = equations.frictions
    nodes = [each for f in frictions for each in (f.rate, f.limit, f.sliding)]
    values = [np.broadcast_to(value, run.time.shape) for value in columns.evaluate(nodes, columns.rows)]
    rates, rest, sliding = values[0::3], values[1::3], values[2::3]
    for f, friction in enumerate(frictions):
        group = friction.group or (f,)
        if group[0] != f:
            continue
        force = np.stack([lam[:, frictions[k].row] for k in group])
        slip = np.stack([rates[k] for k in group])
        pull, speed = np.linalg.norm(force, axis=0), np.linalg.norm(slip, axis=0)
        most = np.maximum(rest[f], sliding[f])
        found += [("cone", i, pull[i] / most[i]) for i in np.flatnonzero(pull > most + 1e-6 * size)]
        moves = (np.abs(record.phase[:, f]) == 1) & (speed > 1e-5)
        off = np.linalg.norm(force - sliding[f] * slip / np.maximum(speed, 1e-300), axis=0)
        allowed = size * (1e-4 + AT_ONSET / np.maximum(speed, 1e-300))
        found += [("law", i, off[i] / size[i]) for i in np.flatnonzero(moves & (off > allowed))]
    return found + inconsistent(run, size)


def inconsistent(run, size):
    """Rows whose pushes are off by 2 % of the largest force, by the accelerations of what is closed or sticks."""
    columns = run.columns
    record, equations = columns.record, columns.equations
    bare = replace(columns.rows, phase=np.where(np.abs(columns.rows.phase) == 1, 0, columns.rows.phase))
    M, _, R, B, _, _, bias, *_ = columns.balance.terms_at(bare)
    rate, found = np.hstack([record.a, record.s]), []
    for i in range(len(run.time)):
        held, ways = [], []
        for k, row in enumerate(equations.rows):
            off = row.contact >= 0 and not record.closed[i, row.contact]
            if off or (row.friction >= 0 and record.phase[i, row.friction] != 2):
                continue
            way = R[i][:, k].copy()
            if row.contact >= 0 and row.friction < 0 and record.lam[i, k] < 0.0:  # its friction follows its push
                for f, friction in enumerate(equations.frictions):
                    if friction.contact == row.contact and abs(record.phase[i, f]) == 1:
                        way += R[i][:, friction.row] * record.lam[i, friction.row] / record.lam[i, k]
            held.append(k)
            ways.append(way)
        if held:
            ease = B[i][held] @ np.linalg.solve(M[i], np.array(ways).T)
            more = np.linalg.lstsq(ease, B[i][held] @ rate[i] + bias[i][held], rcond=1e-7)[0]
            if np.max(np.abs(more)) > 0.02 * max(size[i], float(np.median(size))):
                found.append(("push", i, float(np.max(np.abs(more)) / size[i])))
    return found
