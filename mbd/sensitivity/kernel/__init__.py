"""Steps of a run with their derivatives, in the Python of the stepping kernel (`mbd.kernel`): interpreted or compiled.

Derivatives stand in flat arrays (rows, S[WIDTH]): a row for each quantity, a column for each direction, with zeros up
to a multiple of four. `S` holds sizes and places by the names of `sizes`; an array `entries` says what the numbers of
the program `steps` or `consistent` are. A function that meets a singular matrix returns how far it came; numpy, with
least solutions, takes the step.
"""
