"""Friction of a contact as users give it: μ, or a loss per newton of normal force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss, without_states
from mbd.joints.losses.isotropic import isotropic
from mbd.tape.node import Scalar

__all__ = ["friction_of", "resistance"]


def friction_of(value: Any, name: str) -> float | Loss | None:
    """What a contact's friction may be: None, μ, or a loss of the slip's speed, its force per newton of normal force.

    Raises
    ------
    ModelError
        for anything else, and a loss that follows the force in a joint.
    """
    if isinstance(value, Loss):
        if value.needs_reaction:
            raise ModelError(
                f"friction of '{name}': {value!r} follows the force in a joint; friction of a contact follows its "
                "normal force by itself: give μ, or mbd.Viscous(…)"
            )
        instead = "give a contact mbd.Coulomb, mbd.Stribeck, mbd.Viscous or μ"
        return without_states(value, f"friction of '{name}'", instead)
    if value is None:
        return None
    return number(value, f"friction of '{name}'")


def resistance(loss: Loss, push: Scalar, speeds: Sequence[Scalar], scope: Scope, owner: str) -> list[Scalar]:
    """Forces on the mechanism along one slip, or two that are perpendicular: −p F(‖γ‖) γ/‖γ‖, F of the smooth part."""
    return [-push * part for part in isotropic(loss, speeds, scope, owner)]
