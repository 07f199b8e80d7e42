"""Steppers that runs have left: arrays, tables and addresses that stand already for the next run of the same kind."""

from collections.abc import Hashable, Mapping
from typing import Any

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.integrators.base import Integrator
from mbd.integrators.stepping import own_scheme
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.schemes.contract import NO_SCHEME
from mbd.simulation.run.stepper import Stepper

OF_TRIALS = ("allowed", "longest")
"""Options that the trial runs of a tolerance differ by: numbers of the record, which nothing else follows from."""


def stepper_of(
    kind: type[Stepper],
    mechanism: Mechanism,
    manager: ActiveSetManager,
    integrator: Integrator,
    parameters: Vector,
    dt: float,
    options: dict[str, Any],
) -> Stepper:
    """A stepper for a run, as if it were new: one that an earlier run of this kind has left, where there is one."""
    key = _key(kind, manager, integrator, dt, options)
    try:
        found: Stepper | None = None if key is None else mechanism.idle.pop(key, None)
    except TypeError:  # it has no hash
        found = key = None
    if found is None:
        found = kind(mechanism, manager, integrator, parameters, dt, options)
        found.key = key
    else:
        found.manager, found.integrator = manager, integrator
        found.begin_again(parameters, float(options.get("end", 0.0)))
        vars(found.kernel).update((name, options[name]) for name in OF_TRIALS if name in options)
    return found


def keep_idle(stepper: Stepper) -> None:
    """Keep the stepper of a run that is over, of whose arrays nobody holds a part any more."""
    if stepper.key is None or not stepper.max_idle:
        return
    idle = stepper.mechanism.idle
    if len(idle) >= stepper.max_idle:
        idle.clear()
    stepper.let_go()
    idle[stepper.key] = stepper


def _key(
    kind: type[Stepper], manager: ActiveSetManager, integrator: Integrator, dt: float, options: Mapping[str, Any]
) -> Hashable:
    """What the arrays of a stepper and its numbers depend on, besides the mechanism; None where that cannot be told."""
    if own_scheme(integrator) is NO_SCHEME:
        return None
    own = tuple(item for item in options.items() if item[0] != "end" and item[0] not in OF_TRIALS)
    given = () if type(integrator).__module__.startswith("mbd.") else integrator.numbers().items()
    return (kind, integrator, *given, manager.trivial, dt, *own)
