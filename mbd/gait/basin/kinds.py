"""The outcomes of starts, by number and letter."""

KINDS: tuple[str, ...] = (
    "walks", "falls forward", "falls backward", "falls", "scuffs", "stands", "chatters", "numerical error",
    "other event", "wrong contacts", "misses", "not on the section", "not decided",
)  # fmt: skip
"""walks: comes into the ball round an attractor; falls (forward, backward; to which side is not known); scuffs: the
section's foot comes down at once, or on the side that it left from; stands: no more section, and at rest; chatters:
switches without end at one instant; numerical error: a step that cannot be made; other event: one that ends runs;
wrong contacts: other contacts are closed on the section; misses: the section does not come within the longest time; not
on the section: the start violates its constraints; not decided: still walking after all steps, outside every ball."""
NUMBER = {kind: number for number, kind in enumerate(KINDS)}
"""The place of each among them."""
LETTERS = "WFBfsSxEocmn?"
"""A letter for each, as files have them."""
