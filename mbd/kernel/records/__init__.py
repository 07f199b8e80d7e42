"""The numbers that stepping and switching work on: each with its name, its length, and what it is.

Groups hold the numbers, and each knows the sizes and settings; records put together from groups are what functions of
one kind take. `K` is the record in every function, and its annotation the least that has all that the function and what
it calls read or write: ``K: Events`` is blind to contacts, ``K: Balance`` cannot store a row. At run time there is one
record, `Kernel`, and in machine code one table of addresses.

    Motion         State, Model: the model at the accepted state and at the candidate
    ContactRows    Frictions (with Contacts), Model
    Mechanism      ContactRows, Motion: all that model code is evaluated at
    Guards         Events, Mechanism
    ContactForces  Complementarity, ContactRows
    Equations      LinearAlgebra, Report, Motion
    Steps          Memory, Equations: what a scheme steps with
    DependentRows  Singular, Mechanism, Equations
    SingularSteps  DependentRows, Steps: beside and over singular configurations
    Balance        ContactForces, DependentRows: consistent accelerations, impulses
    Switching      Results, Guards, Balance: all but the memory of the scheme
    Kernel         Switching, SingularSteps, Runs: many of them in one call

Lengths follow from `Sizes`: n_q coordinates, n = n_v + n_z rates, rows, contacts, guards of the user, frictions,
anchors. An index that is itself read from an array stays within these because of who writes it:

row_contact, row_friction, friction_row, friction_contact, normal, while_target, when_target, anchor_start
    by the active set, from the equations; no run writes them.
rows, columns, pivots, support, cone_rows, members, own_columns, event_kind, event_index
    by the kernel, in the loop that counts them, before they are read.
mode_code, mode_order, orders
    by `Stepper.add_mode`, for the mode whose number is below n_known.
n_stored, n_logged
    compared with `capacity` and `event_capacity` before every step and once more where a row or a line is written.

Every array has room for one number at least. `tests/kernel/test_guard_pages.py` runs scenes with a page beside each
array that can be neither read nor written.
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.records.contacts import ContactRows, Contacts, Events, Frictions, Guards, Mechanism
from mbd.kernel.records.declare import Integers, Reals, Table
from mbd.kernel.records.runs import Runs
from mbd.kernel.records.settings import SchemeAbilities, Settings, Sizes
from mbd.kernel.records.solution import (
    Balance,
    Complementarity,
    ContactForces,
    DependentRows,
    Equations,
    LinearAlgebra,
    Report,
    Results,
    Singular,
    SingularSteps,
    Steps,
    Switching,
)
from mbd.kernel.records.state import MODE_CAPACITY, PROGRAMS, Memory, Model, Motion, State

__all__ = [
    "MODE_CAPACITY", "PROGRAMS", "TABLE", "Balance", "Complementarity", "ContactForces", "ContactRows", "Contacts",
    "DependentRows", "Equations", "Events", "Frictions", "Guards", "Integers", "Kernel", "LinearAlgebra", "Mechanism",
    "Memory", "Model", "Motion", "Reals", "Report", "Results", "Runs", "SchemeAbilities", "Settings", "Singular",
    "SingularSteps", "Sizes", "State", "Steps", "Switching",
]  # fmt: skip


class Kernel(Switching, SingularSteps, Runs):
    """All of them."""

    hooks: Any  # the scheme of the interpreted kernel


TABLE = Table(Kernel)
