"""Dynamics of multibody systems: bodies and joints in words, exact equations, machine code, switching constraints.

Names are loaded when they are first used, so that ``import mbd`` itself is quick.
"""

from typing import TYPE_CHECKING, Any

from mbd.later import register

if TYPE_CHECKING:
    from mbd import parts as parts, testing as testing
    from mbd.analysis.accuracy import Accuracy as Accuracy, Known as Known, accuracy as accuracy
    from mbd.analysis.designs import latin_hypercube as latin_hypercube, sobol as sobol
    from mbd.analysis.effects import Effects as Effects, effects as effects
    from mbd.analysis.fitting.fit import Fit as Fit, fit as fit
    from mbd.analysis.gait_report import (
        GaitReport as GaitReport,
        NormativeBand as NormativeBand,
        gait_report as gait_report,
        read_band as read_band,
    )
    from mbd.analysis.linearization import Linearization as Linearization
    from mbd.analysis.linearize import linearize as linearize
    from mbd.analysis.numerical import Criteria as Criteria, criteria as criteria
    from mbd.analysis.state_space import StateSpace as StateSpace
    from mbd.analysis.sweep import Sweep as Sweep, sweep as sweep
    from mbd.assembly.assemble import assemble as assemble
    from mbd.assembly.mobility import Mobility as Mobility, mobility as mobility
    from mbd.assembly.projection import project as project
    from mbd.bodies import (
        Domain as Domain,
        Link as Link,
        Marker as Marker,
        PointMass as PointMass,
        RigidBody as RigidBody,
        box as box,
        cylinder as cylinder,
        disk as disk,
        rod as rod,
        segment as segment,
        sphere as sphere,
    )
    from mbd.constraints import (
        Ball as Ball,
        Bilateral as Bilateral,
        Bristles as Bristles,
        Controller as Controller,
        Event as Event,
        HystereticStop as HystereticStop,
        Impulse as Impulse,
        KnifeEdge as KnifeEdge,
        MaxwellStop as MaxwellStop,
        Mode as Mode,
        Nonholonomic as Nonholonomic,
        Penalty as Penalty,
        PenaltyParameters as PenaltyParameters,
        Plane as Plane,
        Rolling as Rolling,
        SampledLaw as SampledLaw,
        SpringLeg as SpringLeg,
        Transition as Transition,
        Unilateral as Unilateral,
        When as When,
        cone as cone,
        disk_touchdown as disk_touchdown,
        distance as distance,
        extension as extension,
        flexion as flexion,
        height as height,
        measure as measure,
        penalty_parameters as penalty_parameters,
        profile_touchdown as profile_touchdown,
        rolling_touchdown as rolling_touchdown,
        separation as separation,
        sphere_touchdown as sphere_touchdown,
        touchdown as touchdown,
        twist as twist,
    )
    from mbd.equations.energy_description import Coordinate as Coordinate
    from mbd.errors import (
        AssemblyError as AssemblyError,
        CapabilityError as CapabilityError,
        GaitError as GaitError,
        MbdError as MbdError,
        MbdWarning as MbdWarning,
        MemoryLimitError as MemoryLimitError,
        ModelError as ModelError,
        SimulationError as SimulationError,
        TraceError as TraceError,
        TrajectoryError as TrajectoryError,
        UnknownNameError as UnknownNameError,
    )
    from mbd.forces import (
        Applied as Applied,
        Bushing as Bushing,
        Damper as Damper,
        DCMotor as DCMotor,
        Motor as Motor,
        Muscle as Muscle,
        PolynomialPath as PolynomialPath,
        Potential as Potential,
        Rotor as Rotor,
        Samples as Samples,
        Spring as Spring,
        TabulatedSpring as TabulatedSpring,
        TorsionSpring as TorsionSpring,
        ViaPoint as ViaPoint,
        WrappingCylinder as WrappingCylinder,
        WrappingEllipsoid as WrappingEllipsoid,
        WrappingSphere as WrappingSphere,
        bias_forces as bias_forces,
        mass_matrix as mass_matrix,
    )
    from mbd.gait.basin.basin import basin as basin
    from mbd.gait.basin.result import Basin as Basin
    from mbd.gait.branch import Branch as Branch, branch as branch
    from mbd.gait.cycle import LimitCycle as LimitCycle
    from mbd.gait.find import GaitSearch as GaitSearch, find_gait as find_gait
    from mbd.gait.follow import PointCurve as PointCurve
    from mbd.gait.limit_cycle import limit_cycle as limit_cycle
    from mbd.integrators import (
        HHT as HHT,
        GeneralizedAlpha as GeneralizedAlpha,
        Newmark as Newmark,
        RadauIIA as RadauIIA,
        RungeKutta4 as RungeKutta4,
        RungeKutta853 as RungeKutta853,
    )
    from mbd.joints import (
        Cylindrical as Cylindrical,
        Free as Free,
        Planar as Planar,
        Prismatic as Prismatic,
        Revolute as Revolute,
        Screw as Screw,
        Spherical as Spherical,
        Translation as Translation,
        Universal as Universal,
        Weld as Weld,
    )
    from mbd.joints.losses import (
        AffineFriction as AffineFriction,
        CompressibleDamper as CompressibleDamper,
        Coulomb as Coulomb,
        Dahl as Dahl,
        Dissipation as Dissipation,
        LuGre as LuGre,
        PinFriction as PinFriction,
        Quadratic as Quadratic,
        Stribeck as Stribeck,
        Tabulated as Tabulated,
        Valves as Valves,
        Viscous as Viscous,
    )
    from mbd.laboratory.assignment import assign_plates as assign_plates
    from mbd.laboratory.balance_result import InverseDynamics as InverseDynamics
    from mbd.laboratory.film import film as film
    from mbd.laboratory.force_plate import ForcePlate as ForcePlate
    from mbd.laboratory.inverse_dynamics import inverse_dynamics as inverse_dynamics
    from mbd.laboratory.inverse_kinematics import inverse_kinematics as inverse_kinematics
    from mbd.laboratory.kinematics_result import InverseKinematics as InverseKinematics
    from mbd.laboratory.models.read_model import read_model as read_model
    from mbd.laboratory.models.report import ImportedModel as ImportedModel, ImportReport as ImportReport
    from mbd.laboratory.models.write_model import write_model as write_model
    from mbd.laboratory.muscle_forces import MuscleForces as MuscleForces, muscle_forces as muscle_forces
    from mbd.laboratory.read import read as read
    from mbd.laboratory.recording import PlateRecord as PlateRecord, Recording as Recording
    from mbd.laboratory.scale import scale as scale
    from mbd.laboratory.stability import margin_of_stability as margin_of_stability
    from mbd.lagrangian import Lagrangian as Lagrangian
    from mbd.model import Model as Model
    from mbd.optimization.optimize import optimize as optimize
    from mbd.optimization.optimum import Optimum as Optimum
    from mbd.parts.whole_body.human import Human as Human, human as human
    from mbd.results.failure import Failure as Failure
    from mbd.results.trajectory import Trajectory as Trajectory, load as load
    from mbd.sensitivity.result import Sensitivities as Sensitivities
    from mbd.sensitivity.sensitivities import sensitivities as sensitivities
    from mbd.simulation.batch.batch import batch as batch
    from mbd.simulation.batch.result import Batch as Batch
    from mbd.simulation.replay import Replay as Replay, replay as replay
    from mbd.simulation.simulate import simulate as simulate
    from mbd.state import State as State
    from mbd.tape.functions import (
        acos as acos,
        asin as asin,
        atan as atan,
        atan2 as atan2,
        clip as clip,
        cos as cos,
        cosh as cosh,
        exp as exp,
        floor as floor,
        hypot as hypot,
        log as log,
        maximum as maximum,
        minimum as minimum,
        mod as mod,
        pi as pi,
        sign as sign,
        sin as sin,
        sinh as sinh,
        sqrt as sqrt,
        tan as tan,
        tanh as tanh,
        where as where,
    )
    from mbd.topology.description import on_slope as on_slope

__version__ = "0.2.0"

_HOMES = {
    "mbd.analysis.linearization": "Linearization",
    "mbd.analysis.linearize": "linearize",
    "mbd.analysis.state_space": "StateSpace",
    "mbd.analysis.accuracy": "Accuracy Known accuracy",
    "mbd.analysis.effects": "Effects effects",
    "mbd.analysis.gait_report": "GaitReport NormativeBand gait_report read_band",
    "mbd.assembly.mobility": "Mobility mobility",
    "mbd.analysis.numerical": "Criteria criteria",
    "mbd.analysis.designs": "latin_hypercube sobol",
    "mbd.analysis.fitting.fit": "Fit fit",
    "mbd.analysis.sweep": "Sweep sweep",
    "mbd.assembly.assemble": "assemble",
    "mbd.bodies": "Domain Link Marker PointMass RigidBody box cylinder disk rod segment sphere",
    "mbd.constraints": "Ball Bilateral Bristles Controller Event HystereticStop Impulse KnifeEdge MaxwellStop Mode "
    "Nonholonomic Penalty PenaltyParameters Plane Rolling SampledLaw SpringLeg Transition Unilateral When cone "
    "disk_touchdown distance extension flexion height measure penalty_parameters profile_touchdown rolling_touchdown "
    "separation sphere_touchdown touchdown twist",
    "mbd.equations.energy_description": "Coordinate",
    "mbd.laboratory.assignment": "assign_plates",
    "mbd.laboratory.force_plate": "ForcePlate",
    "mbd.laboratory.balance_result": "InverseDynamics",
    "mbd.laboratory.inverse_dynamics": "inverse_dynamics",
    "mbd.laboratory.inverse_kinematics": "inverse_kinematics",
    "mbd.laboratory.kinematics_result": "InverseKinematics",
    "mbd.laboratory.models.read_model": "read_model",
    "mbd.laboratory.models.write_model": "write_model",
    "mbd.laboratory.film": "film",
    "mbd.laboratory.muscle_forces": "MuscleForces muscle_forces",
    "mbd.laboratory.models.report": "ImportReport ImportedModel",
    "mbd.laboratory.read": "read",
    "mbd.laboratory.recording": "PlateRecord Recording",
    "mbd.laboratory.scale": "scale",
    "mbd.laboratory.stability": "margin_of_stability",
    "mbd.lagrangian": "Lagrangian",
    "mbd.errors": "AssemblyError CapabilityError GaitError MbdError MbdWarning MemoryLimitError ModelError "
    "SimulationError TraceError TrajectoryError UnknownNameError",
    "mbd.forces": "Applied Bushing DCMotor Damper Motor Muscle PolynomialPath Potential Rotor Samples Spring "
    "TabulatedSpring TorsionSpring ViaPoint WrappingCylinder WrappingEllipsoid WrappingSphere bias_forces mass_matrix",
    "mbd.gait.basin.basin": "basin",
    "mbd.gait.basin.result": "Basin",
    "mbd.gait.branch": "Branch branch",
    "mbd.gait.cycle": "LimitCycle",
    "mbd.gait.find": "GaitSearch find_gait",
    "mbd.gait.follow": "PointCurve",
    "mbd.gait.limit_cycle": "limit_cycle",
    "mbd.integrators": "HHT GeneralizedAlpha Newmark RadauIIA RungeKutta4 RungeKutta853",
    "mbd.joints": "Cylindrical Free Planar Prismatic Revolute Screw Spherical Translation Universal Weld",
    "mbd.joints.losses": "AffineFriction CompressibleDamper Coulomb Dahl Dissipation LuGre PinFriction Quadratic "
    "Stribeck Tabulated Valves Viscous",
    "mbd.topology.description": "on_slope",
    "mbd.model": "Model",
    "mbd.parts.whole_body.human": "Human human",
    "mbd.assembly.projection": "project",
    "mbd.optimization.optimize": "optimize",
    "mbd.optimization.optimum": "Optimum",
    "mbd.results.failure": "Failure",
    "mbd.sensitivity.result": "Sensitivities",
    "mbd.sensitivity.sensitivities": "sensitivities",
    "mbd.simulation.replay": "Replay replay",
    "mbd.simulation.batch.batch": "batch",
    "mbd.simulation.batch.result": "Batch",
    "mbd.simulation.simulate": "simulate",
    "mbd.state": "State",
    "mbd.tape.functions": "acos asin atan atan2 clip cos cosh exp floor hypot log maximum minimum mod pi sign sin sinh "
    "sqrt tan tanh where",
    "mbd.results.trajectory": "Trajectory load",
}
"""The public names, by the module they live in; the block above tells the same to editors and type checkers."""

_LATER = {
    "Accuracy.page": "mbd.view.accuracy_page.write",
    "Accuracy.plot": "mbd.view.accuracy.work_precision",
    "Basin.plot": "mbd.view.basins.basin",
    "Branch.plot": "mbd.view.gaits.branch",
    "Criteria.plot": "mbd.view.spectra.spectra",
    "Effects.page": "mbd.view.effects_page.write",
    "Effects.plot": "mbd.view.effects.bars",
    "Fit.plot": "mbd.view.fits.fitted",
    "GaitReport.page": "mbd.view.gait_report.write",
    "GaitReport.plot": "mbd.view.gait_report.picture",
    "Ledger.plot": "mbd.view.plots.energy",
    "LimitCycle.plot": "mbd.view.gaits.cycle",
    "Linearization.plot_modes": "mbd.view.modes.modes",
    "PointCurve.plot": "mbd.view.gaits.point_curve",
    "State.instant": "mbd.results.at_state.instant",
    "State.keys": "mbd.results.at_state.answered",
    "State.plot": "mbd.view.posture.drawn",
    "State.result": "mbd.results.at_state.quantity",
    "State.unit": "mbd.results.units.unit_of",
    "Trajectory.animate": "mbd.view.animation.Animation",
    "Trajectory.page": "mbd.view.page.write",
    "Trajectory.plot": "mbd.view.plots.histories",
    "Trajectory.sensitivities": "mbd.sensitivity.result.read",
    "Trajectory.summary": "mbd.analysis.ending.summary",
    "results: states between rows": "mbd.simulation.run.states_between.between",
    "simulate: derivatives": "mbd.sensitivity.asked.request_of",
}
"""Functions that methods of results call, by the method; see `mbd.later`."""

_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = ["__version__", *_HOME]

register(_LATER)


if not TYPE_CHECKING:  # type checkers know the names above, and that there are no others

    def __getattr__(name: str) -> Any:
        """A public name, from its module (PEP 562)."""
        import importlib

        if name in ("testing", "parts"):  # the law kit and the parts of a leg, modules of their own
            return importlib.import_module(f"mbd.{name}")
        if name in _HOME:
            from mbd.arguments import explained

            home = importlib.import_module(_HOME[name])
            value = getattr(home, name)
            if home.__name__ != "mbd.tape.functions":  # which laws call in every step
                value = explained(value)
                setattr(home, name, value)  # where pickle looks for it
            globals()[name] = value
            return value
        if name.startswith("__"):
            raise AttributeError(f"module 'mbd' has no attribute {name!r}")
        import difflib

        close = difflib.get_close_matches(name, _HOME, n=3, cutoff=0.6)
        known = "it has Model, Revolute, assemble, simulate and others, which dir(mbd) lists"
        guess = f"did you mean {' or '.join(repr(one) for one in close)}?" if close else known
        raise AttributeError(f"mbd has no {name!r}; {guess}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME, "parts", "testing"})
