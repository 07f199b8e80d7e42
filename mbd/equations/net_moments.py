"""Net moments of joints: all that acts along a joint's coordinate but gravity, the ground and forces from outside."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

from mbd.equations.equations import Equations
from mbd.equations.outputs import AXES, Outputs
from mbd.tape.derivatives import gradient
from mbd.tape.node import Node


def net_moments(equations: Equations, outside: Collection[str]) -> list[Node]:
    """``τ_k = −Σ f_k − Σ λ ∂h/∂q_k`` (n_v,), the sums over losses, springs, motors, stops, locks and closed loops.

    outside : names of contacts of the ground and of forces that act from outside, which are left out
    """
    tape = equations.tape
    with tape.lock:
        count = equations.n_v
        total = [tape.zero] * count
        dry = {f"{friction.name} friction" for friction in equations.frictions}
        # effects, with the switches of penalty contacts; dry friction is a row
        for effect in equations.effects:
            of_ground = effect.contact >= 0 and equations.contacts[effect.contact].name in outside
            if effect.kind == "gravity" or of_ground or effect.name in outside or effect.name in dry:
                continue
            switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
            for k, force in zip(range(count), effect.generalized(), strict=False):  # first-order states stand behind
                total[k] = total[k] - switch * force
        # rows with their multipliers
        x, v = ([tape.input(kind, k) for k in range(count)] for kind in ("x", "v"))
        for number, row in enumerate(equations.rows):
            if row.contact >= 0 and equations.contacts[row.contact].name in outside:
                continue
            slopes = gradient(row.rate, v) if row.is_velocity else gradient(row.value, x)
            for k, slope in enumerate(slopes):
                if not slope.is_zero:
                    total[k] = total[k] - tape.input("lam", number) * slope
    return total


def effort_name(velocity: str, kind: str) -> str:
    """The name of the effort along a velocity.

    >>> effort_name("ankle.plantar.rate", "moment"), effort_name("left hip.angular_velocity.x", "moment")
    ('ankle.plantar.moment', 'left hip.moment.x')
    """
    if velocity.endswith(".rate"):
        return f"{velocity.removesuffix('.rate')}.{kind}"
    owner, _, axis = velocity.rpartition(".")
    return f"{owner.rpartition('.')[0]}.{kind}.{axis}"


def offer_net_moments(outputs: Outputs, equations: Equations, outside: Collection[str] = ()) -> None:
    """'knee.angle.net_moment' [N m] of each coordinate, 'knee.net_moment' of a joint with one; '….net_force' [N].

    They are made when one is asked for, and are not listed, so that a table or a file of all results does without.

    outside : names of forces that act from outside
    """
    made: list[Node] = []

    def component(k: int) -> Node:
        if not made:
            places = zip(equations.contacts, contact_places(equations), strict=True)
            made.extend(net_moments(equations, {contact.name for contact, place in places if place} | set(outside)))
        return made[k]

    whole = equations.configuration
    owners = [name.removesuffix(".rate").rpartition(".")[0] for name in whole.velocity_names]
    for k, (name, unit) in enumerate(zip(whole.velocity_names, whole.velocity_units, strict=True)):
        kind = "net_moment" if unit.startswith("rad") else "net_force"
        outputs.add(effort_name(name, kind), partial(component, k), listed=False)
        if owners[k] and owners.count(owners[k]) == 1:
            outputs.add(f"{owners[k]}.{kind}", partial(component, k), listed=False)


def contact_places(equations: Equations) -> list[str]:
    """The frame that each contact touches with, whose position it captures or whose height is its gap; '' without one.

    A stop of a joint touches with none.
    """
    names = set(equations.output_names())
    frames = [name[:-3] for name in equations.output_names() if name.endswith(".vx") and f"{name[:-3]}.x" in names]
    axes = [f".{axis}" for axis in AXES]
    positions = {frame: [equations.output(frame + axis) for axis in axes] for frame in frames if equations.contacts}
    found = []
    known = {c: p for shape in equations.shapes for c, p in zip(shape.contacts, shape.points, strict=True)}
    for contact in equations.contacts:
        captured = {node.index for node in contact.captured}
        found.append(f"{contact.name}.foot" if contact.foot else known.get(contact.name, ""))
        for frame, position in ({} if found[-1] else positions).items():
            moving = {node.index for node in position if not node.is_constant}
            if captured == moving if captured else contact.gap is position[1]:
                found[-1] = frame
                break
    return found
