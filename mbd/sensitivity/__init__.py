"""Exact first derivatives of runs: a pass over the accepted steps and events after the run."""
