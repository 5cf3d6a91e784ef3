"""Types of the dictionaries that answers are: keys as in ``--json``, SI units.

Written by tools/python_types.py from the library; for annotations, such as ``summary: flexarm.types.RunSummary = run.summary``.
A number that is infinite or none at all is None where the answer was a file of JSON once.
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict

__all__ = [
    "Assumption",
    "BalancerInfo",
    "Bending",
    "BestRun",
    "CaveatDict",
    "CaveatFigures",
    "ChainFigures",
    "CheckFigures",
    "Compensation",
    "CouplingInfo",
    "DependentInfo",
    "DifferenceFigures",
    "DriveFigures",
    "ElementStatics",
    "EncoderFigures",
    "EnergyFigures",
    "ErrorFigures",
    "ExpectedParameter",
    "ExportChecks",
    "ExportSummary",
    "FailureFigures",
    "Finding",
    "FittedParameter",
    "FlexibleInfo",
    "FoundFrame",
    "FoundPoint",
    "GridFigures",
    "HeldOutFigures",
    "HoldFigures",
    "Identification",
    "ImportChecks",
    "ImportFiles",
    "ImportInterface",
    "ImportSummary",
    "IndexFigures",
    "Inspection",
    "InterfaceFigures",
    "JointChange",
    "JointInfo",
    "LeftTarget",
    "LinkFigures",
    "LinkInfo",
    "LinkStressFigures",
    "LobePoint",
    "Lobes",
    "LobesFiles",
    "LoopInfo",
    "MapFiles",
    "MapPose",
    "MapSummary",
    "MaterialFigures",
    "MeasurementPlan",
    "MetricFigures",
    "ModalFigures",
    "ModeFigures",
    "ModelError",
    "ModesSummary",
    "MotionPeak",
    "MotionViolation",
    "MountingInfo",
    "NewDrive",
    "NewHeld",
    "NewJoint",
    "NewLink",
    "NewPayload",
    "NewRobot",
    "ParameterFigures",
    "ParameterSensitivity",
    "ParetoFigures",
    "ParetoRun",
    "PartFigures",
    "PathFigures",
    "PathMoveFigures",
    "PeakFigures",
    "PhaseFigures",
    "Placement",
    "PlannedReading",
    "PlantFigures",
    "PoseFigures",
    "PoseLobes",
    "PoseParameter",
    "PoseSensitivity",
    "ProgramFigures",
    "ReduceFiles",
    "ReduceModeFigures",
    "ReduceSummary",
    "RegionFigures",
    "Replay",
    "Residual",
    "ResponseCurve",
    "ResponseFiles",
    "ResponseSummary",
    "RunFiles",
    "RunSummary",
    "SectionForceFigures",
    "Sensitivity",
    "ShapeFigures",
    "ShapedModeFigures",
    "ShaperFigures",
    "ShareFigures",
    "SolverFigures",
    "Spread",
    "StaticsDetails",
    "StaticsFiles",
    "StepperFigures",
    "StrainGaugeFigures",
    "StressPlaceFigures",
    "StressPointFigures",
    "Suspicious",
    "SweepSummary",
    "TcpFigures",
    "TcpInfo",
    "Weight",
]


class _Bending(TypedDict):
    """What is always there."""

    links: list[str]
    """Names of the flexible links."""
    gearboxes: list[str]
    """Names of the joints with elastic gearboxes."""


class Bending(_Bending, total=False):
    """Elastic parts of a robot in a run."""

    mounting: str | None
    """Name of the elastic mounting, if there is one."""


class _StepperFigures(TypedDict):
    """What is always there."""

    name: str
    """Name on the command line."""
    h_s: float
    """Step size (s)."""
    steps: int
    """Number of steps."""
    evaluations: int
    """Number of evaluations of the equations of motion."""
    factorisations: int
    """Number of factorisations."""


class StepperFigures(_StepperFigures, total=False):
    """Stepper and its work."""

    rho_inf: float
    """Of the generalised-alpha method."""
    dispersion_correction: bool
    """Of the generalised-alpha method."""
    form: str
    """Of SPOOK."""
    preset: str
    """Of SPOOK."""
    rtol: float
    """Of the reference stepper."""
    method: str
    """Of the reference stepper."""


class ShareFigures(TypedDict):
    """Contribution of one link, gearbox, the servos or the stepper to the maximum TCP error."""

    name: str
    """Name of the link or joint."""
    kind: str
    """`link`, `gearbox`, `servo`, `mounting` or `stepper`."""
    along_m: float
    """Contribution along the direction of the error (m); all contributions add up to the error."""


class HoldFigures(TypedDict):
    """A stop: from the end of a move to the start of the next one, or to the end of the run."""

    start_s: float
    """Start (s)."""
    end_s: float
    """End (s)."""
    final_m: float
    """Error when the TCP comes to rest (m)."""
    settling_s: float | None
    """Time from the start of the stop until the error stays within the band around its final value (s)."""
    overshoot_m: float
    """Maximum overshoot beyond the final value (m)."""
    ringing_hz: float | None
    """Dominant frequency (Hz)."""


class PoseFigures(TypedDict):
    """Accuracy and repeatability at a pose, as defined in ISO 9283."""

    place_m: list[float]
    """TCP position of the rigid robot, world axes (m)."""
    visits: int
    """Number of stops there."""
    accuracy_m: float
    """Distance of the mean position at the end of the stops from the rigid robot's (m): AP."""
    repeatability_m: float
    """Mean distance of the positions from their mean plus three standard deviations (m): RP."""


class TcpFigures(TypedDict):
    """Flexible against rigid tool centre point."""

    peak_m: float
    """Maximum distance (m)."""
    t_peak_s: float
    """Time of the maximum (s)."""
    rms_m: float
    """Root mean square of the distance (m)."""
    end_m: float
    """Distance at the end (m)."""
    static_sag_m: float
    """Static deflection at the start (m)."""
    static_at_peak_m: float | None
    """Static part of `peak_m`, along the direction of the error (m): deflection at rest in that pose under gravity and the loads at that time; null if the arm has no equilibrium somewhere on its path."""
    dynamic_at_peak_m: float | None
    """Dynamic part of `peak_m`, from inertia and vibration (m); negative where the motion unloads the arm."""
    static_peak_m: float | None
    """Maximum static part (m)."""
    dynamic_peak_m: float | None
    """Maximum dynamic part: error minus static part (m)."""
    t_dynamic_peak_s: float | None
    """Time of the maximum dynamic part (s)."""
    dynamic_rms_m: float | None
    """Root mean square of the dynamic part (m)."""
    shares_at_peak: list[ShareFigures]
    """Contributions to the maximum error along its direction, in the order of the recordings."""
    peak_rad: float
    """Maximum rotation error (rad)."""
    rms_rad: float
    """Root mean square of the rotation error (rad)."""
    settling_s: float | None
    """Settling time (s): time from the end of a move until the error stays within the band around its final value, at the slowest stop; null if the TCP does not settle at some stop."""
    settling: str
    """Settling in words: the settling time, or the stops at which the TCP has not settled."""
    settling_band_m: float | None
    """Half width of the settling band (m)."""
    overshoot_m: float
    """Maximum overshoot beyond the final value after a move (m)."""
    dominant_hz: float | None
    """Dominant frequency of the error (Hz)."""
    path_peak_m: list[float]
    """Maximum components along, across and out of the path (m)."""
    path_accuracy_m: float
    """Maximum distance from the path while the robot moves (m), combining the components across and out of the path."""
    path_rms_m: float
    """Root mean square of the distance from the path over the moves (m)."""
    holds: list[HoldFigures]
    """Figures of each stop."""
    poses: list[PoseFigures]
    """Poses at which the TCP stops more than once."""


class PathMoveFigures(TypedDict):
    """Figures of one TCP move."""

    line: int
    """Line number in the program or file."""
    statement: str
    """Statement in that line."""
    span_s: list[float]
    """Start and end time (s)."""
    across_peak_m: float
    """Maximum distance from the path (m)."""
    across_rms_m: float
    """Root mean square of the distance (m)."""
    corner_overshoot_m: float
    """Overshoot along the direction of the previous move, beyond the static deflection (m)."""
    programmed_m_s: float | None
    """Programmed speed (m/s)."""
    top_m_s: float | None
    """Maximum speed (m/s)."""


class PathFigures(TypedDict):
    """Errors across the path of a motion given as a TCP path."""

    across_peak_m: float
    """Maximum distance from the path on TCP moves (m)."""
    t_across_peak_s: float
    """Time of this maximum (s)."""
    across_rms_m: float
    """Root mean square of the distance over the samples of those moves (m)."""
    offset_m: list[float]
    """Centre of the bounding box of the error on those moves: offset by which a workpiece would be moved (m, world axes)."""
    left_m: float
    """Bound on the error that remains after the offset (m): half the diagonal of the box."""
    corner_overshoot_m: float
    """Overshoot after a corner, beyond the static deflection (m); 0 without a corner."""
    moves: list[PathMoveFigures]
    """Figures of each TCP move."""


class LinkFigures(TypedDict):
    """Figures of a flexible link."""

    name: str
    """Name of the link."""
    peak_contribution_m: float
    """Maximum TCP displacement caused by its deflection alone (m)."""
    engineering_strain: float
    """Maximum change of the distance between its interfaces, relative to that distance."""
    peak_rotation_rad: float
    """Maximum elastic rotation (rad)."""


class StressPlaceFigures(TypedDict):
    """Maximum stress at a node of the surface."""

    node: int
    """Number of the node in the mesh."""
    position_m: list[float]
    """Its position in the link frame (m)."""
    t_s: float
    """Time of the maximum (s)."""
    von_mises_pa: float
    """Von Mises stress (Pa)."""
    of_yield: float | None
    """Stress over yield strength; null for a material whose strength is not known."""
    material: str | None
    """Material with its class; null if it is none of the presets."""
    damage: float | None
    """Fatigue damage of the motion if it is repeated without end; the life is 1 over it in motions. 1 if the link does not survive the first motion, null for an unknown material."""


class StressPointFigures(TypedDict):
    """Maximum stress at a stress point."""

    name: str
    """Name of the point."""
    place: StressPlaceFigures
    """Its node and maximum."""


class StrainGaugeFigures(TypedDict):
    """Extremes of a strain gauge."""

    name: str
    """Name of the gauge."""
    node: int
    """Number of its node in the mesh."""
    position_m: list[float]
    """Position of the node in the link frame (m)."""
    lowest: float
    """Minimum strain (m/m)."""
    highest: float
    """Maximum strain (m/m)."""


class SectionForceFigures(TypedDict):
    """Extremes of the section forces at a plane across a beam: `N V_y V_z T M_y M_z`, in beam axes about the axis of the beam (N, N m), of the far side on the near side, so that tension is positive."""

    at_m: float
    """Position along the beam from its near end (m)."""
    lowest: list[float]
    """Minima over the run."""
    highest: list[float]
    """Maxima over the run."""


class _LinkStressFigures(TypedDict):
    """What is always there."""

    name: str
    """Name of the link."""
    nodes: int
    """Number of nodes of its surface."""
    left_out: int
    """Number of nodes that are not judged, because a rigid tie is near."""
    clear_of_ties_m: float
    """Distance from tied nodes that is left out (m)."""
    peak_pa: float
    """Maximum von Mises stress (Pa)."""
    of_yield: float | None
    """The same over the yield strength; null for a material whose strength is not known."""
    damage: float | None
    """Maximum fatigue damage of one motion on the surface; null as above."""
    most_damaged: StressPlaceFigures | None
    """Place of the largest damage; null as above."""
    worst: list[StressPlaceFigures]
    """Places of the largest stress, the worst first."""


class LinkStressFigures(_LinkStressFigures, total=False):
    """Stress of a flexible link during a run."""

    points: list[StressPointFigures]
    """Stress points of the robot file."""
    gauges: list[StrainGaugeFigures]
    """Strain gauges of the robot file."""
    section_forces: list[SectionForceFigures]
    """Section forces of a beam, from its near end to its far end."""


class DriveFigures(TypedDict):
    """Figures of an elastic drive."""

    joint: str
    """Name of the joint."""
    peak_contribution_m: float
    """Maximum TCP displacement caused by its deflection alone (m)."""
    peak_deflection_rad: float
    """Maximum deflection between motor and link (rad; m if the joint is prismatic)."""
    slides: bool
    """Whether the joint is prismatic."""


class _EnergyFigures(TypedDict):
    """What is always there."""

    drives_j: float
    """Net work of the drives: EnergyFigures::drives_positive_j minus EnergyFigures::drives_negative_j (J)."""
    drives_positive_j: float
    """Work of each drive while its power is positive, summed (J)."""
    drives_negative_j: float
    """Work absorbed by each drive while its power is negative, summed, as a positive number (J)."""
    loads_j: float
    """Work of the external loads (J)."""
    dissipated_j: float
    """Energy dissipated by dampers and friction (J)."""
    payload_j: float
    """Energy added with payloads picked up, less that removed with payloads dropped (J)."""
    stored_j: float
    """Increase of kinetic, gravitational and elastic energy (J)."""
    imbalance: float
    """Maximum error of the balance relative to the largest energy in it."""


class EnergyFigures(_EnergyFigures, total=False):
    """Energy balance of the run, from the logged samples (trapezoidal rule: a low log rate causes an imbalance)."""

    hysteresis_j: float
    """Part of the dissipated energy due to gear hysteresis (J)."""


class Finding(TypedDict):
    """Something found in an input or in a result. SI units.  `Display` gives `where: message`, and the remedy on a line of its own."""

    severity: Literal['error', 'warning', 'note']
    """Severity."""
    code: str
    """Short, stable identifier of its kind."""
    where: str
    """Place in a file, as `path:line:column`, or the subject: a link, a joint, the payload, a file."""
    message: str
    """Complete message in one sentence."""
    value: float | None
    """Value found."""
    yardstick: float | None
    """Reference with which the value is compared."""
    unit: str
    """Unit of both."""
    likely: str
    """Likely mistake that explains the value, such as "about 1000 times: millimetres?"; empty if there is none."""
    help: str
    """Advice on what to check or how to fix it."""


class _RunFiles(TypedDict):
    """What is always there."""

    csv: str | None
    """Recording (csv), if it was written."""
    mcap: str | None
    """Recording (mcap), if it was written."""
    rrd: str | None
    """Recording (rrd), if it was written."""
    parquet: str | None
    """Recording (parquet), if it was written."""
    report: str | None
    """Report: an HTML page with plots and pictures."""
    report_md: str | None
    """Figures of the report as Markdown."""
    figures: str | None
    """Folder with figures for papers."""
    foxglove_layout: str | None
    """Foxglove layout for the MCAP recording."""
    plotjuggler_layout: str | None
    """PlotJuggler layout for the MCAP recording."""


class RunFiles(_RunFiles, total=False):
    """Written files; null where none was written."""

    study: str | None
    """Rerun recording of all runs of a study."""
    stress: str | None
    """Picture of the stress of the links."""


class DifferenceFigures(TypedDict):
    """Distance of one run's flexible TCP from another's."""

    peak_m: float
    """Maximum distance (m)."""
    t_peak_s: float
    """Time of the maximum (s)."""
    rms_m: float
    """Root mean square of the distance (m)."""
    of_peak_error: float | None
    """Maximum distance relative to the first run's maximum TCP error."""


_RunSummaryWith = TypedDict("_RunSummaryWith", {"with": "list[RunSummary]"}, total=False)


class _RunSummary(_RunSummaryWith):
    """What is always there."""

    headline: str
    """TCP error and its main causes in one sentence; empty if they are not known."""
    robot: str
    """Name of the robot."""
    trajectory: str
    """Name of the trajectory."""
    links_model: str
    """`rigid`, `lumped`, `modal` or `mixed`."""
    bends: Bending
    """Elastic parts of the robot; none if it is rigid."""
    end: str
    """`complete`, or the reason why the run stopped early."""
    duration_s: float
    """Simulated time (s)."""
    stepper: StepperFigures
    """Stepper and its work."""
    wall_s: float
    """Wall-clock time of the run, recordings included (s)."""
    real_time_factor: float
    """Simulated over wall-clock time."""
    cpu_s: float
    """Processor time, all threads (s)."""
    cpu_s_per_simulated_s: float
    """Processor time per simulated second."""
    tcp: TcpFigures
    """Flexible against rigid tool centre point; absent for runs without the twin."""
    frequencies_hz: list[float]
    """Natural frequencies at the start pose, drives locked (Hz)."""
    links: list[LinkFigures]
    """Flexible links."""
    elastic_drives: list[DriveFigures]
    """Elastic drives."""
    energy: EnergyFigures
    """Energy balance."""
    drives: dict[str, float]
    """Maximum torque or force of each drive (N m or N)."""
    warnings: list[str]
    """Warnings among Summary::caveats, as sentences."""
    caveats: list[Finding]
    """Probable errors in the input, and limits of the result's validity."""
    files: RunFiles
    """Written files."""
    moves_s: list[list[float]]
    """Start and end of each move (s)."""


class RunSummary(_RunSummary, total=False):
    """Result of `flexarm compare` and `flexarm run`. SI units.  `summary.json` can be read back with `serde_json`; keys missing in files of older versions take their defaults."""

    path: PathFigures | None
    """Error across the path; absent unless the motion is given as a TCP path."""
    stress: list[LinkStressFigures]
    """Stress of the links whose stress fields are stored."""
    motors: dict[str, float]
    """Maximum torque of each motor that moves several joints, after its gear (N m or N), by the joint of its drive."""
    label: str | None
    """Label of the run in a study."""
    difference: DifferenceFigures | None
    """Distance of its TCP from that of the first run of a study."""


class ElementStatics(TypedDict):
    """An elastic element at the equilibrium."""

    name: str
    """Name of the link."""
    deflection: list[float]
    """Elastic coordinates (m, rad), in the axes of the proximal part."""
    load: list[float]
    """Load of its spring (N, N m)."""
    tcp_displacement_m: list[float]
    """TCP displacement caused by this element alone, to first order (m)."""
    tcp_rotation_rad: list[float]
    """TCP rotation caused by this element alone (rad)."""
    energy_j: float
    """Elastic energy (J)."""


class StaticsFiles(TypedDict):
    """Written files; null where none was written."""

    picture: str | None
    """Picture of the arm with magnified deflections next to the rigid one, and its compliance ellipsoid."""
    json: str | None
    """This result as JSON."""


class _StaticsDetails(TypedDict):
    """What is always there."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Held joints, in coordinate order."""
    at: list[float]
    """Positions at which they are held (rad or m)."""
    tcp: str
    """Link that carries the TCP."""
    wrench: list[float]
    """Force (N) and moment (N m) on the TCP, in addition to gravity."""
    tcp_position_m: list[float]
    """TCP position of the rigid robot (m)."""
    tcp_displacement_m: list[float]
    """Displacement of the flexible TCP from the rigid one, under gravity and wrench (m)."""
    tcp_rotation_rad: list[float]
    """Rotation of the flexible TCP from the rigid one, as a rotation vector (rad)."""
    sag_m: list[float]
    """Displacement under gravity only (m)."""
    sag_rad: list[float]
    """Rotation under gravity only, as a rotation vector (rad)."""
    compliance: list[list[float]]
    """Compliance of the TCP at the equilibrium with the drives locked, 6×6 (m/N, rad/N; m/(N m), rad/(N m))."""
    holding_torque: list[float]
    """Torques or forces with which the drives hold the pose (N m or N)."""
    elements: list[ElementStatics]
    """Elastic elements."""
    residual: float
    """Residual force relative to the largest force."""
    files: StaticsFiles
    """Written files."""
    warnings: list[str]
    """Warnings among the caveats, as sentences."""
    caveats: list[Finding]
    """Probable errors in the input, and limits of the result's validity."""


class StaticsDetails(_StaticsDetails, total=False):
    """Result of `flexarm statics`. SI units; world axes, at the TCP; six-vectors linear first."""

    motor_torque: dict[str, float]
    """Torques of motors that move several joints, after their gears: `Cᵀ` times the holding torques of these joints (N m or N)."""
    stress: list[LinkStressFigures]
    """Stress of the links whose stress fields are stored."""


class ModeFigures(TypedDict):
    """Figures of one mode."""

    frequency_hz: float
    """Natural frequency (Hz)."""
    damped_frequency_hz: float
    """Damped frequency (Hz)."""
    damping_ratio: float
    """Damping ratio."""
    tcp: list[float]
    """TCP motion in the mode at unit modal mass (1/sqrt(kg), rad/sqrt(kg m²) ...), real part."""
    tcp_imaginary: list[float]
    """Imaginary part; zero for proportional damping."""
    effective_mass: list[float | None]
    """Effective mass at the TCP (kg), or moment of inertia for rotations (kg m²); null at a node."""
    compliance_share: list[float | None]
    """Fraction of the static compliance of the TCP carried by this mode, per direction; null where the compliance is zero, and for a turning arm: Coriolis forces couple the shares of its modes."""
    strain_energy: list[float]
    """Share of each element in the strain energy."""
    residual: float
    """Relative residual of the eigenvalue equation."""


class _ModesSummary(TypedDict):
    """What is always there."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Locked joints, in coordinate order."""
    at: list[float]
    """Positions at which they are locked (rad or m)."""
    driven: list[str]
    """Joints under a servo instead of locked; the servo acts as spring and damper here."""
    tcp: str
    """Link that carries the TCP."""
    frequencies_hz: list[float]
    """Natural frequencies `|λ| / 2π` (Hz), ascending."""
    undamped_frequencies_hz: list[float]
    """Undamped frequencies (Hz), ascending, the same number."""
    damping_ratio: list[float]
    """Damping ratios `-Re λ / |λ|`."""
    elements: list[str]
    """Elastic elements, in the order of `strain_energy`."""
    modes: list[ModeFigures]
    """One entry per mode."""
    total: int
    """Total number of modes; `modes` may contain fewer."""
    compliance_covered: list[float | None]
    """Fraction of the static compliance covered by the listed modes, per TCP direction; null where the compliance is zero, and for a turning arm."""
    files: RunFiles
    """Written files."""
    warnings: list[str]
    """Warnings among the caveats, as sentences."""
    caveats: list[Finding]
    """Probable errors in the input, and limits of the result's validity."""


class ModesSummary(_ModesSummary, total=False):
    """Result of `flexarm modes`. SI units; world axes, at the TCP; six-vectors linear first."""

    speeds: list[float]
    """Speeds at which the joints turn instead of being locked (rad/s or m/s); left out at rest."""


class PeakFigures(TypedDict):
    """A resonance."""

    frequency_hz: float
    """Frequency (Hz)."""
    magnitude: float
    """Magnitude."""
    phase_rad: float
    """Phase (rad)."""


class ResponseCurve(TypedDict):
    """Response of one output to one input."""

    input: str
    """Name of the input."""
    output: str
    """Name of the output."""
    unit: str
    """Unit of the magnitude."""
    at_rest: float | None
    """Static response, signed; null where it is infinite."""
    peaks: list[PeakFigures]
    """Resonances within the frequency range, the highest first."""
    magnitude: list[float]
    """Amplitude ratio of output to input, one per frequency."""
    phase_rad: list[float]
    """Phase lead of the output over the input (rad), one per frequency; unwrapped."""


class ResponseFiles(TypedDict):
    """Written files; null where none was written."""

    csv: str | None
    """Table."""
    plot: str | None
    """Plot of magnitude and phase."""
    json: str | None
    """This result as JSON."""


class ResponseSummary(TypedDict):
    """Result of `flexarm response`. SI units."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Joints, in coordinate order."""
    at: list[float]
    """Positions at which the joints are held, or about which they move (rad or m)."""
    tcp: str
    """Link that carries the TCP."""
    quantity: str
    """`displacement`, `velocity` or `acceleration`."""
    frequencies_hz: list[float]
    """Natural frequencies of all modes (Hz)."""
    damping_ratio: list[float]
    """Damping ratios of the modes."""
    frequency_hz: list[float]
    """Frequencies of the curves (Hz)."""
    logarithmic: bool
    """Whether the frequencies are logarithmically spaced."""
    curves: list[ResponseCurve]
    """One curve per pair of input and output."""
    files: ResponseFiles
    """Written files."""
    warnings: list[str]
    """Warnings among the caveats, as sentences."""
    caveats: list[Finding]
    """Probable errors in the input, and limits of the result's validity."""


class GridFigures(TypedDict):
    """Grid of a map."""

    lower_m: list[float]
    """First place (m)."""
    upper_m: list[float]
    """Last place (m)."""
    spacing_m: float
    """Spacing (m)."""
    count: list[int]
    """Number of places along x, y and z."""
    directions: int
    """Number of tool directions at each place."""


class Spread(TypedDict):
    """Distribution of a quantity over the poses."""

    min: float
    """Minimum."""
    max: float
    """Maximum."""
    mean: float
    """Mean."""
    quantiles: dict[str, float]
    """5, 25, 50, 75 and 95 % quantiles, under the keys `0.05` to `0.95`."""


class MapPose(TypedDict):
    """A pose of a map with all its quantities."""

    row: int
    """Index of its row."""
    q: list[float]
    """Joints, in coordinate order (rad or m)."""
    place_m: list[float]
    """Position of the rigid arm's TCP (m, world)."""
    value: float
    """Value of the quantity by which the map compares."""
    quantities: dict[str, float]
    """Values of all quantities."""


class Placement(TypedDict):
    """Best placement of a box."""

    lower_m: list[float]
    """Lower corner of the places covered (m, world)."""
    upper_m: list[float]
    """Upper corner (m, world)."""
    centre_m: list[float]
    """Centre (m, world)."""
    worst: float
    """Worst value in the box, of the quantity by which the map compares."""
    points: int
    """Number of places of the map in the box, all of them reachable."""


class MapFiles(TypedDict):
    """Written files."""

    table: str | None
    """Table of all poses."""
    page: str | None
    """Page."""
    rrd: str | None
    """Recording for the viewer."""
    json: str | None
    """Figures."""


class MapSummary(TypedDict):
    """Result of `flexarm map`. SI units, world axes, at the TCP."""

    robot: str
    """Name of the robot."""
    tcp: str
    """Link that carries the TCP."""
    joints: list[str]
    """Joints in coordinate order."""
    points: int
    """Number of places, or joint poses, requested."""
    reachable: int
    """Number of these with at least one pose within the limits that has an equilibrium under gravity."""
    poses: int
    """Number of poses evaluated; larger than the number of places with several directions or branches."""
    failed: int
    """Number of poses without an equilibrium."""
    grid: GridFigures | None
    """Grid, for a map over TCP positions."""
    wrench: list[float]
    """Force (N) and moment (N m) on the TCP, in addition to gravity."""
    by: str
    """Quantity that defines best and worst."""
    quantities: dict[str, Spread]
    """Distribution of each quantity over the rows."""
    worst: MapPose
    """The worst pose."""
    best: MapPose
    """The best pose."""
    placement: Placement | None
    """Best placement of the workpiece; null without a workpiece, or if it fits nowhere."""
    wall_s: float
    """Wall-clock time (s)."""
    file: str | None
    """File with the table of all poses."""
    files: MapFiles
    """Written files."""
    warnings: list[str]
    """Messages of the caveats."""
    caveats: list[Finding]
    """Probable errors of the input, and limits of the result's validity."""


class ErrorFigures(TypedDict):
    """Error of the TCP over a run."""

    peak_m: float
    """Maximum distance from the rigid arm's TCP (m)."""
    rms_m: float
    """RMS distance (m)."""
    peak_rad: float
    """Maximum rotation relative to the rigid arm's TCP (rad)."""
    end_m: float
    """Distance at the end (m)."""


class JointChange(TypedDict):
    """Change of a joint's commands."""

    joint: str
    """Name of the joint."""
    largest: float
    """Maximum change (rad or m)."""


class MotionViolation(TypedDict):
    """An exceeded limit."""

    joint: str
    """Joint name."""
    kind: str
    """`lower`, `upper`, `velocity`, `acceleration`, `jerk` or `effort`."""
    time_s: float
    """Time of the largest excess (s)."""
    since_s: float
    """Time at which the limit is first exceeded (s)."""
    value: float
    """Value at the largest excess."""
    limit: float
    """Limit."""
    message: str
    """The violation as a sentence."""


class ShapedModeFigures(TypedDict):
    """A mode with its residual vibration."""

    frequency_hz: float
    """Natural frequency (Hz)."""
    damping_ratio: float
    """Damping ratio."""
    before_m: float
    """Residual vibration of the TCP without shaper, maximum within the band of the frequency (m)."""
    after_m: float
    """Residual vibration with the shaper (m)."""


class ShaperFigures(TypedDict):
    """Figures of a shaper in use."""

    kind: str
    """`zv`, `zvd` or `optimal`."""
    copies: list[list[float]]
    """Delay (s) and amplitude of each copy of the motion."""
    modes: list[ShapedModeFigures]
    """Modes at the end of the motion for which the shaper was designed, in order of decreasing vibration."""


class PlantFigures(TypedDict):
    """Result of the commands on a plant other than the model."""

    plant: str
    """Description of the plant."""
    before: ErrorFigures
    """Error of the unchanged motion."""
    after: ErrorFigures
    """Error with the new commands."""


class LeftTarget(TypedDict):
    """A target left unchanged."""

    line: int
    """Line of the move."""
    statement: str
    """Statement of the move."""
    why: str
    """Reason."""
    residual_m: float
    """Distance of the flexible TCP from its target at rest (m)."""


class ProgramFigures(TypedDict):
    """Figures of the correction of a robot program."""

    files: list[str]
    """Paths of the corrected program and of the changed data lists."""
    targets: int
    """Number of targets at the ends of moves; dwells and arcs given by an angle have none."""
    corrected: int
    """Number of targets replaced."""
    loaded: int
    """Number of targets at which loads act or the payload differs from that at the start."""
    before_m: float
    """Maximum distance of the flexible TCP from its target at rest, with the original program (m)."""
    residual_m: float
    """Maximum distance at the replaced targets, with the written program read again (m)."""
    residual_rad: float
    """Maximum rotation there (rad)."""
    left: list[LeftTarget]
    """Targets left unchanged; at most the first 20."""


class Compensation(TypedDict):
    """Result of `flexarm compensate`."""

    robot: str
    """Robot whose model was used to find the commands."""
    motion: str
    """File of the motion."""
    method: str
    """`dynamic` or `static`."""
    before: ErrorFigures
    """Error of the unchanged motion, on the plant."""
    after: ErrorFigures
    """Error with the new commands, on the plant."""
    model_peaks_m: list[float]
    """Peak error on the model without correction and after each iteration kept (m)."""
    iterations: int
    """Number of iterations kept."""
    cutoff_hz: float | None
    """Cutoff frequency of the correction (Hz); null for the static method."""
    changes: list[JointChange]
    """Maximum change of each joint (rad or m)."""
    limits: list[MotionViolation]
    """Limits that the new motion violates: positions, speeds and accelerations of the commands, torques of the run on the plant."""
    slowed: float
    """Factor by which the motion is slowed down to keep limits; 1 if unchanged."""
    shaper_delay_s: float
    """Time by which the shaper lengthens the motion (s)."""
    shaper: ShaperFigures | None
    """Shaper, if there is one."""
    plants: list[PlantFigures]
    """Results of the same commands on other plants."""
    file: str | None
    """New motion (.csv)."""
    files: list[str]
    """Additional files of the new motion."""
    recording: str | None
    """Recording of the arm before and after (.rrd)."""
    program: ProgramFigures | None
    """Robot program with corrected targets, for motions read from a program (KRL, RAPID)."""
    page: str | None
    """Page."""
    warnings: list[str]
    """Messages of the caveats."""
    caveats: list[Finding]
    """Caveats."""


class ParameterSensitivity(TypedDict):
    """Effect of a change of one parameter on the error."""

    name: str
    """Name as in the robot file; for servo-controlled joints also `drive.JOINT.servo.` with the gains and `drive.JOINT.friction.`; `motion.JOINT` for a shift of a joint, `tcp.x`, `.y` and `.z` for the position of the TCP in its own axes."""
    unit: str
    """Unit of the parameter."""
    value: float
    """Value; 0 for a shift, 1 for an active feed-forward."""
    per: str
    """Change to which the following effects refer: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg`, `1 mrad` or `1 mm`. They are derivatives times that change."""
    peak_m: float
    """Effect on the maximum distance, at its time (m)."""
    rms_m: float
    """Effect on the RMS distance (m)."""
    peak_rad: float
    """Effect on the maximum angle (rad)."""
    rms_rad: float
    """Effect on the RMS angle (rad)."""


class Sensitivity(TypedDict):
    """Result of `flexarm sensitivity`."""

    robot: str
    """Name of the robot."""
    motion: str
    """File of the motion."""
    step_s: float
    """Step size (s)."""
    steps: int
    """Number of steps."""
    peak_m: float
    """Maximum distance of the TCP from that of the rigid arm (m)."""
    t_peak_s: float
    """Time of the maximum distance (s)."""
    rms_m: float
    """RMS distance (m)."""
    peak_rad: float
    """Maximum angle (rad)."""
    rms_rad: float
    """RMS angle (rad)."""
    parameters: list[ParameterSensitivity]
    """Sensitivities to the parameters of robot, tool and motion, in order of decreasing effect on the RMS distance."""
    table: str | None
    """File with error and derivatives over time."""
    warnings: list[str]
    """Messages of the caveats."""
    caveats: list[Finding]
    """Caveats."""


class PoseParameter(TypedDict):
    """Effect of a change of one parameter."""

    name: str
    """Name as in the robot file; `tcp.x`, `.y` and `.z` for the position of the TCP in its own axes."""
    unit: str
    """Unit of the parameter."""
    value: float
    """Value of the parameter."""
    per: str
    """Change to which the following effects refer: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg` or `1 mm`. They are derivatives times that change."""
    tcp_m: list[float]
    """Effect on the TCP position (m)."""
    tcp_rad: list[float]
    """Effect on the TCP orientation, as a rotation vector (rad)."""
    compliance: list[list[float]]
    """Effect on the compliance."""
    frequencies_hz: list[float]
    """Effect on the natural frequencies (Hz)."""


class PoseSensitivity(TypedDict):
    """Result of `flexarm sensitivity --at`: drives locked, world axes, under gravity."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Joints, in coordinate order."""
    at: list[float]
    """Positions at which they are held (rad or m)."""
    compliance: list[list[float]]
    """Compliance at the TCP, displacement (m, rad) per force (N) and moment (N m), 6×6."""
    frequencies_hz: list[float]
    """Natural frequencies (Hz)."""
    parameters: list[PoseParameter]
    """Sensitivities to the parameters of the robot."""
    warnings: list[str]
    """Messages of the caveats."""
    caveats: list[Finding]
    """Caveats."""


class FittedParameter(TypedDict):
    """Estimate of a number of the robot file."""

    name: str
    """Name, as in the robot file."""
    unit: str
    """Unit of the values."""
    initial: float
    """Initial value."""
    value: float
    """Value of the fit, which the new robot file has, whether or not the readings determine it."""
    std: float
    """Standard deviation; NaN (null in JSON) if the parameter is not identifiable."""
    interval: list[float]
    """95 % confidence interval; NaN (nulls) if the parameter is neither identifiable nor rigid. The upper end of a stiffness that is rigid within the readings is infinite (null)."""
    identifiable: bool
    """Whether the readings determine the parameter."""
    rigid: bool
    """Whether a spring or a clearance is rigid within the readings."""


class Weight(TypedDict):
    """Parameter in a combination."""

    name: str
    """Name of the parameter."""
    weight: float
    """Weight of the parameter over its prior deviation."""


class Residual(TypedDict):
    """RMS of the residuals before and after."""

    before: float
    """With the robot file as it is."""
    after: float
    """With the estimated parameters."""
    unit: str
    """`m`, `Hz`, or `std` where readings have different units."""


class HeldOutFigures(TypedDict):
    """RMS of cross-validation residuals."""

    folds: int
    """Number of folds."""
    skipped: int
    """Number of folds that are not predicted, since the others do not determine an unknown."""
    rms: float
    """With the parameters fitted to the other folds."""
    rms_before: float
    """With the robot file as it is."""
    unit: str
    """Unit, as in Residual."""


class ModelError(TypedDict):
    """Error of the model in one kind of readings, in addition to their deviations."""

    kind: str
    """Kind of readings."""
    error: float
    """Standard deviation (m or rad; relative for frequencies; as the compared numbers for responses and shapes)."""


class EncoderFigures(TypedDict):
    """Result for one gear from recordings. SI units."""

    joint: str
    """Name of the joint."""
    stiffness: float
    """Stiffness (N m/rad, N/m)."""
    std: float
    """Standard deviation of the stiffness: by leaving out seconds of the recordings, and of what the torque does not explain beyond the noise."""
    delay_s: float
    """Delay of the link's encoder (s)."""
    r2: float
    """Share of the deflection, without offsets and delay, that the torque explains (R²)."""
    unseen_r2: list[float]
    """R² of each run predicted from the others (of each half if there is one run)."""
    without_each: list[float]
    """Stiffness estimated without each run."""
    deflection_rms: float
    """RMS of the deflection without offsets and delay (rad, m)."""
    rest_rms: float
    """RMS of the unexplained deflection (rad, m)."""
    noise_rms: float
    """RMS of the noise of both encoders below the cut-off frequency, extrapolated from the noise at higher frequencies (rad, m)."""
    told: bool
    """Whether the recordings determine the stiffness (GearEstimate::is_determined)."""


class Suspicious(TypedDict):
    """Reading that contradicts the others."""

    reading: str
    """Name of the reading and of the number in it."""
    measured: float
    """Measured value (SI)."""
    expected: float
    """Value predicted with the estimated parameters (SI)."""
    normalised: float
    """Residual over its own standard deviation after the fit."""


class ShapeFigures(TypedDict):
    """Measured mode shape and the most similar mode of the arm."""

    reading: str
    """Name of the reading."""
    mode: int
    """Number of the mode, from 1, with the estimated parameters."""
    assurance_before: float
    """Modal assurance criterion with the robot file as it is (0 to 1)."""
    assurance: float
    """Modal assurance criterion with the estimated parameters (0 to 1)."""


class FoundFrame(TypedDict):
    """Pose of an instrument."""

    name: str
    """Name of the instrument."""
    xyz: list[float]
    """Position in the world (m)."""
    rpy: list[float]
    """Roll, pitch, yaw (rad)."""


class FoundPoint(TypedDict):
    """Position of a target."""

    name: str
    """Name of the target."""
    link: str
    """Link on which it is; `tcp` for the tool."""
    xyz: list[float]
    """Position in the axes of the link or the tool (m)."""


class Identification(TypedDict):
    """Result of `flexarm identify`."""

    robot: str
    """Robot."""
    measurements: str
    """File of measurements."""
    readings: int
    """Number of readings."""
    numbers: int
    """Number of measured numbers."""
    parameters: list[FittedParameter]
    """Fitted parameters."""
    correlation: list[list[float]]
    """Correlation of the parameters, row after row."""
    untold: list[list[Weight]]
    """Combinations that the readings do not determine."""
    combinations: list[str]
    """Parameters that the readings do not determine, and those that they determine only together, in words."""
    residual: Residual
    """RMS of the residuals."""
    held_out: HeldOutFigures | None
    """RMS of cross-validation residuals; null with fewer than two readings."""
    misfit: float | None
    """Ratio of the scatter to the declared one, above or below 1, if chance does not explain it; otherwise null."""
    deviations_known: bool
    """Whether the deviations of all readings were given; the others are estimated from the scatter."""
    model_errors: list[ModelError]
    """Errors of the model that the fit found, per kind of readings."""
    encoders: list[EncoderFigures]
    """Gears with recorded positions of motor and link."""
    suspicious: list[Suspicious]
    """Readings that contradict the others, worst first."""
    shapes: list[ShapeFigures]
    """Measured mode shapes compared with those of the arm."""
    instruments: list[FoundFrame]
    """Estimated poses of unknown instruments, in the world."""
    targets: list[FoundPoint]
    """Estimated positions of unknown targets in tool axes (m)."""
    iterations: int
    """Number of iterations."""
    converged: bool
    """Whether the search converged to a solution that fits the readings."""
    file: str | None
    """New robot file."""
    page: str | None
    """Path of the page."""
    caveats: list[Finding]
    """Caveats about the identification and the robot."""
    warnings: list[str]
    """Sentences of the caveats that are warnings."""


class PlannedReading(TypedDict):
    """Pose and load of a planned reading."""

    joints: list[float]
    """Joint values (rad or m)."""
    force: list[float]
    """Force on the tool, world axes (N)."""
    at: list[float]
    """Point of application of the force, tool axes (m)."""
    point: list[float]
    """Measured point, tool axes (m)."""
    direction: list[float] | None
    """Direction of the gauge, world axes; null if all three components are measured."""
    expected_m: list[float]
    """Predicted displacement of the point with the robot file as it is (m)."""


class ExpectedParameter(TypedDict):
    """Expected uncertainty of a parameter."""

    name: str
    """Name."""
    unit: str
    """Unit."""
    initial: float
    """Present value."""
    std: float
    """Standard deviation after the measurement."""


class MeasurementPlan(TypedDict):
    """Result of `flexarm identify --plan N`."""

    robot: str
    """Robot."""
    joints: list[str]
    """Joints, in the order of the pose values."""
    poses: list[PlannedReading]
    """Planned readings, most informative first."""
    parameters: list[ExpectedParameter]
    """Expected uncertainty of each parameter."""
    work_std_m: float | None
    """Maximum standard deviation of the tool's displacement over the poses of the work and the axes (m); null without such poses."""
    gain_over_first: float
    """Gain in information over the same number of candidates in their given order: half the logarithm of the ratio of the determinants, divided by the number of parameters. 0.69 corresponds to half the standard deviation."""
    candidates: int
    """Number of candidate poses."""
    file: str | None
    """File of measurements to fill in."""
    table: str | None
    """Table to fill in."""
    caveats: list[Finding]
    """Caveats about the robot, as from `check`."""
    warnings: list[str]
    """Sentences of the caveats that are warnings."""


class _LobePoint(TypedDict):
    """What is always there."""

    spindle_rpm: float
    """Spindle speed (1/min)."""
    depth_m: float | None
    """Depth above which the cut chatters (m); null if it is stable up to the maximum depth."""
    chatter_hz: float | None
    """Frequency of the largest component of the tip's motion at the limit (Hz)."""
    kind: str | None
    """Type of bifurcation: `hopf` (independent frequency) or `flip` (period of two teeth)."""
    pose: int
    """Index of the pose."""


class LobePoint(_LobePoint, total=False):
    """Stability limit."""

    unstable_m: list[list[float]]
    """All unstable ranges of depth (m), if requested."""


class PoseLobes(TypedDict):
    """Limits at one pose."""

    at: list[float]
    """Joint values (rad or m)."""
    time_s: float | None
    """Time of the pose in the motion (s)."""
    feed: list[float]
    """Direction of the feed, world axes."""
    axis: list[float]
    """Direction from the spindle to the tip, world axes."""
    frequencies_hz: list[float]
    """Lowest natural frequencies of arm and tool (Hz)."""
    compliance: list[float]
    """Static compliance along the feed, across it, and along the tool's axis (m/N)."""
    stable_below_m: float | None
    """Minimum limit over all speeds (m); null if the cut never chatters."""
    stable_below_at_rpm: float | None
    """Speed of this limit (1/min)."""
    depth_m: list[float | None]
    """Limit at each speed (m)."""


class LobesFiles(TypedDict):
    """Output files; null for files that were not written."""

    csv: str | None
    """Table."""
    plot: str | None
    """Diagram."""
    page: str | None
    """HTML page."""
    json: str | None
    """Result as JSON."""


class Lobes(TypedDict):
    """Result of `flexarm lobes`. SI units, spindle speeds in 1/min."""

    robot: str
    """Name of the robot."""
    tool: str
    """Name of the tool."""
    joints: list[str]
    """Joints, in coordinate order."""
    deepest_m: float
    """Maximum depth of cut in the search (m)."""
    points: list[LobePoint]
    """Minimum limit over all poses, one per speed."""
    stable_below_m: float | None
    """Depth below which the cut is stable at every speed (m); null if it never chatters."""
    stable_below_at_rpm: float | None
    """Speed of this limit (1/min)."""
    best_rpm: float
    """Speed with the maximum stable depth of cut (1/min)."""
    best_depth_m: float
    """Maximum stable depth of cut at this speed (m); Self::deepest_m if it does not chatter."""
    poses: list[PoseLobes]
    """Limits at each pose."""
    left_out: int
    """Number of poses of the motion that are left out: the tool is at rest or moves along its axis."""
    file: str | None
    """Path of the table; null if nothing was written."""
    files: LobesFiles
    """Output files."""
    warnings: list[str]
    """Sentences of the caveats that are warnings."""
    caveats: list[Finding]
    """Caveats about the input and the validity of the result."""


_ParameterFiguresAs = TypedDict("_ParameterFiguresAs", {"as": "Literal['value', 'factor', 'offset']"}, total=True)


class ParameterFigures(_ParameterFiguresAs):
    """Figures of a parameter."""

    name: str
    """Name."""
    range: list[float] | None
    """Minimum and maximum; null if not numeric."""


class IndexFigures(TypedDict):
    """Sobol indices of a parameter."""

    parameter: str
    """Name of the parameter."""
    first: float
    """First-order index: share of the variance due to the parameter by itself."""
    first_interval: list[float]
    """95 % confidence interval of `first`."""
    total: float
    """Total index: share of the variance including interactions."""
    total_interval: list[float]
    """95 % confidence interval of `total`."""


class MetricFigures(TypedDict):
    """Figures of a metric over all successful runs."""

    name: str
    """Name."""
    count: int
    """Number of runs with a value."""
    min: float | None
    """Minimum."""
    max: float | None
    """Maximum."""
    mean: float | None
    """Mean."""
    std: float | None
    """Standard deviation."""
    quantiles: list[float] | None
    """Quantiles 0.05, 0.5 and 0.95."""
    shares: dict[str, float | None]
    """Share of the variance that each parameter explains by itself (correlation ratio); null if the parameter is not numeric or nothing varies."""
    matters: list[str]
    """Parameters that matter, strongest first: listed ones with an effect, and random ones whose effect chance does not explain."""
    chance: float | None
    """Share of the variance due to random sampling that the strongest random parameter would explain by chance in 1 of 100 studies; null if nothing is random."""
    better: Literal['lower', 'higher'] | None
    """Preferred direction; null if neither study, expression nor name determines it."""
    sobol: list[IndexFigures]
    """Sobol indices of the parameters in a Saltelli design; empty otherwise."""


class FailureFigures(TypedDict):
    """Reason of failed runs."""

    reason: str
    """Reason."""
    runs: int
    """Number of runs."""
    first: int
    """Number of the first of these runs."""


class Replay(TypedDict):
    """Files and options of a run, from which an interface builds a command."""

    robot: str
    """Robot file."""
    motion: str | None
    """Motion; `None` if the robot file names it."""
    loads: str | None
    """File of loads."""
    options: list[list[float | str | bool | str]]
    """Options by key."""


class BestRun(TypedDict):
    """Best run by a metric."""

    run: int
    """Number of the run."""
    metric: str
    """Name of the metric."""
    better: Literal['lower', 'higher']
    """Direction of the optimum; lower if the preferred direction is unknown."""
    value: float
    """Value of the metric."""
    parameters: dict[str, float | str | bool]
    """Values of the parameters."""
    metrics: dict[str, float | None]
    """Values of the metrics."""
    files: Replay | None
    """Files of the run, ready to use; null if none are written."""
    command: str | None
    """Command that repeats the run."""


class ParetoRun(TypedDict):
    """Pareto-optimal run."""

    run: int
    """Number of the run."""
    values: list[float]
    """Values of both metrics."""


class ParetoFigures(TypedDict):
    """Pareto-optimal runs of two metrics."""

    metrics: list[str]
    """Names of the metrics."""
    better: list[Literal['lower', 'higher']]
    """Preferred directions; lower if unknown."""
    runs: list[ParetoRun]
    """Runs, sorted by the first metric."""


class CaveatFigures(TypedDict):
    """Finding with the runs it concerns, represented by the worst of them."""

    severity: Literal['error', 'warning', 'note']
    """Severity."""
    code: str
    """Short, stable identifier of its kind."""
    where: str
    """Place in a file, as `path:line:column`, or the subject: a link, a joint, the payload, a file."""
    message: str
    """Complete message in one sentence."""
    value: float | None
    """Value found."""
    yardstick: float | None
    """Reference with which the value is compared."""
    unit: str
    """Unit of both."""
    likely: str
    """Likely mistake that explains the value, such as "about 1000 times: millimetres?"; empty if there is none."""
    help: str
    """Advice on what to check or how to fix it."""
    runs: int
    """Number of runs with this caveat."""
    worst_run: int
    """Number of the run with the worst value."""


class SweepSummary(TypedDict):
    """Result of `flexarm sweep`."""

    study: str
    """Name of the study."""
    runs: int
    """Number of runs of the study."""
    done: int
    """Number of successful runs."""
    failed: int
    """Number of failed runs."""
    shard: str | None
    """Shard that was computed, as `number/of`; null for all runs."""
    wall_s: float
    """Wall-clock time (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    file: str
    """Path of the table of all runs, or of the folder of a shard."""
    page: str | None
    """Path of the page."""
    parameters: list[ParameterFigures]
    """Varied parameters."""
    metrics: list[MetricFigures]
    """Metrics."""
    failures: list[FailureFigures]
    """Reasons of failed runs, most frequent first."""
    best: BestRun | None
    """Best run; null if no run succeeded."""
    pareto: ParetoFigures | None
    """Pareto-optimal runs of two metrics; null with one metric."""
    warnings: list[str]
    """Sentences of the caveats that are warnings, each once, with the number of affected runs."""
    caveats: list[CaveatFigures]
    """Caveats as from `check` and `compare`, each once with its worst value, warnings first."""
    doubles: int
    """Number of runs that several shards contain with the same result; they count once."""


class MaterialFigures(TypedDict):
    """A material, SI."""

    text: str
    """Preset and constants as text."""
    E: float
    """Young's modulus (Pa)."""
    nu: float
    """Poisson's ratio."""
    rho: float
    """Density (kg/m³)."""


_RegionFiguresFrom = TypedDict("_RegionFiguresFrom", {"from": "str"}, total=True)


class RegionFigures(_RegionFiguresFrom):
    """A region with the material in use."""

    region: str
    """Name of the region."""
    material: MaterialFigures
    """Material of the region."""


class InterfaceFigures(TypedDict):
    """An interface."""

    name: str
    """Name."""
    selector: str
    """Selection of the nodes."""
    nodes: int
    """Number of nodes."""
    tie: str
    """Tie: rigid or distributing."""
    position_m: list[float]
    """Position of the frame."""
    rpy_rad: list[float]
    """Roll, pitch, yaw of the frame."""
    centroid_m: list[float]
    """Mean position of the nodes."""
    extent_m: list[float]
    """Size of the bounding box of the nodes."""


class PartFigures(TypedDict):
    """A rigid part."""

    mass_kg: float
    """Mass."""
    com_m: list[float]
    """Centre of mass."""
    inertia: list[list[float]]
    """Inertia about the centre of mass, 3×3 (kg m²)."""


class ChainFigures(TypedDict):
    """A chain of rigid parts."""

    parts: int
    """Number of parts."""
    frequencies_hz: list[float]
    """Natural frequencies with A held and B free (Hz), at most as many as checked against the mesh."""


class ModalFigures(TypedDict):
    """Figures of a modal link: `model = "modal"` of a robot file."""

    coordinates: int
    """Number of generalised coordinates: six per interface except A, then modes."""
    interfaces: list[str]
    """Interfaces except A, distal first."""
    mass_kg: float
    """Mass, without attached bodies."""
    second_order: bool
    """Whether the second-order integrals are known."""
    geometric: bool
    """Whether the geometric stiffness is stored (`geometric_stiffening = true` of a robot file)."""
    frequencies_hz: list[float]
    """All natural frequencies with A held (Hz)."""


class ReduceModeFigures(TypedDict):
    """One mode with A held and B free; errors are relative to the mesh."""

    mesh_hz: float
    """Frequency of the mesh (Hz)."""
    reduced_hz: float | None
    """Frequency of the reduced matrices with their modes, Craig-Bampton (Hz)."""
    reduced_error: float | None
    """Relative error of the Craig-Bampton frequency."""
    guyan_hz: float | None
    """Frequency of the reduced matrices without modes, Guyan (Hz)."""
    guyan_error: float | None
    """Relative error of the Guyan frequency."""
    lumped_hz: float | None
    """Frequency of the two rigid parts (Hz)."""
    lumped_error: float | None
    """Relative error of the frequency of the two parts."""


class CheckFigures(TypedDict):
    """Results of the checks."""

    symmetry: float
    """Maximum relative asymmetry of the reduced stiffness as computed."""
    rigid_body_residual: float
    """Maximum relative force under rigid-body motion of all interfaces."""
    mass_error: float
    """Relative difference between the mass in the reduced matrix and that of the mesh."""
    com_error_m: float
    """Difference of the centres of mass (m)."""
    inertia_error: float
    """Relative difference of the inertias."""
    block_identity: float
    """Residual of the identity between `K_AA`, `K_AB` and `K_BB`."""
    zero_modes: int
    """Number of zero-frequency modes of the free reduced link; must be six."""
    min_eigenvalue: float
    """Minimum eigenvalue of `K_BB`, scaled to a unit diagonal."""
    condition: float
    """Estimated condition number of the stiffness of the free nodes."""
    mode_residual: float
    """Maximum residual of the kept modes."""
    jacobian_at_points: float
    """Minimum Jacobian at an integration point, relative to the mean of its element."""
    jacobian_at_nodes: float
    """Minimum Jacobian at a node, relative to the mean of its element."""
    worst_element: int
    """Number in the file of the element with the minimum Jacobian at a node."""
    smallest_fullness: float
    """Minimum volume of an element, relative to that of the best shape with edges of the same length."""
    largest_offset: float
    """Maximum distance of a mid-side node from the middle of its edge, relative to the length of the edge."""
    order_ratio: float | None
    """Ratio of the compliance at B with second-order elements to that of the mesh, for the component with the ratio farthest from one; null for second-order elements."""
    order_ratios: list[float] | None
    """Ratios of all components, along x y z rx ry rz."""


class SolverFigures(TypedDict):
    """Figures of the linear solver."""

    unknowns: int
    """Number of unknowns of the factorisation."""
    matrix_entries: int
    """Number of stored entries of the lower triangle of the matrix."""
    factor_entries: int
    """Number of stored entries of the factor."""
    ordering: str
    """Ordering used: amd or nested."""
    right_hand_sides: int
    """Total number of right-hand sides solved."""


class PhaseFigures(TypedDict):
    """Time of each step (s)."""

    read_s: float
    """Reading of the mesh and selection of nodes."""
    assembly_s: float
    """Element matrices and assembly."""
    factorisation_s: float
    """Cholesky factorisation and static shapes."""
    modes_s: float
    """Fixed-interface modes, and those of the mesh with A held."""
    parts_s: float
    """Rigid parts, chains and checks."""


class ReduceFiles(TypedDict):
    """Written files; null where none was written."""

    flex: str | None
    """Link file, for `reduced = "..."` of a robot file."""
    stress: str | None
    """Stress at the nodes of the surface, beside the link file; null unless requested."""
    entry: str | None
    """Entry for a robot file that uses the link, as TOML."""
    job: str | None
    """Complete job, to run it again."""
    summary: str | None
    """Summary file."""
    report: str | None
    """Report."""
    pictures: list[str]
    """Pictures of the ties, the deflections and the modes; empty without the feature `png`."""


class ReduceSummary(TypedDict):
    """Result of `flexarm reduce`."""

    link: str
    """Name of the link."""
    mesh: str
    """The mesh file."""
    format: str
    """Format of the mesh file."""
    units: str
    """Units of the mesh."""
    method: str
    """Method: "guyan" or "craig-bampton, 10 modes"."""
    quadrature: str
    """Quadrature: exact or calculix."""
    materials: list[RegionFigures]
    """Material of each region."""
    nodes: int
    """Number of nodes of the mesh."""
    elements: int
    """Number of elements."""
    dofs: int
    """Number of degrees of freedom."""
    interfaces: list[InterfaceFigures]
    """Interfaces, proximal first."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Centre of mass."""
    inertia: list[list[float]]
    """Inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad)."""
    compliance: list[list[float]]
    """Inverse of the stiffness: displacement of B per unit load at B."""
    split_m: list[float]
    """Position of the elastic joint between the two parts."""
    parts: list[PartFigures]
    """The two rigid parts, proximal first."""
    attached: list[PartFigures]
    """Bodies attached to the link that are not in the mesh; included in `parts`, not in `mass_kg`."""
    chains: list[ChainFigures]
    """Chains of more parts in the link file."""
    frequencies_hz: list[float]
    """Natural frequencies of the mesh with A held and B free (Hz)."""
    fixed_interface_hz: list[float]
    """Frequencies of the kept modes: those of the mesh with all interfaces held (Hz)."""
    modal: ModalFigures | None
    """Modal link in the link file."""
    modes: list[ReduceModeFigures]
    """Modes with A held, of the mesh and of the reduced models."""
    checks: CheckFigures
    """Results of the checks."""
    solver: SolverFigures
    """Figures of the linear solver."""
    phases: PhaseFigures
    """Time of each step (s)."""
    wall_s: float
    """Wall-clock time, excluding the writing of files (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    peak_rss_bytes: int | None
    """Peak memory of the process so far; null where the system does not report it."""
    warnings: list[str]
    """Warnings."""
    caveats: list[Finding]
    """The same warnings with code, value and reference value."""
    files: ReduceFiles
    """Written files."""


_ImportInterfaceFrom = TypedDict("_ImportInterfaceFrom", {"from": "str"}, total=True)


class ImportInterface(_ImportInterfaceFrom):
    """An interface."""

    name: str
    """Name."""
    rows: str
    """Rows or nodes in the file."""
    position_m: list[float]
    """Position of the frame."""
    rpy_rad: list[float]
    """Roll, pitch, yaw of the frame."""


class ImportChecks(TypedDict):
    """Results of the checks; relative unless the key has a unit."""

    symmetry: float
    """Maximum asymmetry of the matrices in the file."""
    rigid_body_residual: float
    """Residual force under rigid-body motion."""
    mass_error: float | None
    """Maximum relative difference between the masses along x, y, z and that of the link; null without a mass matrix."""
    block_identity: float
    """Residual of the identity between the blocks of the stiffness."""
    min_eigenvalue: float
    """Minimum eigenvalue of the stiffness, scaled to a unit diagonal."""
    condition: float
    """Condition number of the scaled stiffness."""


class ImportFiles(TypedDict):
    """Written files; null where none was written."""

    flex: str | None
    """Link file, for `reduced = "..."` of a robot file."""
    entry: str | None
    """Entry for a robot file that uses the link, as TOML."""
    summary: str | None
    """Summary file."""
    report: str | None
    """Report."""


class ImportSummary(TypedDict):
    """Result of `flexarm import`."""

    link: str
    """Name of the link."""
    sources: list[str]
    """Input files."""
    format: str
    """Format of the files."""
    units: str
    """Units of the files."""
    method: str
    """Method: "reduced matrices", "craig-bampton, 10 modes", ..."""
    rows: int
    """Number of rows of the stiffness in the file."""
    interfaces: list[ImportInterface]
    """Interfaces, proximal first."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Centre of mass."""
    inertia: list[list[float]]
    """Inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad)."""
    compliance: list[list[float]]
    """Inverse of the stiffness: displacement of B per unit load at B."""
    split_m: list[float]
    """Position of the elastic joint between the two parts."""
    parts: list[PartFigures]
    """The two rigid parts, proximal first."""
    frequencies_hz: list[float]
    """Natural frequencies with A held and B free (Hz); empty without a mass matrix or modes."""
    lumped_frequencies_hz: list[float]
    """Natural frequencies of the two rigid parts with their joint (Hz)."""
    fixed_interface_hz: list[float]
    """Frequencies of the fixed-interface modes in the matrices (Hz)."""
    modal: ModalFigures | None
    """Modal link in the file or computed from it; null where there is none."""
    checks: ImportChecks
    """Results of the checks."""
    wall_s: float
    """Wall-clock time, excluding the writing of files (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    peak_rss_bytes: int | None
    """Peak memory of the process so far; null where the system does not report it."""
    warnings: list[str]
    """Warnings."""
    caveats: list[Finding]
    """The same warnings with code, value and reference value."""
    files: ImportFiles
    """Written files."""


class ExportChecks(TypedDict):
    """Differences between the link and the files read back, and the checks of the link itself."""

    symmetry: float
    """Asymmetry of the stiffness from which the link was made."""
    rigid_body_residual: float | None
    """Residual force under rigid-body motion; null where the source was a 6×6 matrix."""
    mass_error: float | None
    """Maximum difference of the mass, relative to `sqrt(m_ii m_jj)`; null without mass."""
    stiffness_error: float
    """Maximum difference of the stiffness, relative to `sqrt(k_ii k_jj)`."""


class ExportSummary(TypedDict):
    """Result of `flexarm export`; SI units, link axes."""

    link: str
    """Name of the link."""
    format: str
    """Format."""
    units: str
    """Units of the files."""
    rows: int
    """Number of rows of the matrices."""
    modes: int
    """Number of modal coordinates among the rows."""
    map: str
    """Map with which `flexarm import` reads the files."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Centre of mass."""
    inertia: list[list[float]]
    """Inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6."""
    frequencies_hz: list[float]
    """Natural frequencies of the matrices with A held (Hz); empty without mass."""
    checks: ExportChecks
    """Results of the checks."""
    wall_s: float
    """Wall-clock time (s)."""
    peak_rss_bytes: int | None
    """Peak memory of the process so far; null where the system does not report it."""
    warnings: list[str]
    """Warnings."""
    files: list[str]
    """Written files."""


class JointInfo(TypedDict):
    """A movable joint; limits are null where there are none."""

    name: str
    """Name."""
    type: str
    """`revolute`, `continuous` or `prismatic`."""
    lower: float | None
    """Minimum position (rad or m)."""
    upper: float | None
    """Maximum position (rad or m)."""
    velocity: float | None
    """Maximum speed (rad/s or m/s)."""
    effort: float | None
    """Maximum torque or force (N m or N)."""
    acceleration: float | None
    """Maximum acceleration (rad/s² or m/s²)."""
    jerk: float | None
    """Maximum jerk (rad/s³ or m/s³)."""


class LinkInfo(TypedDict):
    """A link."""

    name: str
    """Name."""
    mass_kg: float
    """Mass (kg); 0 for a frame without inertia."""
    com_m: list[float]
    """Centre of mass in link axes (m)."""
    inertia: list[float]
    """`ixx iyy izz ixy ixz iyz` about the centre of mass, link axes (kg m²)."""


class _FlexibleInfo(TypedDict):
    """What is always there."""

    name: str
    """Name."""
    method: str
    """Method by which its stiffness was obtained."""
    length_m: float
    """Distance between the interfaces (m)."""
    parts_kg: list[float]
    """Masses of the rigid parts (kg)."""
    stiffness: list[list[float]]
    """Stiffness at the split, 6×6, linear first."""
    model: str
    """`lumped` or `modal`."""
    coordinates: int
    """Number of elastic coordinates."""


class FlexibleInfo(_FlexibleInfo, total=False):
    """A flexible link."""

    modal_frequencies_hz: list[float] | None
    """Natural frequencies of a modal link with interface A held, all of them (Hz)."""


class _MountingInfo(TypedDict):
    """What is always there."""

    name: str
    """Name."""
    position_m: list[float]
    """Position in the base link (m)."""
    quaternion_wxyz: list[float]
    """Orientation in the base link, w first."""
    stiffness: list[list[float]]
    """Stiffness in the axes of the springs, 6×6, linear first."""
    mass_kg: float
    """Mass carried in addition to the base (kg)."""


class MountingInfo(_MountingInfo, total=False):
    """Springs under the base."""

    backlash: list[float]
    """Play of each spring to each side (m, rad); empty if there is none."""


class CouplingInfo(TypedDict):
    """Coupling of motors that move several joints."""

    joints: list[str]
    """Coupled joints."""
    matrix: list[list[float]]
    """Matrix C of `q_joints = C q_motors`, with motor angles after their gears."""


class TcpInfo(TypedDict):
    """Pose of the tool centre point in the world."""

    link: str
    """Link that carries it."""
    position_m: list[float]
    """Position (m)."""
    quaternion_wxyz: list[float]
    """Orientation, w first."""


class BalancerInfo(TypedDict):
    """A balancer at a pose."""

    name: str
    """Name."""
    type: str
    """`line` or `joint`."""
    length: float
    """Length of the line (m), or value of the joint (rad or m)."""
    tension: float
    """Tension, which pulls the ends together or the joint to lower values (N; N m or N)."""
    stiffness: float
    """Derivative of the tension with respect to the length (N/m; N m/rad)."""
    torque: list[float]
    """Generalised force on each joint (N m or N), in coordinate order."""


class DependentInfo(TypedDict):
    """A dependent joint."""

    name: str
    """Name."""
    type: str
    """`revolute`, `continuous` or `prismatic`."""
    lower: float | None
    """Minimum position (rad or m)."""
    upper: float | None
    """Maximum position (rad or m)."""
    q: float
    """Position (rad or m)."""


class LoopInfo(TypedDict):
    """A loop at a pose."""

    name: str
    """Name."""
    dependent: list[DependentInfo]
    """Dependent joints."""
    transmission_angle: float
    """Transmission angle (rad, at most π/2)."""
    smallest_transmission_angle: float | None
    """Minimum transmission angle over poses spread over the joint ranges, except those excluded by limits of dependent joints."""


class _Inspection(TypedDict):
    """What is always there."""

    robot: str
    """Name of the robot."""
    joints: list[JointInfo]
    """Movable joints, in coordinate order."""
    links: list[LinkInfo]
    """Links with their mass properties."""
    flexible_links: list[FlexibleInfo]
    """Flexible links."""
    tcp: TcpInfo
    """Tool centre point at the pose."""
    q: list[float]
    """Requested pose, in the order of `joints`."""
    velocity: list[float]
    """Requested joint velocities."""
    jacobian: list[list[float]]
    """Jacobian: 6 rows, one column per joint."""
    mass_matrix: list[list[float]]
    """Mass matrix of the rigid robot with its payload."""
    gravity_torque: list[float]
    """Joint torques or forces that hold the pose, against gravity and balancers."""
    bias: list[float]
    """Bias torques in `τ = M q̈ + bias`: gravity, centrifugal and Coriolis forces."""
    coriolis: list[float]
    """Centrifugal and Coriolis torques: `bias - gravity_torque`."""
    mass_kg: float
    """Total mass (kg), including payload and base."""
    warnings: list[str]
    """Warnings among the caveats, as sentences."""
    caveats: list[Finding]
    """Probable errors in the input."""


class Inspection(_Inspection, total=False):
    """Result of `flexarm inspect`. SI units; Jacobian at the TCP in world axes, linear rows first."""

    mounting: MountingInfo | None
    """Springs under the base; a beam or a mesh there is one of the flexible links."""
    coupling: CouplingInfo | None
    """Coupling of motors that move several joints."""
    balancers: list[BalancerInfo]
    """Balancers at the pose; `gravity_torque` and `bias` include them."""
    loops: list[LoopInfo]
    """Closed loops at the pose; `joints` does not contain their dependent joints."""


class NewJoint(TypedDict):
    """A joint of the arm; limits are null where there are none."""

    name: str
    """Name."""
    type: str
    """Joint type in the URDF."""
    lower: float | None
    """Minimum position (rad or m)."""
    upper: float | None
    """Maximum position (rad or m)."""
    velocity: float | None
    """Speed limit (rad/s or m/s)."""
    effort: float | None
    """Effort limit of the description (N m or N)."""
    effort_fault: str | None
    """Fault of the effort limit, as text; null if none."""
    weight_torque: float
    """Maximum gravity torque over the workspace, with payload (N m or N)."""
    needed_torque: float
    """Gravity torque plus the torque to accelerate to full speed in 0.35 s (N m or N)."""


class NewHeld(TypedDict):
    """A joint that is held."""

    joint: str
    """Name."""
    at: float
    """Position at which it is held (rad or m)."""
    why: str
    """Reason."""


class NewLink(TypedDict):
    """A link of the arm. Lengths in m."""

    name: str
    """Name."""
    distal: str
    """Joint at its distal end."""
    length: float
    """Distance from its frame to that joint; length of its body where the frames do not run along it."""
    mass: float | None
    """Mass (kg)."""
    section: str | None
    """One of `box`, `tube`, `rectangle`, `circle`; null if none is proposed."""
    width: float | None
    """Size along y of the section; diameter of round ones."""
    height: float | None
    """Size along z of the section."""
    wall: float | None
    """Wall thickness; null for solid ones."""
    wall_of_half_mass: float | None
    """Wall thickness if only half of the mass is in the wall."""
    material: str | None
    """Name of the material."""
    y_axis: list[float] | None
    """Direction of the section's y in link axes."""
    offset: list[float] | None
    """Offset from the line between the joints to the beam, link axes."""
    ends: list[list[float]] | None
    """End points of the beam, link axes; null if it runs from the link's frame to the distal joint."""
    taper: float | None
    """Ratio of maximum to minimum outer size along the beam."""
    open_cuts: float | None
    """Fraction of the cuts through the mesh with an open outline, for which the convex hull is used."""
    reason: str | None
    """Reason why no section is proposed."""
    assumed: bool
    """Whether section and material are assumed: always, if there are any."""


class NewDrive(TypedDict):
    """A proposed drive."""

    joint: str
    """Joint of the drive."""
    stiffness: float
    """Torsional stiffness at the joint (N m/rad)."""
    low: float
    """Minimum of the gear class (N m/rad)."""
    high: float
    """Maximum of the gear class (N m/rad)."""
    rated_torque: float
    """Rated torque of the class (N m)."""
    damping_ratio: float
    """Damping ratio."""
    source: str
    """Source of the stiffness and its range."""
    assumed: bool
    """Whether it is assumed: always."""


class NewPayload(TypedDict):
    """Payload of the arm."""

    mass: float
    """Mass (kg)."""
    inertia: float
    """Moment of inertia about each axis (kg m²)."""
    assumed: bool
    """Whether the mass is assumed."""


class Assumption(TypedDict):
    """An assumption about the robot."""

    about: str
    """Subject: a joint, a link, the payload."""
    text: str
    """The assumption made."""
    mend: str
    """Way to replace it by a fact."""


class MotionPeak(TypedDict):
    """Extreme values of a joint, with their times (s); limits are null where there are none."""

    joint: str
    """Joint name."""
    unit: str
    """`rad`, `m`, or `rad or m` without a robot."""
    lower: float
    """Minimum position."""
    lower_at_s: float
    """Time of the minimum (s)."""
    lower_limit: float | None
    """Lower limit."""
    upper: float
    """Maximum position."""
    upper_at_s: float
    """Time of the maximum (s)."""
    upper_limit: float | None
    """Upper limit."""
    speed: float
    """Velocity of largest magnitude, signed."""
    speed_at_s: float
    """Time of the peak velocity (s)."""
    speed_limit: float | None
    """Velocity limit."""
    acceleration: float
    """Acceleration of largest magnitude, signed."""
    acceleration_at_s: float
    """Time of the peak acceleration (s)."""
    acceleration_limit: float | None
    """Acceleration limit."""
    jerk: float
    """Jerk of largest magnitude, excluding jumps of the acceleration."""
    jerk_at_s: float
    """Time of the peak jerk (s)."""
    jerk_limit: float | None
    """Jerk limit, of a path file or else of the robot."""
    acceleration_jump: float
    """Maximum jump of the acceleration."""
    torque: float | None
    """Torque or force of largest magnitude that the rigid robot with its payload needs (N m, N), with a robot."""
    torque_at_s: float | None
    """Time of the peak torque (s)."""
    torque_limit: float | None
    """Effort limit."""


class NewRobot(TypedDict):
    """Result of `flexarm new`."""

    robot: str
    """Robot file."""
    motion: str
    """Sample motion file."""
    urdf: str
    """Description that the robot file refers to."""
    name: str
    """Name of the robot."""
    placed: str
    """Whether and from where the description was copied, as text."""
    base: str
    """Base link of the arm."""
    tool: str
    """Tool link."""
    chain: list[str]
    """Links from the base to the tool."""
    joints: list[NewJoint]
    """Joints of the arm, in the order of the description."""
    held: list[NewHeld]
    """Joints that are held."""
    links: list[NewLink]
    """Links of the arm, with a section where one is proposed."""
    drives: list[NewDrive]
    """Proposed drives."""
    payload: NewPayload
    """Payload."""
    reach_m: float
    """Maximum distance of the TCP from the first joint in the sampled poses (m)."""
    moving_mass_kg: float
    """Mass moved by the joints of the arm, without payload (kg)."""
    assumptions: list[Assumption]
    """All assumptions."""
    questions: list[str]
    """Questions for the manufacturer, or quantities to measure."""
    duration_s: float
    """Duration of the sample motion (s)."""
    peaks: list[MotionPeak]
    """Peaks of the motion against the limits."""
    violations: list[str]
    """Limits violated by the motion, as sentences; only effort limits that the arm cannot keep at all."""
    findings: list[Finding]
    """Findings of `check` in the result."""
    files: list[str]
    """Written files."""
    summary: RunSummary | None
    """Summary of the first run, if there was one."""


#: A finding with a result: a warning or a note.
CaveatDict = Finding
