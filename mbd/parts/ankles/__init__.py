"""Ankles: what joins shank and foot."""
