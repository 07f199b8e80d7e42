"""Does it walk? Limit cycles of walkers, their stability, and how they change with a parameter.

`limit_cycle` finds a walk that repeats itself, `find_gait` looks for one from many starts, `branch` follows it as a
parameter changes. Below them: `mirror` (sides exchanged), `section` (the states just after an event), `return_map`
(from one event to the next), `map_derivative`, `newton`, `floquet`.
"""
