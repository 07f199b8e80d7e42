"""What is known not to hold: pairs of a case and a scheme, each with the reason. The one place to list them."""

from __future__ import annotations

__all__ = ["KNOWN", "reason"]

REFUSED_BESIDE_POSES = (
    "with 0.25 ms the run stops at 9.1 s beside a flat pose and says so: steps leave the branch continuous in "
    "velocity, down to a tenth of dt"
)

KNOWN: dict[tuple[str, str], str] = {("b2b-iftomm-a02-fourbar-N40", "RadauIIA"): REFUSED_BESIDE_POSES}
"""Reasons by case and scheme.

Not an excuse: what stands here fails, the command says so and its exit code is 1. A test complains once it holds.
"""


def reason(case: str, scheme: str) -> str:
    """Why a case does not hold with a scheme; '' where that is not known."""
    return KNOWN.get((case, scheme), "")
