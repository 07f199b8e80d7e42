"""The law kit: checks that a class of one's own keeps the laws of mechanics, and strategies for property tests.

``check_joint``, ``check_loss``, ``check_force``, ``check_measure``, ``check_constraint``, ``check_model``,
``check_integrator`` and ``check_scheme`` take what a user wrote, try the laws at seeded postures or along runs, and
raise an `AssertionError` that names each broken law, the numbers expected and found, and the posture that shows it;
what holds is returned as a `Verdict`.

``postures``, ``frames``, ``trees``, ``loops``, ``scenes`` and ``states`` are Hypothesis strategies (extra `test`).
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mbd.testing.constraints import check_constraint as check_constraint
    from mbd.testing.equations import check_model as check_model
    from mbd.testing.findings import LawBroken as LawBroken, Verdict as Verdict
    from mbd.testing.forces import check_force as check_force
    from mbd.testing.integrators import check_integrator as check_integrator
    from mbd.testing.joints import check_joint as check_joint
    from mbd.testing.losses import check_loss as check_loss
    from mbd.testing.measures import check_measure as check_measure
    from mbd.testing.mechanisms import (
        random_loop as random_loop,
        random_scene as random_scene,
        random_tree as random_tree,
    )
    from mbd.testing.schemes import check_scheme as check_scheme
    from mbd.testing.strategies import (
        frames as frames,
        loops as loops,
        postures as postures,
        scenes as scenes,
        states as states,
        trees as trees,
    )

_HOMES = {
    "constraints": "check_constraint",
    "equations": "check_model",
    "findings": "LawBroken Verdict",
    "forces": "check_force",
    "integrators": "check_integrator",
    "joints": "check_joint",
    "losses": "check_loss",
    "measures": "check_measure",
    "mechanisms": "random_loop random_scene random_tree",
    "schemes": "check_scheme",
    "strategies": "frames loops postures scenes states trees",
}

_NAMES = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = [*_NAMES]


def __getattr__(name: str) -> Any:
    """A name of the kit, from its module, when it is first used (PEP 562)."""
    import importlib

    if name not in _NAMES:
        raise AttributeError(f"mbd.testing has no {name!r}; it has {', '.join(_NAMES)}")
    value = globals()[name] = getattr(importlib.import_module(f"mbd.testing.{_NAMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_NAMES})
