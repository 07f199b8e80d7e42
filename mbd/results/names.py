"""How names of results are built."""

from __future__ import annotations

__all__ = ["AXES"]

AXES = (".x", ".y", ".z")
"""Endings of the components of a vector."""
