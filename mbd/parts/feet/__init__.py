"""Feet: where a leg meets the ground."""
