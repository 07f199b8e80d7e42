"""First-order states of forces, losses and laws: ``ż = s(t, q, v, z)`` beside the balance."""

from collections.abc import Iterable, Sequence

from mbd.equations.derivation_scope import DerivationScope
from mbd.errors import ModelError
from mbd.tape.node import Node, Scalar


def has_pairs(given: object) -> bool:
    """Whether it is a sequence of pairs."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        return False
    return all(isinstance(pair, Sequence) and len(pair) == 2 for pair in given)


def state_balance(scope: DerivationScope, rates: Iterable[tuple[Node, Scalar]]) -> list[Node]:
    """ż − s of every first-order state, in the order in which words asked for them.

    Raises
    ------
    ModelError
        for each state without a rate.
    """
    given = {state.index: rate for state, rate in rates}
    missing = [coordinate.name for coordinate, node in scope.states if node.index not in given]
    if missing:
        raise ModelError(
            [
                f"state '{name}' has no rate; '{name.rpartition('.')[0]}' must list it, a force in Action.rates, a law "
                "in Law.rates, a loss in what rates() returns"
                for name in missing
            ]
        )
    return [scope.tape.input("s", k) - scope.real(given[node.index]) for k, (_, node) in enumerate(scope.states)]


def with_states(scope: DerivationScope, forces: Sequence[Node]) -> tuple[Node, ...]:
    """Generalized forces (n_v) with zeros in the rows of all states (n_v + n_z).

    It is called once all words have acted, for each of them may bring states.
    """
    return (*forces, *[scope.tape.zero] * (len(scope.inputs.v) + len(scope.states) - len(forces)))
