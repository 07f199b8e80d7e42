"""What is known not to hold: pairs of a case and a scheme, each with the reason. The one place to list them."""

KNOWN: dict[tuple[str, str], str] = {}
"""Reasons by case and scheme.

Not an excuse: what stands here fails, the command says so and its exit code is 1. A test complains once it holds.
"""


def reason(case: str, scheme: str) -> str:
    """Why a case does not hold with a scheme; '' where that is not known."""
    return KNOWN.get((case, scheme), "")
