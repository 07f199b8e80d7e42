"""The reference: every public name once, on the page of its subject."""

from __future__ import annotations

import mbd

__all__ = ["GROUPS", "pages"]

GROUPS = {
    "Models and bodies": "Model Lagrangian Coordinate PointMass Link RigidBody Marker box cylinder disk rod segment "
    "sphere Domain on_slope human Human",
    "Joints and losses": "Revolute Prismatic Translation Planar Cylindrical Universal Screw Spherical Free Weld "
    "Viscous Quadratic Coulomb Stribeck Dahl LuGre AffineFriction PinFriction Tabulated Valves CompressibleDamper "
    "Dissipation",
    "Constraints and measures": "Bilateral Unilateral Penalty Bristles PenaltyParameters penalty_parameters KnifeEdge "
    "Rolling Nonholonomic MaxwellStop HystereticStop Event Impulse Mode Transition SampledLaw Controller When "
    "touchdown rolling_touchdown profile_touchdown disk_touchdown sphere_touchdown Plane Ball height flexion "
    "extension cone twist distance separation measure",
    "Forces": "Spring SpringLeg Damper Bushing TorsionSpring TabulatedSpring Motor DCMotor Rotor Muscle ViaPoint "
    "PolynomialPath WrappingSphere WrappingCylinder WrappingEllipsoid Applied Potential Samples mass_matrix "
    "bias_forces",
    "Functions": "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt hypot sign "
    "maximum minimum clip mod floor where pi",
    "Starts and runs": "assemble project State simulate Trajectory load batch Batch sweep Sweep latin_hypercube sobol",
    "Integrators": "HHT GeneralizedAlpha Newmark RadauIIA RungeKutta4 RungeKutta853",
    "Analysis": "accuracy Accuracy Known effects Effects linearize Linearization StateSpace mobility "
    "Mobility criteria Criteria sensitivities Sensitivities fit Fit optimize Optimum",
    "Gaits": "limit_cycle LimitCycle gait_report GaitReport read_band NormativeBand find_gait GaitSearch "
    "branch Branch PointCurve basin Basin",
    "Laboratory": "read Recording PlateRecord ForcePlate assign_plates scale read_model write_model ImportedModel "
    "ImportReport "
    "inverse_kinematics film InverseKinematics inverse_dynamics InverseDynamics "
    "muscle_forces MuscleForces margin_of_stability",
    "Errors and failures": "MbdError MbdWarning ModelError AssemblyError SimulationError CapabilityError "
    "GaitError MemoryLimitError TraceError TrajectoryError UnknownNameError Failure Replay replay",
}
"""Public names by the title of their page."""

BASES = (
    "mbd.joints.Joint mbd.joints.losses.Loss mbd.forces.Force mbd.constraints.Constraint mbd.constraints.Measure "
    "mbd.integrators.Integrator mbd.integrators.System"
)
"""What words of one's own inherit from."""

OF_INTEREST = ("Models and bodies", "Starts and runs", "Analysis", "Gaits", "Laboratory", "Errors and failures")
"""Pages that show the methods of their classes; what others have is for those who write words of their own."""


def pages() -> dict[str, str]:
    """Markdown of the pages by their place in the site."""
    found = {}
    listing = ["# Every name", "", "All public names of `mbd`; each page is made from the docstrings.", ""]
    for title, names in GROUPS.items():
        place = title.lower().replace(" ", "-") + ".md"
        known = [f"mbd.{name}" for name in names.split()]
        links = ", ".join(f"[`{name}`][mbd.{name}]" for name in names.split())
        listing += [f"**[{title}]({place})**: {links}", ""]
        found[f"reference/{place}"] = _page(title, known, members=title in OF_INTEREST)
    found["reference/words-of-your-own.md"] = _page("Words of your own", BASES.split(), members=True)
    kit = [f"mbd.testing.{name}" for name in mbd.testing.__all__]
    found["reference/testing-kit.md"] = _page("The testing kit", kit, members=False)
    parts = [f"mbd.parts.{name}" for name in mbd.parts.__all__ if callable(getattr(mbd.parts, name))]
    found["reference/parts-of-a-leg.md"] = _page("Parts of a leg", parts, members=False)
    return {"reference/index.md": "\n".join(listing), **found}


def _page(title: str, names: list[str], members: bool) -> str:
    options = "" if members else "    options: {members: false}\n"
    return f"# {title}\n\n" + "".join(f"::: {name}\n{options}\n" for name in names)
