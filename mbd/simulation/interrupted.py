"""Runs that their user ended, which end a study too."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory


def stopped(run: Trajectory) -> bool:
    """Whether a run ended because the user wanted it to."""
    return not run.success and run.message.startswith("interrupted")
