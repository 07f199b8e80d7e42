"""Runs that their user ended, which end a study too."""

from mbd.results.trajectory import Trajectory


def stopped(run: Trajectory) -> bool:
    """Whether a run ended because the user wanted it to."""
    return not run.success and run.message.startswith("interrupted")
