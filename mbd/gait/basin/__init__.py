"""Which starts walk, and what becomes of the others."""
