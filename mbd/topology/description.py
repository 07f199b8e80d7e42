"""A mechanism in words: what is connected to what."""

import copy
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Self, TypeVar, cast

from mbd.bodies.base import Bodies, Body, Frame
from mbd.bodies.ground import Ground
from mbd.bodies.promises import promise_faults
from mbd.bodies.values import Vector3, is_number, names_of, number, printable, triple
from mbd.constraints.base import Constraint
from mbd.constraints.controller import Controller
from mbd.constraints.event import Event
from mbd.constraints.impulse import Impulse
from mbd.constraints.machine import Machine
from mbd.constraints.observation import Observation
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.forces.base import Force
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.notes import doubt

Word = TypeVar("Word")

SHOWN = 120
"""Letters of a wrong argument that an error shows."""


def on_slope(slope: float, g: float = 9.81) -> Vector3:
    """Gravity in axes that lie on a slope: ``(g sin γ, −g cos γ, 0)``, so that +x walks downhill.

    Angles published from the vertical become angles from the slope's normal by adding γ.

    Parameters
    ----------
    slope : γ [rad], positive where +x goes down
    g : [m/s²]

    Warns (`mbd.MbdWarning`) of a slope beyond the vertical, which was hardly meant.
    """
    gamma, size = number(slope, "slope"), number(g, "g")
    if abs(gamma) > 0.5 * math.pi:
        doubt(
            f"a slope of {gamma:g} rad is beyond the vertical; angles are in radians, and {gamma:g}° is "
            f"math.radians({gamma:g}) = {math.radians(gamma):.4g}"
        )
    return (size * math.sin(gamma), -size * math.cos(gamma), 0.0)


class Description:
    """The words of a mechanism: bodies connected by joints, under forces and constraints.

    `Model` is what users hold: this with all that follows from it. Topology and equations ask for these words alone.
    """

    def __init__(
        self,
        name: str,
        gravity: Any = (0.0, -9.81, 0.0),
        cut: str | Iterable[str] = "auto",
        tunable: Iterable[str] = (),
    ) -> None:
        self.name = _title(name)
        self.gravity = gravity
        self.cut: str | tuple[str, ...] = cut if isinstance(cut, str) else names_of(cut, f"cut of '{name}'")
        self.tunable = names_of(tunable, f"tunable of '{name}'")
        self.ground = Ground()
        self.joints: list[Joint] = []
        self.forces: list[Force] = []
        self.constraints: list[Constraint] = []
        self.controllers: list[Controller] = []
        self.observations: list[Observation] = []

    # the three verbs ----------------------------------------------------------------------------------------------
    def connect(self, *joints: Joint) -> None:
        """Add joints, and with them the bodies that they connect."""
        example = "connect takes joints such as mbd.Revolute('knee', thigh.end, shank.start)"
        self.joints += all_are(Joint, joints, example)

    def constrain(self, *constraints: Constraint) -> None:
        """Add constraints and events.

        Raises
        ------
        ModelError
            for what is no constraint, or a class of one's own that lacks what the equations ask it for, by name.
        """
        example = (
            "constrain takes constraints such as mbd.Unilateral('foot', mbd.touchdown(shank.end)), and events; "
            "forces and controllers go to apply"
        )
        self.constraints += served(all_are(Constraint, constraints, example))

    def apply(self, *forces: Force | Controller | Machine) -> None:
        """Add forces, controllers, and modes or sampled laws, which `constrain` takes too."""
        example = "apply takes forces such as mbd.Motor('drive', hip, torque=1.0), controllers and modes"
        known = all_are((Force, Controller, Machine), forces, example)
        self.constrain(*[word for word in known if isinstance(word, Machine)])
        self.forces += [word for word in known if isinstance(word, Force)]
        self.controllers += [word for word in known if isinstance(word, Controller)]

    def observe(self, name: str, function: Any, *arguments: Any, unit: str = "") -> None:
        """Add a result of one's own: a function of the motion and its forces that runs are asked for by `name`.

        ``model.observe("step length", lambda a, b: a[0] - b[0], left.end, right.end, unit="m")``,
        ``model.observe("load", lambda f: f / 9.81, "left foot.force")``, ``model.observe("lift", mbd.height(toe))``,
        ``model.observe("rise", lambda scope: scope.rate(scope.frame(toe).position[1]), unit="m/s")``

        It is recorded once, when the equations are derived, and evaluated where results are asked for it: steps cost
        nothing for it, and the motion is the same. It goes where results go: tables, plots, files, ``run.at(times)``.

        Parameters
        ----------
        name : of the result; three components make 'name.x', 'name.y', 'name.z', and the vector 'name'
        function : as of `mbd.measure`; or a measure; or the name of a result
        arguments : what it is called with, in order: names of results ('t', 'left hip.angle', 'left foot.force',
            observations before this one), frames (their positions), joints (their coordinates). Without them a
            function is called with the `mbd.bodies.scope.Scope`, whose ``named`` knows all results
        unit : for tables and plots

        Raises
        ------
        ModelError
            for what is neither of these; and when the equations are derived for a name that is taken, for what the
            function asks for in vain, and for a function that gives no numbers (TraceError).
        """
        self.observations = [*self.observations, Observation(name, function, arguments, unit)]

    def foreign(self) -> list[str]:
        """What was put into `joints`, `forces`, … that does not belong there, one sentence each."""
        kinds: dict[str, tuple[type, str]] = {
            "joints": (Joint, "connect"), "forces": (Force, "apply"), "constraints": (Constraint, "constrain"),
            "controllers": (Controller, "apply"),
        }  # fmt: skip
        return [
            f"model.{name} of '{self.name}' holds {word!r}, which is no {kind.__name__}; add them by model.{verb}(…)"
            for name, (kind, verb) in kinds.items()
            for word in getattr(self, name)
            if not isinstance(word, kind)
        ]

    def require_own(self) -> None:
        """Raise a `ModelError` with all of `foreign`, if there is some."""
        strange = self.foreign()
        if strange:
            raise ModelError(strange)

    # what it contains ---------------------------------------------------------------------------------------------
    @property
    def bodies(self) -> dict[str, Body]:
        """The ground and the bodies in the order in which joints first named them; then bodies named elsewhere."""
        self.require_own()
        result = Bodies({self.ground.name: self.ground})
        for frame in self.points():
            result.setdefault(frame.body.name, frame.body)
        return result

    @property
    def frames(self) -> dict[str, Frame]:
        """Every named frame by full name: those of the bodies, and the points that words refer to."""
        result = {frame.full_name: frame for body in self.bodies.values() for frame in body.frames.values()}
        for frame in (*self.points(), *self.markers, *self.observed):
            result.setdefault(frame.full_name, frame)
        return result

    @property
    def markers(self) -> list[Frame]:
        """The named points of the bodies, used or not; what is used under a name stands for that name."""
        points = self.points()
        used = {frame.full_name: frame for frame in reversed(points)}
        bodies = {id(frame.body): frame.body for frame in points} | {id(self.ground): self.ground}
        named = {name: frame for body in bodies.values() for name, frame in body.points.items()}
        return [used.get(name, frame) for name, frame in named.items()]

    @property
    def observed(self) -> list[Frame]:
        """The frames that observations alone refer to."""
        return [frame for observation in self.observations for frame in observation.frames()]

    @property
    def gravity(self) -> Vector3:
        """Gravity in ground axes [m/s²]; another one is checked as that of a new model."""
        return self._gravity

    @gravity.setter
    def gravity(self, value: Any) -> None:
        if is_number(value):
            raise ModelError(
                f"gravity of '{self.name}' is a vector [m/s²], such as (0.0, {-abs(value):g}, 0.0), got {value:g}"
            )
        self._gravity = triple(value, f"gravity of '{self.name}'")

    @property
    def bilaterals(self) -> list[Constraint]:
        """Constraints on positions that always act."""
        return [word for word in self.constraints if word.kind == "bilateral"]

    @property
    def nonholonomic(self) -> list[Constraint]:
        """Constraints on velocities, which always act."""
        return [word for word in self.constraints if word.kind == "nonholonomic"]

    @property
    def contacts(self) -> list[Constraint]:
        """Constraints that open and close, in order."""
        return [word for word in self.constraints if word.kind in ("unilateral", "penalty")]

    @property
    def events(self) -> list[Event]:
        """The user's own events."""
        return [cast(Event, word) for word in self.constraints if word.kind == "event"]

    @property
    def impulses(self) -> list[Impulse]:
        """Impulses that act as contacts close."""
        return [word for word in self.constraints if isinstance(word, Impulse)]

    @property
    def machines(self) -> list[Machine]:
        """Modes and sampled laws."""
        return [cast(Machine, word) for word in self.constraints if word.kind == "machine"]

    @property
    def parameters(self) -> dict[str, float]:
        """Every run-time parameter and its value in this description: {'left thigh.mass': 0.5, …}."""
        result = {f"gravity.{axis}": value for axis, value in zip("xyz", self.gravity, strict=True)}
        words: list[Body | Frame | Joint] = [
            *self.bodies.values(),
            *self.markers,
            *self.observed,
            *self.points(),
            *self.joints,
        ]
        for word in words:
            result |= word.parameters()
        taken = {force.name for force in self.forces}  # one may be named like the spring that a joint could have
        result = {name: value for name, value in result.items() if name.rpartition(".")[0] not in taken}
        actions: list[Force | Constraint] = [*self.forces, *self.constraints]
        for action in actions:
            result |= action.parameters()
        return result

    @property
    def laws(self) -> tuple[str, ...]:
        """Names of quantities of forces and constraints that are functions, expressions or samples."""
        words: list[Force | Constraint] = [*self.forces, *self.constraints]
        return tuple(name for word in words for name in word.laws())

    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities that forces and constraints refer to."""
        words: list[Force | Constraint] = [*self.forces, *self.constraints]
        return [mention for word in words for mention in word.mentions()]

    def points(self) -> list[Frame]:
        """The frames that joints, forces and constraints refer to."""
        frames = [frame for joint in self.joints for frame in (joint.parent, joint.child)]
        return frames + [mention for mention in self.mentions() if isinstance(mention, Frame)]

    def without(self, *names: str) -> Self:
        """A copy that lacks some joints, constraints or effects.

        Effects are those that `cost` lists: 'gravity', losses ('left knee loss', all of it), springs of joints, forces,
        penalty contacts, and dry friction alone ('left knee friction', 'box friction'), which leaves the rest of the
        loss or the contact.
        """
        names, model = names_of(names, "without"), copy.copy(self)
        known = {"gravity"}
        model.observations = [each for each in self.observations if each.name not in names and not _of_any(each, names)]
        for kind in ("joints", "forces", "constraints", "controllers"):
            words = getattr(self, kind)
            known |= {word.name for word in words}
            setattr(model, kind, [word for word in words if word.name not in names])
        for place, joint in enumerate(model.joints):
            changes = _bare(joint, self.tunable)
            known |= set(changes)
            for effect in [effect for effect in changes if effect in names]:
                changes = _bare(model.joints[place], self.tunable)  # a second friction is left out beside the first
                if effect in changes:
                    model.joints[place] = replace(model.joints[place], **changes[effect])  # type: ignore[type-var]
        for place, word in reversed(list(enumerate(model.constraints))):
            parts = word.bare()
            left: Constraint | None = word
            known |= set(parts)
            for effect in [effect for effect in parts if effect in names]:
                rest = parts if left is None else left.bare()  # a second friction is left out beside the first
                left = rest.get(effect, left)
            model.constraints[place : place + 1] = [] if left is None else [left]
        if "gravity" in names:
            model.gravity = (0.0, 0.0, 0.0)
        known |= {observation.name for observation in self.observations}
        for name in names:
            if name not in known:
                raise UnknownNameError("without: " + nearest(name, known, "joint, loss, force or constraint"))
        own = {id(word): word.without_parameters(set(model.parameters)) for word in model.machines}
        model.constraints = [left for word in model.constraints if (left := own.get(id(word), word)) is not None]
        gone = set(self.parameters) - set(model.parameters)
        gone |= {parameter for parameter in self.tunable if parameter.rpartition(".")[0] in names}
        model.tunable = tuple(parameter for parameter in self.tunable if parameter not in gone)
        return model

    def with_tunable(self, *names: str) -> Self:
        """A copy in which more parameters stay run-time inputs although they are 0 or ±1."""
        model = copy.copy(self)
        model.tunable = (*self.tunable, *names)
        return model

    def __repr__(self) -> str:
        counts = {"bodies": len(self.bodies) - 1, "joints": len(self.joints), "forces": len(self.forces)}
        counts["constraints"] = len(self.constraints)
        counted = ", ".join(f"{count} {kind}" for kind, count in counts.items())
        return f"{type(self).__name__}({self.name!r}: {counted})"


def _of_any(observation: Observation, names: Sequence[str]) -> bool:
    """Whether an observation asks for a result of something that is left out: it is left out too."""
    mentions = [mention for mention in observation.mentions() if isinstance(mention, str)]
    return any(mention.startswith(f"{name}.") for mention in mentions for name in names)


def _bare(joint: Joint, tunable: Iterable[str]) -> dict[str, dict[str, Any]]:
    """The effects of a joint by name, each with the fields of the joint that lacks it."""
    found: dict[str, dict[str, Any]] = {name: {"loss": rest} for name, rest in joint.frictions().items()}
    if joint.loss is not None:
        found[f"{joint.name} loss"] = {"loss": None}
    if joint.stiffness != 0.0 or f"{joint.name} spring.stiffness" in tunable:
        found[f"{joint.name} spring"] = {"stiffness": 0.0}
    return found


def _title(name: Any) -> str:
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"Model needs a name as its first argument, such as Model('kneed walker'); got {name!r}")
    return printable(name, "Model")


def all_are(kind: Any, words: Iterable[Word], sentence: str) -> list[Word]:
    """Words of a kind that keep the promises of their bases, or a `ModelError` of what is expected."""
    given = list(words)
    for word in given:
        if not isinstance(word, kind):
            raise ModelError(f"{sentence}; got {_shown(word)}{_instead(kind, word)}")
    broken = [fault for word in given for fault in promise_faults(word)]
    if broken:
        raise ModelError(broken)
    return given


def _shown(word: Any) -> str:
    """The beginning of what was given."""
    text = repr(word)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]} …"


def _instead(kind: Any, word: Any) -> str:
    """What to write where something was given that has, or is a list of, what is expected."""
    if isinstance(word, Sequence) and word and all(isinstance(each, kind) for each in word):
        return "; put a * before the list: (*joints)" if kind is Joint else "; put a * before the list"
    if isinstance(word, Body) and kind is Joint:
        return "; bodies come with the joints that connect them"
    joints, moments = getattr(word, "joints", ()), getattr(word, "moments", ())
    if isinstance(word, Description) or not isinstance(joints, tuple):
        return ""
    if kind is Joint and joints:
        passive = " and apply(*person.moments)" if moments else ""
        return f"; of a person take connect(*person.joints){passive}"
    if kind is not Joint and joints:
        return "; of a person take connect(*person.joints), and apply(*person.moments) where it is passive"
    return ""


def served(words: list[Constraint]) -> list[Constraint]:
    """Constraints that equations and active-set manager can serve, or a `ModelError` of what the others lack."""
    lacking = [fault for word in words for fault in word.missing()]
    if lacking:
        raise ModelError(lacking)
    return words
