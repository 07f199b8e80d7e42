"""The kernel's Python as typed trees, and what prints these as machine code."""
