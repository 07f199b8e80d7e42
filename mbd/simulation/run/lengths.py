"""How long each array of the kernel is, and what bounds the indices into it.

Indices are built from the sizes of the mechanism: n_q coordinates, n = n_v + n_z rates, rows, contacts, guards of the
user, frictions, anchors. An index that is itself read from an array stays within these because of who writes it:

row_contact, row_friction, friction_row, friction_contact, normal, while_target, when_target, anchor_start
    by the active set, from the equations; no run writes them.
rows, columns, pivots, support, lcp_who, lcp_rows, fired
    by the kernel, in the loop that counts them, before they are read.
mode_code, mode_order, orders
    by `Stepper.add_mode`, for the mode whose number is below mode_count.
state[STORED], state[LOGGED]
    compared with `capacity` and `event_capacity` before every step and once more where a row or a line is written.

Every array has room for one number at least. `tests/kernel/test_guard_pages.py` runs scenes with a page beside each
array that can be neither read nor written.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from mbd.integrators.dormand_prince import STAGES
from mbd.kernel.lemke import lemke_places
from mbd.kernel.schemes.stages import STAGES_END, stage_place

__all__ = ["NEWMARK", "PROGRAMS", "RADAU_IIA", "RUNGE_KUTTA", "array_lengths"]

NEWMARK, RUNGE_KUTTA, RADAU_IIA = range(3)
"""Numbers of the kernel's own schemes."""
PROGRAMS = 4
"""Programs of a mode: tangent, residual, correction and solution; 0 stands for the last two where there are none."""
MODE_CAPACITY = 16
"""Modes for which a table is laid out at the start; it doubles as it fills."""


def array_lengths(sizes: Mapping[str, Any], block: int, accelerations: int) -> tuple[dict[str, int], dict[str, int]]:
    """Lengths of the real and of the integer arrays, but for the tables of the active set.

    Parameters
    ----------
    sizes : integers of the kernel by name
    block : numbers that model code reads
    accelerations : numbers that the program of that name writes
    """
    n, n_q, rows, contacts, guards = (sizes[name] for name in ("n", "n_q", "n_rows", "n_contacts", "n_guards"))
    frictions, n_v, watched = sizes["n_frictions"], sizes["n_v"], sizes["n_watched"]
    size, unknowns = n + rows, contacts + 3 * frictions
    tail = n + 2 * rows + rows * n
    reals = {
        "block": block, "out": max(size * size + 3 * tail + 2 * size + 2, block), "clock": 16, "acc": accelerations,
        "q": n_q, "y": n, "rate": n, "aux": n, "slope": n, "lam": rows, "lam_slope": rows, "left": rows + 1,
        "left1": rows + 1, "shift": n, "shift_change": n, "anchors": sizes["n_anchors"],
        "q1": n_q, "y1": n, "rate1": n, "aux1": n, "lam1": rows,
        "basis": (rows + 1) * n, "lower": (rows + 1) * rows, "mix": rows * rows, "shares": rows * rows,
        "kkt": size * size, "rhs": size, "spare": 2 * size * (size + 1) + tail, "turning": rows * n,
        "work": 3 * size, "force": n, "bias": rows, "jump": n, "impulse": rows,
        "guards0": watched, "guards1": watched, "doubt": 2 * watched + 2 * n, "scale": n + 2 * rows, "weight": n,
        "known": n + 2 * rows, "pace": 5 * contacts,
        "seen": 1 + 2 * contacts + 2 * frictions + guards + n_q + n,
        "deepest": contacts, "sinking": contacts, "side": guards, "crossed": guards, "pick": 8, "detail": 12,
        "slip": frictions, "limit": frictions, "base_limit": frictions, "lean": frictions, "typical": n,
        "given": rows, "total": rows, "total_jump": n, "loads": rows, "before": contacts, "past": rows,
        "past_limit": frictions, "trial": rows, "trial_given": rows, "trial_jump": n,
        "lcp_matrix": unknowns * unknowns, "lcp_shift": unknowns, "lcp_found": unknowns,
        "lcp_work": lemke_places(unknowns), "lcp_limit": frictions, "lcp_slope": frictions,
        "stages": _stages(sizes), "error": n_v + n,
        "past_stages": 3 * (n + rows + n_v) if sizes["scheme"] == RADAU_IIA else 0,
        "inside": 2 * watched + 2 * rows + n_q + 2 * n,
        "kept": n_q + 2 * n + rows + watched + sizes["n_anchors"] + frictions,
        "store": sizes["capacity"] * sizes["width"], "log": sizes["event_capacity"] * sizes["event_width"],
    }  # fmt: skip
    integers = {
        "unit": n, "notify": contacts + guards + frictions, "closed": contacts,
        "armed": contacts, "touched": contacts, "active": contacts + guards + frictions, "free": contacts,
        "closing": contacts, "parting": contacts, "lifting": rows, "kept_flags": 3 * contacts + 3 * frictions,
        "sticks": frictions, "loose": frictions, "was": frictions, "let_go": frictions, "dropped": rows,
        "mode_key": MODE_CAPACITY * (contacts + rows + frictions),
        "mode_code": PROGRAMS * MODE_CAPACITY, "mode_order": MODE_CAPACITY, "orders": 1, "support": rows * (n + 2),
        "mode_count": 1, "rows": rows,
        "pivots": size, "columns": size, "lcp_rows": contacts + frictions, "lcp_who": contacts + frictions,
        "lcp_basis": unknowns, "fired": 2, "state": 24, "counts": 24,
    }  # fmt: skip
    return reals, integers


def _stages(sizes: Mapping[str, Any]) -> int:
    """Numbers that the stages of a step take."""
    if sizes["scheme"] == RADAU_IIA:
        return stage_place(SimpleNamespace(**sizes), STAGES_END)
    return (STAGES + 1) * (sizes["n_v"] + sizes["n"]) if sizes["scheme"] == RUNGE_KUTTA else 0
