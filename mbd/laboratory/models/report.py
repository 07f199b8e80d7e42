"""What became of a file of another program: the model, and what of the file is in it."""

from dataclasses import field
from typing import Any

from mbd.bodies.base import Body
from mbd.dataclass import dataclass
from mbd.joints.base import Joint


@dataclass
class ImportReport:
    """What was understood, approximated and left out, a sentence each with the names of the file."""

    understood: list[str] = field(default_factory=list)
    approximated: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        parts = []
        for title, sentences in (
            ("understood", self.understood), ("approximated", self.approximated), ("left out", self.left_out),
        ):  # fmt: skip
            parts += [f"{title}:", *(f"  {sentence}" for sentence in sentences)] if sentences else []
        return "\n".join(parts)


@dataclass(frozen=True, eq=False)
class ImportedModel:
    """A model that was read from a file.

    Attributes
    ----------
    model : a `Model` of plain words, to be changed like any other
    bodies, joints : by their names in the file
    report : what of the file is in it
    driven : of an `.osim` with motions that are functions of coordinates or coupled, the joints whose coordinates are
        free: ``mbd.inverse_dynamics(found.model, motion, joints=found.driven)``; None where all are
    muscles : `mbd.Muscle` by their names; they act after ``found.model.apply(*found.muscles.values())``, and
        `mbd.muscle_forces` takes them as they are
    posture : coordinates of the file's own posture, where it says one: ``mbd.assemble(found.model, found.posture)``
    """

    model: Any
    bodies: dict[str, Body]
    joints: dict[str, Joint]
    report: ImportReport
    posture: dict[str, Any] = field(default_factory=dict)
    muscles: dict[str, Any] = field(default_factory=dict)
    driven: list[str] | None = None

    def __repr__(self) -> str:
        return f"ImportedModel '{self.model.name}': {len(self.bodies)} bodies, {len(self.joints)} joints\n{self.report}"
