"""Stepping, switching, impact and restart on plain numbers.

Every function here is written in the subset of Python that is both interpreted, as the
reference that needs no compiler, and turned into machine code once per machine. Arrays are
flat; a `Kernel` record carries them; nothing is allocated while stepping.
"""
