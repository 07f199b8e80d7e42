"""Knees: what joins thigh and shank."""
