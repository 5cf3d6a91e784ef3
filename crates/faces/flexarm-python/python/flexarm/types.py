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
    "ImportPart",
    "ImportSummary",
    "IndexFigures",
    "Inspection",
    "InterfaceFigures",
    "JointChange",
    "JointInfo",
    "LeftTarget",
    "LinkFigures",
    "LinkInfo",
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
    "MinimiseFigures",
    "ModalFigures",
    "ModeFigures",
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
    """Names of the joints whose gearboxes yield."""


class Bending(_Bending, total=False):
    """What bends in a run."""

    mounting: str | None
    """What the base stands on, if it yields."""


class _StepperFigures(TypedDict):
    """What is always there."""

    name: str
    """Word of the command line."""
    h_s: float
    """Step (s)."""
    steps: int
    """Steps taken."""
    evaluations: int
    """Evaluations of the equations of motion."""
    factorisations: int
    """Factorisations."""


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
    """What one link, one gearbox, the servos or the stepper have in the largest TCP error."""

    name: str
    """Name of the link or joint."""
    kind: str
    """link, gearbox, servo, mounting or stepper."""
    along_m: float
    """Part of the error along its direction (m): all shares together make the error."""


class HoldFigures(TypedDict):
    """A stop: from the end of a move to the beginning of the next one or the end of the run."""

    start_s: float
    """Beginning (s)."""
    end_s: float
    """End (s)."""
    final_m: float
    """Distance at which the tool comes to rest (m)."""
    settling_s: float | None
    """Time from the beginning of the stop until the error stays within the band of its final value (s)."""
    overshoot_m: float
    """Largest excursion past the final value (m)."""
    ringing_hz: float | None
    """Strongest frequency (Hz)."""


class PoseFigures(TypedDict):
    """Accuracy and repeatability at a pose, in the sense of ISO 9283."""

    place_m: list[float]
    """Place of the rigid tool, world axes (m)."""
    visits: int
    """How often the tool stopped there."""
    accuracy_m: float
    """Distance of the mean place at the end of the stops from the rigid tool's (m): AP."""
    repeatability_m: float
    """Mean distance of the places from their mean and three standard deviations (m): RP."""


class TcpFigures(TypedDict):
    """Flexible against rigid tool centre point."""

    peak_m: float
    """Largest distance (m)."""
    t_peak_s: float
    """When (s)."""
    rms_m: float
    """Root mean square of the distance (m)."""
    end_m: float
    """Distance at the end (m)."""
    static_sag_m: float
    """Distance at rest at the start (m)."""
    static_at_peak_m: float | None
    """Part of `peak_m` that the arm would have standing still there, under weight and the loads of the instant, along the direction of the error (m); null where the arm has no equilibrium on its way."""
    dynamic_at_peak_m: float | None
    """The rest of `peak_m`, from inertia and ringing (m); negative where the motion relieves the arm."""
    static_peak_m: float | None
    """Largest static part (m)."""
    dynamic_peak_m: float | None
    """Largest dynamic part: error less static part (m)."""
    t_dynamic_peak_s: float | None
    """When (s)."""
    dynamic_rms_m: float | None
    """Root mean square of the dynamic part (m)."""
    shares_at_peak: list[ShareFigures]
    """Who makes the largest error: along its direction, in the order of the recordings."""
    peak_rad: float
    """Largest angle (rad)."""
    rms_rad: float
    """Root mean square of the angle (rad)."""
    settling_s: float | None
    """Time from the end of a move until the error stays within the band of its final value (s), at the stop that takes longest; null if the tool does not settle at some stop."""
    settling: str
    """The same in words: after which time, or at which stops the tool has not settled."""
    settling_band_m: float | None
    """Half width of the band (m)."""
    overshoot_m: float
    """Largest excursion past the final value after a move (m)."""
    dominant_hz: float | None
    """Strongest frequency of the error (Hz)."""
    path_peak_m: list[float]
    """Largest components along, across and out of the path (m)."""
    path_accuracy_m: float
    """Largest distance from the path while the robot moves (m): across and out of the path together."""
    path_rms_m: float
    """Root mean square of that distance over the moves (m)."""
    holds: list[HoldFigures]
    """What happened at each stop."""
    poses: list[PoseFigures]
    """Poses at which the tool stops more than once."""


class PathMoveFigures(TypedDict):
    """One move of the tool."""

    line: int
    """Line of the program or file."""
    statement: str
    """What stands there."""
    span_s: list[float]
    """First and last moment (s)."""
    across_peak_m: float
    """Largest distance from the path (m)."""
    across_rms_m: float
    """Root mean square of it (m)."""
    corner_overshoot_m: float
    """Swing along the direction of the move before, beyond the static deflection (m)."""
    programmed_m_s: float | None
    """Programmed speed (m/s)."""
    top_m_s: float | None
    """Greatest speed (m/s)."""


class PathFigures(TypedDict):
    """What a motion along a path of the tool has of errors across it."""

    across_peak_m: float
    """Largest distance from the path on moves of the tool (m), and when (s)."""
    t_across_peak_s: float
    """See there."""
    across_rms_m: float
    """Root mean square of that distance over the samples of those moves (m)."""
    offset_m: list[float]
    """Middle of the box that the error stays in on those moves: by how much a workpiece would be moved (m, world axes)."""
    left_m: float
    """What is left then, at most (m): half the diagonal of the box."""
    corner_overshoot_m: float
    """How far the tool swings on behind a corner, beyond its static deflection (m); 0 without a corner."""
    moves: list[PathMoveFigures]
    """Move by move, those of the tool alone."""


class LinkFigures(TypedDict):
    """A flexible link's share."""

    name: str
    """Name of the link."""
    peak_contribution_m: float
    """Largest TCP displacement that its deflection alone causes (m)."""
    engineering_strain: float
    """Largest change of the distance of its interfaces over that distance."""
    peak_rotation_rad: float
    """Largest elastic rotation (rad)."""


class DriveFigures(TypedDict):
    """An elastic drive's share."""

    joint: str
    """Name of the joint."""
    peak_contribution_m: float
    """Largest TCP displacement that its deflection alone causes (m)."""
    peak_deflection_rad: float
    """Largest deflection between motor and link (rad or m)."""


class _EnergyFigures(TypedDict):
    """What is always there."""

    drives_j: float
    """Net work of the drives: EnergyFigures::drives_positive_j without EnergyFigures::drives_negative_j (J)."""
    drives_positive_j: float
    """What the drives put in, each by itself while its power is positive (J)."""
    drives_negative_j: float
    """What they took out while it is negative, as a positive number (J)."""
    loads_j: float
    """Work of the external loads (J)."""
    dissipated_j: float
    """Taken away by dampers and friction (J)."""
    payload_j: float
    """Came with payloads that were picked, went with those that were dropped (J)."""
    stored_j: float
    """Gain of kinetic, gravitational and elastic energy (J)."""
    imbalance: float
    """Largest gap in the balance over the largest energy in it."""


class EnergyFigures(_EnergyFigures, total=False):
    """Energy over the run, from the logged samples (trapezoidal rule: a low log rate shows as imbalance)."""

    hysteresis_j: float
    """The part of it that the hysteresis of gears took (J)."""


class CaveatDict(TypedDict):
    """One caveat. SI units."""

    severity: Literal['warning', 'note']
    """How much it weighs."""
    code: str
    """Short, stable name of its kind."""
    where: str
    """What it is about: a link, a joint, the payload, a file."""
    message: str
    """All of it in one sentence."""
    value: float | None
    """What was found."""
    yardstick: float | None
    """What it is compared with."""
    unit: str
    """Unit of both."""
    likely: str
    """The slip that would explain it, such as "about 1000 times: millimetres?"; empty if none does."""
    help: str
    """What to look at, or how to mend it."""


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
    """Report: a page for the browser, with plots and pictures."""
    report_md: str | None
    """The figures of the report as Markdown."""
    figures: str | None
    """Folder with figures for papers."""
    foxglove_layout: str | None
    """Layout with which Foxglove opens the MCAP recording."""
    plotjuggler_layout: str | None
    """The same for PlotJuggler."""


class RunFiles(_RunFiles, total=False):
    """Written files; null where none was written."""

    arrow: str
    """Recording (arrow), if it was written."""
    study: str | None
    """Rerun recording of all runs of a study."""


class DifferenceFigures(TypedDict):
    """One run's flexible tool centre point against another's."""

    peak_m: float
    """Largest distance (m)."""
    t_peak_s: float
    """When (s)."""
    rms_m: float
    """Root mean square of the distance (m)."""
    of_peak_error: float | None
    """Largest distance over the first run's largest TCP error."""


_RunSummaryWith = TypedDict("_RunSummaryWith", {"with": "list[RunSummary]"}, total=False)


class _RunSummary(_RunSummaryWith):
    """What is always there."""

    headline: str
    """How far the tool is off and what bends, in one sentence; empty where that is not known."""
    robot: str
    """Name of the robot."""
    trajectory: str
    """Name of the trajectory."""
    links_model: str
    """rigid, lumped, modal or mixed."""
    bends: Bending
    """What bends; nothing if the robot is rigid."""
    end: str
    """"complete", or why the run stopped early."""
    duration_s: float
    """Simulated time (s)."""
    stepper: StepperFigures
    """Stepper with its work."""
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
    """Drives that give way."""
    energy: EnergyFigures
    """Where the energy went."""
    drives: dict[str, float]
    """Largest force per drive (N m or N)."""
    warnings: list[str]
    """What Summary::caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""
    files: RunFiles
    """Written files."""
    moves_s: list[list[float]]
    """Beginning and end of each move (s)."""


class RunSummary(_RunSummary, total=False):
    """Answer of `flexarm compare` and `flexarm run`. SI units.  `summary.json` is read back by `serde_json`; keys that a file of an older version lacks are their defaults."""

    path: PathFigures | None
    """The error across the path; absent unless the motion is told by the path of the tool."""
    motors: dict[str, float]
    """Largest torque per motor that moves several joints, behind its gear (N m or N), by the joint of its drive."""
    label: str | None
    """What the run is called in a study."""
    difference: DifferenceFigures | None
    """How far its tool is from that of the first run of a study."""


class ElementStatics(TypedDict):
    """An elastic element at the equilibrium."""

    name: str
    """Name of the link."""
    deflection: list[float]
    """Elastic coordinates (m, rad), in the axes of the proximal part."""
    load: list[float]
    """What its spring carries (N, N m)."""
    tcp_displacement_m: list[float]
    """Displacement of the TCP that it causes by itself, to first order (m)."""
    tcp_rotation_rad: list[float]
    """Rotation of the TCP that it causes by itself (rad)."""
    energy_j: float
    """Energy in it (J)."""


class StaticsFiles(TypedDict):
    """Written files; null where none was written."""

    picture: str | None
    """The arm, deflections magnified beside the rigid one, and the ellipsoid of its compliance."""
    json: str | None
    """This answer."""


class _StaticsDetails(TypedDict):
    """What is always there."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Joints that are held, in coordinate order."""
    at: list[float]
    """Where they are held (rad or m)."""
    tcp: str
    """Link that carries the TCP."""
    wrench: list[float]
    """Force (N) and moment (N m) on the TCP, besides weight."""
    tcp_position_m: list[float]
    """TCP of the rigid robot (m)."""
    tcp_displacement_m: list[float]
    """From the rigid TCP to the flexible one, under weight and wrench (m)."""
    tcp_rotation_rad: list[float]
    """The same as a rotation vector (rad)."""
    sag_m: list[float]
    """The part of weight alone (m)."""
    sag_rad: list[float]
    """The same as a rotation vector (rad)."""
    compliance: list[list[float]]
    """Displacement of the TCP per wrench at the equilibrium, drives locked, 6×6 (m/N, rad/N; m/(N m), rad/(N m))."""
    holding_torque: list[float]
    """Forces with which the drives hold the pose (N m or N)."""
    elements: list[ElementStatics]
    """Flexible elements."""
    residual: float
    """Unbalanced force over the largest force."""
    files: StaticsFiles
    """Written files."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""


class StaticsDetails(_StaticsDetails, total=False):
    """Answer of `flexarm statics`. SI units; world axes, at the TCP; six-vectors linear first."""

    motor_torque: dict[str, float]
    """Of motors that move several joints, behind their gears: `Cᵀ` times the holding torques of these (N m or N)."""


class ModeFigures(TypedDict):
    """One mode."""

    frequency_hz: float
    """Natural frequency (Hz)."""
    damped_frequency_hz: float
    """Frequency of the decaying oscillation (Hz)."""
    damping_ratio: float
    """Damping ratio."""
    tcp: list[float]
    """Motion of the TCP in the mode scaled to unit modal mass (1/sqrt(kg), rad/sqrt(kg m²) ...), real part."""
    tcp_imaginary: list[float]
    """Imaginary part; zero where the damping is proportional."""
    effective_mass: list[float | None]
    """Mass (kg) at the TCP, moment of inertia (kg m²) for rotations, that moves like the mode; null at a node."""
    compliance_share: list[float | None]
    """Part of the static compliance of the TCP in each direction that this mode carries; null where it does not yield."""
    strain_energy: list[float]
    """Share of each element in the strain energy."""
    residual: float
    """How well the mode fits its equation (relative)."""


class ModesSummary(TypedDict):
    """Answer of `flexarm modes`. SI units; world axes, at the TCP; six-vectors linear first."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Joints that are locked, in coordinate order."""
    at: list[float]
    """Where they are locked (rad or m)."""
    driven: list[str]
    """Joints that are not locked but under a servo, which counts as spring and damper here."""
    tcp: str
    """Link that carries the TCP."""
    frequencies_hz: list[float]
    """Natural frequencies `|λ| / 2π` (Hz), ascending."""
    undamped_frequencies_hz: list[float]
    """Frequencies without the dampers (Hz), ascending, as many."""
    damping_ratio: list[float]
    """Damping ratios `-Re λ / |λ|`."""
    elements: list[str]
    """Elastic elements, in the order of `strain_energy`."""
    modes: list[ModeFigures]
    """One entry per mode."""
    total: int
    """How many modes there are; `modes` may be fewer."""
    compliance_covered: list[float | None]
    """Parts of the static compliance that the modes above carry, per direction of the TCP; null where it does not yield."""
    files: RunFiles
    """Written files."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""


class PeakFigures(TypedDict):
    """A resonance."""

    frequency_hz: float
    """Where (Hz)."""
    magnitude: float
    """How high."""
    phase_rad: float
    """Phase there (rad)."""


class ResponseCurve(TypedDict):
    """Response of one output to one input."""

    input: str
    """Word of the input."""
    output: str
    """Word of the output."""
    unit: str
    """Unit of the magnitude."""
    at_rest: float | None
    """Response at rest, with its sign; null where it is infinite."""
    peaks: list[PeakFigures]
    """Resonances within the frequencies, the highest first."""
    magnitude: list[float]
    """Amplitude of the output per amplitude of the input, one per frequency."""
    phase_rad: list[float]
    """How far the output is ahead of the input (rad), one per frequency; steps of more than half a turn are taken out."""


class ResponseFiles(TypedDict):
    """Written files; null where none was written."""

    csv: str | None
    """Table."""
    plot: str | None
    """Magnitude and phase as a picture."""
    json: str | None
    """This answer."""


class ResponseSummary(TypedDict):
    """Answer of `flexarm response`. SI units."""

    robot: str
    """Name of the robot."""
    joints: list[str]
    """Joints, in coordinate order."""
    at: list[float]
    """Where they are held, or about where they move (rad or m)."""
    tcp: str
    """Link that carries the TCP."""
    quantity: str
    """displacement, velocity or acceleration."""
    frequencies_hz: list[float]
    """Natural frequencies of the modes (Hz), all."""
    damping_ratio: list[float]
    """Their damping ratios."""
    frequency_hz: list[float]
    """Frequencies of the curves (Hz)."""
    logarithmic: bool
    """Whether they are spaced by equal ratios."""
    curves: list[ResponseCurve]
    """One per input and output."""
    files: ResponseFiles
    """Written files."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""


class GridFigures(TypedDict):
    """The grid of a map."""

    lower_m: list[float]
    """First place (m)."""
    upper_m: list[float]
    """Last place (m)."""
    spacing_m: float
    """Distance of places (m)."""
    count: list[int]
    """Number of places along x, y and z."""
    directions: int
    """Directions of the tool at each."""


class Spread(TypedDict):
    """How the values of a quantity are spread over the poses."""

    min: float
    """Smallest."""
    max: float
    """Largest."""
    mean: float
    """Mean."""
    quantiles: dict[str, float]
    """Values below which 5, 25, 50, 75 and 95 % of the poses are, under `0.05` to `0.95`."""


class MapPose(TypedDict):
    """A pose of a map with all that it says."""

    row: int
    """Number of its row."""
    q: list[float]
    """Joints, in coordinate order (rad or m)."""
    place_m: list[float]
    """Place of the rigid arm's tool (m, world)."""
    value: float
    """Its value of the quantity by which the map compares."""
    quantities: dict[str, float]
    """All quantities."""


class Placement(TypedDict):
    """The best place for a box."""

    lower_m: list[float]
    """Lowest corner of the places that it covers (m, world)."""
    upper_m: list[float]
    """Highest corner (m, world)."""
    centre_m: list[float]
    """Centre (m, world)."""
    worst: float
    """The worst value in it, of the quantity by which the map compares."""
    points: int
    """Places of the map in it, all of which the tool reaches."""


class MapFiles(TypedDict):
    """Written files."""

    table: str | None
    """Every pose."""
    page: str | None
    """The page."""
    rrd: str | None
    """The recording for the viewer."""
    json: str | None
    """The figures."""


class MapSummary(TypedDict):
    """Answer of `flexarm map`. SI units, world axes, at the TCP."""

    robot: str
    """Name of the robot."""
    tcp: str
    """Link that carries the TCP."""
    joints: list[str]
    """Joints in coordinate order."""
    points: int
    """Places, or poses in joints, that were asked for."""
    reachable: int
    """Those of them with at least one pose within the limits that carries its weight."""
    poses: int
    """Poses that were answered; more than places where several directions or branches count."""
    failed: int
    """Poses without an equilibrium."""
    grid: GridFigures | None
    """The grid, of a map over places."""
    wrench: list[float]
    """Force (N) and moment (N m) on the TCP, besides weight."""
    by: str
    """Quantity by which best and worst are meant."""
    quantities: dict[str, Spread]
    """How each quantity is spread over the rows."""
    worst: MapPose
    """The worst pose."""
    best: MapPose
    """The best pose."""
    placement: Placement | None
    """Where the workpiece is best put; null without one, or if none of its places fits."""
    wall_s: float
    """How long it took (s)."""
    file: str | None
    """The table of all poses."""
    files: MapFiles
    """Written files."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""


class ErrorFigures(TypedDict):
    """Error of the tool over a run."""

    peak_m: float
    """Largest distance from the rigid arm's place (m)."""
    rms_m: float
    """RMS of it (m)."""
    peak_rad: float
    """Largest rotation from the rigid arm's (rad)."""
    end_m: float
    """Distance at the end (m)."""


class JointChange(TypedDict):
    """How far a joint is commanded away."""

    joint: str
    """Its name."""
    largest: float
    """Largest change (rad or m)."""


class MotionViolation(TypedDict):
    """A limit that is passed."""

    joint: str
    """Joint."""
    kind: str
    """lower, upper, velocity, jerk or effort."""
    time_s: float
    """When it is worst (s)."""
    since_s: float
    """When it is passed first (s)."""
    value: float
    """The worst value."""
    limit: float
    """The limit."""
    message: str
    """All of it in one sentence."""


class ShapedModeFigures(TypedDict):
    """A mode and what a shaper leaves of it."""

    frequency_hz: float
    """Natural frequency (Hz)."""
    damping_ratio: float
    """Damping ratio."""
    before_m: float
    """Oscillation of the tool that the motion would leave, the largest within the band of the frequency (m)."""
    after_m: float
    """The same with the shaper."""


class ShaperFigures(TypedDict):
    """A shaper as it was used."""

    kind: str
    """`zv`, `zvd` or `optimal`."""
    copies: list[list[float]]
    """Delay (s) and part of each copy of the motion."""
    modes: list[ShapedModeFigures]
    """Modes at the end of the motion that it was made against, the one that would swing most first."""


class PlantFigures(TypedDict):
    """The commands on a plant that is not the model."""

    plant: str
    """What is different."""
    before: ErrorFigures
    """With the motion as it is."""
    after: ErrorFigures
    """With the new commands."""


class LeftTarget(TypedDict):
    """A target that stays as it was."""

    line: int
    """Line of the move."""
    statement: str
    """The move."""
    why: str
    """Why."""
    residual_m: float
    """Distance of the flexible tool from its target at rest (m)."""


class ProgramFigures(TypedDict):
    """What became of the targets of a robot program."""

    files: list[str]
    """The corrected program, and data lists that changed with it."""
    targets: int
    """Targets that moves end at; dwells and arcs of a told angle have none."""
    corrected: int
    """How many of them were replaced."""
    loaded: int
    """At how many of them loads act, or another payload hangs than at the start."""
    before_m: float
    """Largest distance of the flexible tool from its target at rest, with the program as it was (m)."""
    residual_m: float
    """The same of the replaced ones, with the program as it was written and read again (m)."""
    residual_rad: float
    """Largest rotation there (rad)."""
    left: list[LeftTarget]
    """Those that stay as they were, the first of them."""


class Compensation(TypedDict):
    """Answer of `flexarm compensate`."""

    robot: str
    """The robot whose model found the commands."""
    motion: str
    """The motion."""
    method: str
    """`dynamic` or `static`."""
    before: ErrorFigures
    """Error with the motion as it is, on the plant."""
    after: ErrorFigures
    """Error with the new commands, on the plant."""
    model_peaks_m: list[float]
    """Peak after each iteration on the model itself, the first without any (m)."""
    iterations: int
    """Iterations that were kept."""
    cutoff_hz: float | None
    """Highest frequency that was corrected (Hz); null at rest."""
    changes: list[JointChange]
    """Largest change of each joint (rad or m)."""
    limits: list[MotionViolation]
    """Limits that the new motion passes: positions, speeds and accelerations of the commands, torques of the run on the plant."""
    slowed: float
    """How many times as long the motion takes so that limits are kept; 1 if it is as it was."""
    shaper_delay_s: float
    """How much longer the motion takes by its shaper (s)."""
    shaper: ShaperFigures | None
    """The shaper, if there is one."""
    plants: list[PlantFigures]
    """The same commands on other plants."""
    file: str | None
    """The new motion (.csv)."""
    files: list[str]
    """Further files of the new motion."""
    recording: str | None
    """The arm before and after (.rrd)."""
    program: ProgramFigures | None
    """The robot program with corrected targets, of motions that were read from one (KRL, RAPID)."""
    page: str | None
    """The page."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is doubtful."""


class ParameterSensitivity(TypedDict):
    """What a change of one number does to the error."""

    name: str
    """By the names of the robot file, of joints under servos `drive.JOINT.servo.` with their gains and `drive.JOINT.friction.` too; `motion.JOINT` for a shift of a joint, `tcp.x`, `.y` and `.z` for the place of the tool in its own axes."""
    unit: str
    """Its unit."""
    value: float
    """Its value; 0 of a shift, 1 of what a servo feeds forward."""
    per: str
    """Of which change of it the following are the effect: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg`, `1 mrad` or `1 mm`. They are derivatives, times that."""
    peak_m: float
    """Of the largest distance, at the time where it is (m)."""
    rms_m: float
    """Of the RMS distance (m)."""
    peak_rad: float
    """Of the largest angle (rad)."""
    rms_rad: float
    """Of the RMS angle (rad)."""


class Sensitivity(TypedDict):
    """Answer of `flexarm sensitivity`."""

    robot: str
    """The robot."""
    motion: str
    """The motion."""
    step_s: float
    """Step (s), and how many."""
    steps: int
    """Steps taken."""
    peak_m: float
    """Largest distance of the tool from the rigid one's (m)."""
    t_peak_s: float
    """When (s)."""
    rms_m: float
    """Root of its mean square (m)."""
    peak_rad: float
    """Largest angle (rad)."""
    rms_rad: float
    """Root of its mean square (rad)."""
    parameters: list[ParameterSensitivity]
    """One per number of the robot, its tool and its motion; what the RMS depends on most comes first."""
    table: str | None
    """Error and derivatives over time."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is doubtful."""


class PoseParameter(TypedDict):
    """What a change of one number does."""

    name: str
    """By the names of the robot file; `tcp.x`, `.y` and `.z` for the place of the tool in its own axes."""
    unit: str
    """Its unit."""
    value: float
    """Its value."""
    per: str
    """Of which change of it the following are the effect: `1 %`, `1 % of the root of K_ii K_jj`, `1 kg` or `1 mm`. They are derivatives, times that."""
    tcp_m: list[float]
    """Of the tool's place (m)."""
    tcp_rad: list[float]
    """Of its attitude, a rotation vector (rad)."""
    compliance: list[list[float]]
    """Of the compliance."""
    frequencies_hz: list[float]
    """Of the natural frequencies (Hz)."""


class PoseSensitivity(TypedDict):
    """Answer of `flexarm sensitivity --at`: drives locked, world axes, under the robot's own weight."""

    robot: str
    """The robot."""
    joints: list[str]
    """Joints, in coordinate order."""
    at: list[float]
    """Where they are held (rad or m)."""
    compliance: list[list[float]]
    """Compliance of the tool, displacement (m, rad) per force (N) and moment (N m), 6×6."""
    frequencies_hz: list[float]
    """Natural frequencies (Hz)."""
    parameters: list[PoseParameter]
    """One per number of the robot."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is doubtful."""


class FittedParameter(TypedDict):
    """A number of the robot file as it was found."""

    name: str
    """By the names of the robot file."""
    unit: str
    """Unit of the values."""
    initial: float
    """Before."""
    value: float
    """Now; the initial value where the readings say nothing."""
    std: float
    """Standard deviation; not a number (null in JSON) where the readings do not tell it or the fit does not meet them."""
    interval: list[float]
    """Where it lies in 95 of 100 cases; not numbers (nulls) without a deviation."""
    identifiable: bool
    """Whether the readings tell it."""


class Weight(TypedDict):
    """A parameter in a combination."""

    name: str
    """Its name."""
    weight: float
    """Its weight, over the prior deviation."""


class Residual(TypedDict):
    """RMS before and after."""

    before: float
    """With the robot file as it is."""
    after: float
    """With what was found."""
    unit: str
    """`m`, `Hz`, or `std` where readings of several units are mixed."""


class HeldOutFigures(TypedDict):
    """RMS over readings that the fit had not seen."""

    folds: int
    """Parts that were held out in turn."""
    rms: float
    """With the parameters fitted to the others."""
    rms_before: float
    """With the robot file as it is."""
    unit: str
    """As of the residual."""


class EncoderFigures(TypedDict):
    """What recordings tell of a gear. SI units."""

    joint: str
    """Joint."""
    stiffness: float
    """Stiffness (N m/rad, N/m)."""
    std: float
    """Its standard deviation, by leaving out seconds of the recordings."""
    delay_s: float
    """By how much the link's encoder is late (s)."""
    r2: float
    """Share of the deflection, without offsets and delay, that the torque explains."""
    unseen_r2: list[float]
    """The same of each run by the others (of each half, with one run)."""
    without_each: list[float]
    """Stiffness without each run."""
    deflection_rms: float
    """RMS of the deflection without offsets and delay (rad, m)."""
    rest_rms: float
    """RMS of what is left of it."""
    noise_rms: float
    """RMS of the noise of both instruments below `below`, from the noise that is faster (rad, m)."""
    told: bool
    """Whether the recordings tell the gear: most of an unseen run follows, and no run decides alone."""


class Suspicious(TypedDict):
    """A reading that argues against the rest."""

    reading: str
    """Which reading and number of it."""
    measured: float
    """Measured (SI)."""
    expected: float
    """Expected with what was found."""
    normalised: float
    """Difference over what its scatter would be."""


class ShapeFigures(TypedDict):
    """A measured shape against the arm's mode that is most like it."""

    reading: str
    """Which reading."""
    mode: int
    """The mode, from 1, with what was found."""
    assurance_before: float
    """Modal assurance criterion with the robot file as it is, from 0 to 1."""
    assurance: float
    """The same with what was found."""


class FoundFrame(TypedDict):
    """Where an instrument stands."""

    name: str
    """Its name."""
    xyz: list[float]
    """In the world (m)."""
    rpy: list[float]
    """Roll, pitch, yaw (rad)."""


class FoundPoint(TypedDict):
    """Where a target is."""

    name: str
    """Its name."""
    xyz: list[float]
    """In tool axes (m)."""


class Identification(TypedDict):
    """Answer of `flexarm identify`."""

    robot: str
    """The robot."""
    measurements: str
    """The file of measurements."""
    readings: int
    """How many readings, and numbers in them."""
    numbers: int
    """Numbers that were measured."""
    parameters: list[FittedParameter]
    """What was fitted."""
    correlation: list[list[float]]
    """Correlation of the parameters, row after row."""
    untold: list[list[Weight]]
    """Combinations that the readings do not tell."""
    residual: Residual
    """RMS of the residuals."""
    held_out: HeldOutFigures | None
    """RMS over readings that the fit had not seen; null with fewer than two readings."""
    misfit: float | None
    """How many times larger than its declared deviation the scatter is, where chance does not explain it; else null."""
    deviations_known: bool
    """Whether the deviations of the readings were given; if not, the scatter tells them."""
    encoders: list[EncoderFigures]
    """Gears of which motor and link were recorded."""
    suspicious: list[Suspicious]
    """Readings that argue against the rest, the worst first."""
    shapes: list[ShapeFigures]
    """Measured shapes of modes against those of the arm."""
    instruments: list[FoundFrame]
    """Unknown instruments as found, in the world."""
    targets: list[FoundPoint]
    """Unknown targets as found, tool axes (m)."""
    iterations: int
    """Iterations."""
    converged: bool
    """Whether the search ended by itself, at a fit that meets the readings."""
    file: str | None
    """The new robot file."""
    page: str | None
    """The page."""
    caveats: list[CaveatDict]
    """What is doubtful, of the robot as well."""
    warnings: list[str]
    """The sentences of the caveats that warn."""


class PlannedReading(TypedDict):
    """A pose and a load."""

    joints: list[float]
    """Joints (rad or m)."""
    force: list[float]
    """Force on the tool, world axes (N)."""
    at: list[float]
    """Where it acts, tool axes (m)."""
    point: list[float]
    """What is watched, tool axes (m)."""
    direction: list[float] | None
    """Direction of the gauge, world axes; null where all three numbers are read."""
    expected_m: list[float]
    """Displacement of the point to expect with the robot file as it is (m)."""


class ExpectedParameter(TypedDict):
    """What to expect of a parameter."""

    name: str
    """Its name."""
    unit: str
    """Its unit."""
    initial: float
    """Now."""
    std: float
    """Standard deviation after the measurement."""


class MeasurementPlan(TypedDict):
    """Answer of `flexarm identify --plan N`."""

    robot: str
    """The robot."""
    joints: list[str]
    """Joints, in the order of the poses."""
    poses: list[PlannedReading]
    """What to measure, the most telling first."""
    parameters: list[ExpectedParameter]
    """What to expect of each parameter."""
    work_std_m: float | None
    """Deviation of the tool's displacement where the work is done, largest over these poses and axes (m); null without them."""
    gain_over_first: float
    """How much more the plan tells than the same number of the candidates as they come: half the logarithm of the ratio of the determinants, over the number of parameters; 0.69 is half the deviation."""
    candidates: int
    """How many poses were candidates."""
    file: str | None
    """The files to fill in."""
    table: str | None
    """The table among them."""
    caveats: list[CaveatDict]
    """What is doubtful of the robot, as `check` says it."""
    warnings: list[str]
    """The sentences of those that warn."""


class _LobePoint(TypedDict):
    """What is always there."""

    spindle_rpm: float
    """Spindle speed (1/min)."""
    depth_m: float | None
    """Depth above which the cut chatters (m); null if it does not, up to the deepest that was looked at."""
    chatter_hz: float | None
    """Frequency at which the tip then swings most (Hz)."""
    kind: str | None
    """hopf (a frequency of its own) or flip (every second tooth cuts the same)."""
    zero_order_depth_m: float | None
    """Limit of the zero-order solution, for comparison (m)."""
    pose: int
    """Which pose it is of."""


class LobePoint(_LobePoint, total=False):
    """A limit."""

    unstable_m: list[list[float]]
    """All unstable ranges of depth (m), if asked for."""


class PoseLobes(TypedDict):
    """Limits at one pose."""

    at: list[float]
    """Joints (rad or m)."""
    time_s: float | None
    """When the motion is there (s)."""
    feed: list[float]
    """Direction of the feed, world axes."""
    axis: list[float]
    """From the spindle to the tip, world axes."""
    frequencies_hz: list[float]
    """Lowest natural frequencies of arm and tool (Hz)."""
    compliance: list[float]
    """Compliance at rest along the feed, across it, and along the tool (m/N)."""
    stable_below_m: float | None
    """Lowest limit (m); null if nothing chatters."""
    stable_below_at_rpm: float | None
    """Its speed (1/min)."""
    depth_m: list[float | None]
    """Limit at each speed (m)."""


class LobesFiles(TypedDict):
    """Written files; null where none was written."""

    csv: str | None
    """Table."""
    plot: str | None
    """Diagram."""
    page: str | None
    """Page for the browser."""
    json: str | None
    """This answer."""


class Lobes(TypedDict):
    """Answer of `flexarm lobes`. SI units, speeds in 1/min."""

    robot: str
    """Name of the robot."""
    tool: str
    """Name of the tool."""
    joints: list[str]
    """Joints, in coordinate order."""
    method: str
    """floquet or zero-order."""
    deepest_m: float
    """Deepest cut that was looked at (m)."""
    points: list[LobePoint]
    """One per speed: the smallest limit over all poses."""
    stable_below_m: float | None
    """Below this depth the cut is stable at every speed that was asked for (m); null if nothing chatters."""
    stable_below_at_rpm: float | None
    """Speed of that limit (1/min)."""
    best_rpm: float
    """The speed with the deepest stable cut (1/min), and that (m); the deepest that was looked at where nothing chatters."""
    best_depth_m: float
    """Its depth (m)."""
    poses: list[PoseLobes]
    """What was found at each pose."""
    left_out: int
    """Places of the motion that were left out: the tool stands still there, or moves along its axis."""
    file: str | None
    """The table; null if nothing was written."""
    files: LobesFiles
    """Written files."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input, or limits the worth of the result."""


_ParameterFiguresAs = TypedDict("_ParameterFiguresAs", {"as": "Literal['value', 'factor', 'offset']"}, total=True)


class ParameterFigures(_ParameterFiguresAs):
    """A parameter."""

    name: str
    """Its name."""
    range: list[float] | None
    """Least and largest value; null of words."""


class IndexFigures(TypedDict):
    """Sobol indices of a parameter."""

    parameter: str
    """The parameter."""
    first: float
    """Part of the variance that it makes by itself."""
    first_interval: list[float]
    """Where that lies in 95 of 100 cases."""
    total: float
    """Part that it makes with others too."""
    total_interval: list[float]
    """Likewise."""


class MetricFigures(TypedDict):
    """A metric over all runs that were done."""

    name: str
    """Its name."""
    count: int
    """Runs that have it."""
    min: float | None
    """Least."""
    max: float | None
    """Largest."""
    mean: float | None
    """Mean."""
    std: float | None
    """Standard deviation."""
    quantiles: list[float] | None
    """Quantiles 0.05, 0.5 and 0.95."""
    shares: dict[str, float | None]
    """Part of its variance that each parameter makes by itself (correlation ratio); null of words and where nothing varies."""
    matters: list[str]
    """The parameters that matter, the strongest first: listed ones with an effect, and drawn ones whose effect stands out of chance."""
    chance: float | None
    """Part of the scatter of the draws that the strongest of the drawn parameters would have by chance in 1 of 100 studies; null where nothing is drawn."""
    better: Literal['lower', 'higher'] | None
    """What is better of it; null if neither the study nor its expression nor its name tells."""
    sobol: list[IndexFigures]
    """Sobol indices of the parameters that were drawn by Saltelli's design; empty otherwise."""


class FailureFigures(TypedDict):
    """A reason why runs failed."""

    reason: str
    """The reason."""
    runs: int
    """Runs."""
    first: int
    """The first of them."""


class Replay(TypedDict):
    """The files of a run, and its options; a face makes a command of them."""

    robot: str
    """Robot file."""
    motion: str | None
    """Motion; none where the robot file names it."""
    loads: str | None
    """Loads."""
    options: list[list[float | str | bool | str]]
    """Options by their words."""


class BestRun(TypedDict):
    """The best run by a metric."""

    run: int
    """Its number."""
    metric: str
    """What is least or highest in it."""
    better: Literal['lower', 'higher']
    """Which of both: lower where it is not known what is better."""
    value: float
    """How much that is."""
    parameters: dict[str, float | str | bool]
    """Values of its parameters."""
    metrics: dict[str, float | None]
    """Its metrics."""
    files: Replay | None
    """Its files, ready to be run; null where none are written."""
    command: str | None
    """The command that runs it."""


class ParetoRun(TypedDict):
    """A run of the front."""

    run: int
    """Its number."""
    values: list[float]
    """Both metrics."""


class ParetoFigures(TypedDict):
    """Runs that no other beats in two metrics."""

    metrics: list[str]
    """Both."""
    better: list[Literal['lower', 'higher']]
    """What is better of each: lower where that is not known."""
    runs: list[ParetoRun]
    """By the first metric."""


class MinimiseFigures(TypedDict):
    """How a search went."""

    metric: str
    """What is to be least."""
    constraints: list[str]
    """What must hold."""
    kept: bool
    """Whether the best run keeps them all."""
    settled: bool
    """Whether the search ended by itself: its points hardly differed any more."""
    generations: int
    """Generations."""
    start: float | None
    """What the files give before anything is looked for; null if that run failed."""
    start_kept: bool
    """Whether that keeps the constraints."""
    progress: list[float | None]
    """Least value so far that keeps the constraints, after each generation; null before there is one."""


class CaveatFigures(TypedDict):
    """A caveat, and the runs that it concerns. It is that of the run in which it is worst."""

    severity: Literal['warning', 'note']
    """How much it weighs."""
    code: str
    """Short, stable name of its kind."""
    where: str
    """What it is about: a link, a joint, the payload, a file."""
    message: str
    """All of it in one sentence."""
    value: float | None
    """What was found."""
    yardstick: float | None
    """What it is compared with."""
    unit: str
    """Unit of both."""
    likely: str
    """The slip that would explain it, such as "about 1000 times: millimetres?"; empty if none does."""
    help: str
    """What to look at, or how to mend it."""
    runs: int
    """Runs of which it is said."""
    worst_run: int
    """The run with the worst value."""


class SweepSummary(TypedDict):
    """Answer of `flexarm sweep`."""

    study: str
    """Name of the study."""
    runs: int
    """Runs of the study."""
    done: int
    """Runs that gave a result."""
    failed: int
    """Runs that failed."""
    shard: str | None
    """The part of the runs that was run, as `number/of`; null for all."""
    wall_s: float
    """Wall-clock time (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    file: str
    """The table of all runs, or the folder of a shard."""
    page: str | None
    """The page."""
    parameters: list[ParameterFigures]
    """What is varied."""
    metrics: list[MetricFigures]
    """What came out."""
    failures: list[FailureFigures]
    """Why runs failed, the most frequent first."""
    best: BestRun | None
    """The best run; null if none was done."""
    pareto: ParetoFigures | None
    """The runs that no other beats in two metrics; null with one metric."""
    minimise: MinimiseFigures | None
    """How the search went, if one was made."""
    warnings: list[str]
    """The sentences of the caveats that warn, each once, with the number of runs that it concerns."""
    caveats: list[CaveatFigures]
    """What `check` and `compare` would say of the runs, each caveat once with its worst value, warnings first."""
    doubles: int
    """Runs that several shards had, with the same result; they count once."""


class MaterialFigures(TypedDict):
    """A material, SI."""

    text: str
    """Preset and constants for people."""
    E: float
    """Young's modulus (Pa)."""
    nu: float
    """Poisson's ratio."""
    rho: float
    """Density (kg/m³)."""


_RegionFiguresFrom = TypedDict("_RegionFiguresFrom", {"from": "str"}, total=True)


class RegionFigures(_RegionFiguresFrom):
    """A region with the material that was used."""

    region: str
    """Name of the region."""
    material: MaterialFigures
    """Its material."""


class InterfaceFigures(TypedDict):
    """An interface."""

    name: str
    """Name."""
    selector: str
    """Which nodes were asked for."""
    nodes: int
    """How many these are."""
    tie: str
    """rigid or distributing."""
    position_m: list[float]
    """Position of its frame."""
    rpy_rad: list[float]
    """Roll, pitch, yaw of its frame."""
    centroid_m: list[float]
    """Mean of its nodes."""
    extent_m: list[float]
    """Size of the box around its nodes."""


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
    """Natural frequencies with A held and B free (Hz), as many as the mesh's."""


class ModalFigures(TypedDict):
    """A modal link: `model = "modal"` of a robot file."""

    coordinates: int
    """Shape coordinates: six per interface but A, then modes."""
    interfaces: list[str]
    """Interfaces but A, distal first."""
    mass_kg: float
    """Mass, without bodies that ride on the link."""
    second_order: bool
    """Whether the integrals of second order are known."""
    geometric: bool
    """Whether stiffness by load is there (`geometric_stiffening = true` of a robot file)."""
    frequencies_hz: list[float]
    """Natural frequencies with A held, all of them (Hz)."""


class ReduceModeFigures(TypedDict):
    """One mode with A held and B free; errors are relative to the mesh."""

    mesh_hz: float
    """Of the mesh (Hz)."""
    reduced_hz: float | None
    """Of the reduced matrices with their modes, Craig-Bampton (Hz)."""
    reduced_error: float | None
    """Its error."""
    guyan_hz: float | None
    """Of the reduced matrices without modes, Guyan (Hz)."""
    guyan_error: float | None
    """Its error."""
    lumped_hz: float | None
    """Of the two rigid parts (Hz)."""
    lumped_error: float | None
    """Its error."""


class CheckFigures(TypedDict):
    """What was checked."""

    symmetry: float
    """Largest relative asymmetry of the reduced stiffness as computed."""
    rigid_body_residual: float
    """Largest relative force under rigid motion of all interfaces."""
    mass_error: float
    """Relative difference of the mass in the reduced matrix from that of the mesh."""
    com_error_m: float
    """The same of the centre of mass (m)."""
    inertia_error: float
    """The same of the inertia, relative."""
    block_identity: float
    """Disagreement of `K_AA`, `K_AB` with `K_BB`."""
    zero_modes: int
    """Modes of the free reduced link without frequency; six are right."""
    min_eigenvalue: float
    """Smallest eigenvalue of `K_BB`, scaled to a unit diagonal."""
    condition: float
    """Condition number of the stiffness of the free nodes, estimated."""
    mode_residual: float
    """Largest residual of the kept modes."""
    jacobian_at_points: float
    """Smallest Jacobian at an integration point over the mean of its element."""
    jacobian_at_nodes: float
    """Smallest Jacobian at a node over the mean of its element."""
    worst_element: int
    """Number in the file of the element with the latter."""
    smallest_fullness: float
    """Smallest volume of an element over that of the best shape with edges of the same length."""
    largest_offset: float
    """Largest distance of a mid-side node from the middle of its edge, over the length of the edge."""
    order_ratio: float | None
    """Compliance at B with elements of second order over that of the mesh, the component farthest from one; null for elements of second order."""
    order_ratios: list[float] | None
    """The same along x y z rx ry rz."""


class SolverFigures(TypedDict):
    """The linear algebra."""

    unknowns: int
    """Unknowns of the factor."""
    matrix_entries: int
    """Entries of the lower triangle of the matrix."""
    factor_entries: int
    """Entries of its factor."""
    ordering: str
    """amd or nested: the order that was used."""
    right_hand_sides: int
    """Right-hand sides solved in all."""


class PhaseFigures(TypedDict):
    """Time of each step (s)."""

    read_s: float
    """Reading the mesh, choosing nodes."""
    assembly_s: float
    """Element matrices."""
    factorisation_s: float
    """Cholesky factor and static shapes."""
    modes_s: float
    """Fixed-interface modes, and those of the mesh with A held."""
    parts_s: float
    """Parts, chains, checks."""


class ReduceFiles(TypedDict):
    """Written files; null where none was written."""

    flex: str | None
    """The link file, for `reduced = "..."` of a robot file."""
    entry: str | None
    """The entry of a robot file that uses it, as TOML."""
    job: str | None
    """The job, complete, to run again."""
    summary: str | None
    """These figures."""
    report: str | None
    """These figures for people."""
    pictures: list[str]
    """What is tied, how the link bends, its modes; empty without the feature `png`."""


class ReduceSummary(TypedDict):
    """Answer of `flexarm reduce`."""

    link: str
    """Name of the link."""
    mesh: str
    """The mesh file."""
    format: str
    """Its format."""
    units: str
    """Its units."""
    method: str
    """How: "guyan" or "craig-bampton, 10 modes"."""
    quadrature: str
    """exact or calculix."""
    materials: list[RegionFigures]
    """Material of each region."""
    nodes: int
    """Nodes of the mesh."""
    elements: int
    """Its elements."""
    dofs: int
    """Its degrees of freedom."""
    interfaces: list[InterfaceFigures]
    """Interfaces, proximal first."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Its centre of mass."""
    inertia: list[list[float]]
    """Its inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad)."""
    compliance: list[list[float]]
    """Its inverse: displacement of B per unit load at B."""
    split_m: list[float]
    """Where the elastic joint of the two parts sits."""
    parts: list[PartFigures]
    """The two rigid parts, proximal first."""
    attached: list[PartFigures]
    """Bodies that ride on the link without being in the mesh; they are in `parts`, not in `mass_kg`."""
    chains: list[ChainFigures]
    """Chains of more parts that the link file holds."""
    frequencies_hz: list[float]
    """Natural frequencies of the mesh with A held and B free (Hz)."""
    fixed_interface_hz: list[float]
    """Frequencies of the mesh with all interfaces held: the modes that were kept (Hz)."""
    modal: ModalFigures | None
    """The modal link in the link file."""
    modes: list[ReduceModeFigures]
    """Modes with A held, of the mesh and of the reduced models."""
    checks: CheckFigures
    """What was checked."""
    solver: SolverFigures
    """The linear algebra."""
    phases: PhaseFigures
    """Time of each step (s)."""
    wall_s: float
    """Wall-clock time without the writing of files (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    peak_rss_bytes: int | None
    """Largest memory of the process so far; null where the system does not tell."""
    warnings: list[str]
    """Things worth telling."""
    caveats: list[CaveatDict]
    """The same with code, value and yardstick."""
    files: ReduceFiles
    """Written files."""


_ImportInterfaceFrom = TypedDict("_ImportInterfaceFrom", {"from": "str"}, total=True)


class ImportInterface(_ImportInterfaceFrom):
    """An interface."""

    name: str
    """Name."""
    rows: str
    """Its rows or nodes in the file."""
    position_m: list[float]
    """Position of its frame."""
    rpy_rad: list[float]
    """Roll, pitch, yaw of its frame."""


class ImportPart(TypedDict):
    """A rigid part."""

    mass_kg: float
    """Mass."""
    com_m: list[float]
    """Centre of mass."""
    inertia: list[list[float]]
    """Inertia about the centre of mass, 3×3 (kg m²)."""


class ImportChecks(TypedDict):
    """What was checked; relative unless the key has a unit."""

    symmetry: float
    """Largest asymmetry of the matrices in the file."""
    rigid_body_residual: float
    """Force under rigid motion."""
    mass_error: float | None
    """Mass along x, y, z and that of the link, largest difference; null without a mass matrix."""
    block_identity: float
    """Disagreement of the blocks of the stiffness."""
    min_eigenvalue: float
    """Smallest eigenvalue of the stiffness, scaled to a unit diagonal."""
    condition: float
    """Its condition number."""


class ImportFiles(TypedDict):
    """Written files; null where none was written."""

    flex: str | None
    """The link file, for `reduced = "..."` of a robot file."""
    entry: str | None
    """The entry of a robot file that uses it, as TOML."""
    summary: str | None
    """These figures."""
    report: str | None
    """These figures for people."""


class ImportSummary(TypedDict):
    """Answer of `flexarm import`."""

    link: str
    """Name of the link."""
    sources: list[str]
    """Files that were given."""
    format: str
    """Their format."""
    units: str
    """Their units."""
    method: str
    """"reduced matrices", "craig-bampton, 10 modes", ..."""
    rows: int
    """Rows of the stiffness in the file."""
    interfaces: list[ImportInterface]
    """Interfaces, proximal first."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Its centre of mass."""
    inertia: list[list[float]]
    """Its inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad)."""
    compliance: list[list[float]]
    """Its inverse."""
    split_m: list[float]
    """Where the elastic joint of the two parts sits."""
    parts: list[ImportPart]
    """The two rigid parts, proximal first."""
    frequencies_hz: list[float]
    """Natural frequencies with A held and B free (Hz); empty without mass of matrices or modes."""
    lumped_frequencies_hz: list[float]
    """The same of the two rigid parts with their joint (Hz)."""
    fixed_interface_hz: list[float]
    """Frequencies of the fixed-interface modes in the matrices (Hz)."""
    modal: ModalFigures | None
    """The modal link that the file holds or gives; null where it cannot be one."""
    checks: ImportChecks
    """What was checked."""
    wall_s: float
    """Wall-clock time without the writing of files (s)."""
    cpu_s: float
    """Processor time, all threads (s)."""
    peak_rss_bytes: int | None
    """Largest memory of the process so far; null where the system does not tell."""
    warnings: list[str]
    """Things worth telling."""
    caveats: list[CaveatDict]
    """The same with code, value and yardstick."""
    files: ImportFiles
    """Written files."""


class ExportChecks(TypedDict):
    """Differences between the link and the files as read back, and the checks of the link itself."""

    symmetry: float
    """Asymmetry of the stiffness of the link's source."""
    rigid_body_residual: float | None
    """Force under rigid motion; null where the source was a 6×6."""
    mass_error: float | None
    """Largest difference of the mass, relative to `sqrt(m_ii m_jj)`; null without mass."""
    stiffness_error: float
    """Largest difference of the stiffness, relative to `sqrt(k_ii k_jj)`."""
    integrals_error: float | None
    """Largest difference of the mass integrals of a modal link; null in other formats."""


class ExportSummary(TypedDict):
    """Answer of `flexarm export`; SI units, link axes."""

    link: str
    """Name of the link."""
    format: str
    """Format."""
    units: str
    """Units of the files."""
    rows: int
    """Rows of the matrices."""
    modes: int
    """How many of them are modal coordinates."""
    map: str
    """The map with which `flexarm import` reads the files."""
    mass_kg: float
    """Mass of the whole link."""
    com_m: list[float]
    """Its centre of mass."""
    inertia: list[list[float]]
    """Its inertia about the centre of mass, 3×3 (kg m²)."""
    stiffness: list[list[float]]
    """Stiffness at B with A held, 6×6."""
    frequencies_hz: list[float]
    """Natural frequencies of the matrices with A held (Hz); empty without mass."""
    checks: ExportChecks
    """What was checked."""
    wall_s: float
    """Wall-clock time (s)."""
    peak_rss_bytes: int | None
    """Largest memory of the process so far; null where the system does not tell."""
    warnings: list[str]
    """Things worth telling."""
    files: list[str]
    """Written files."""


class JointInfo(TypedDict):
    """A movable joint; limits are null where there are none."""

    name: str
    """Name."""
    type: str
    """revolute, continuous, prismatic."""
    lower: float | None
    """Lowest position (rad or m)."""
    upper: float | None
    """Highest position (rad or m)."""
    velocity: float | None
    """Highest speed."""
    effort: float | None
    """Highest force."""


class LinkInfo(TypedDict):
    """A link."""

    name: str
    """Name."""
    mass_kg: float
    """Mass (kg); 0 for a mere frame."""
    com_m: list[float]
    """Centre of mass in link axes (m)."""
    inertia: list[float]
    """`ixx iyy izz ixy ixz iyz` about the centre of mass, link axes (kg m²)."""


class _FlexibleInfo(TypedDict):
    """What is always there."""

    name: str
    """Name."""
    method: str
    """Where its stiffness comes from."""
    length_m: float
    """Distance of the interfaces (m)."""
    parts_kg: list[float]
    """Masses of the two parts (kg)."""
    stiffness: list[list[float]]
    """Stiffness at the split, 6×6, linear first."""
    model: str
    """lumped or modal."""
    coordinates: int
    """How many elastic coordinates it has."""


class FlexibleInfo(_FlexibleInfo, total=False):
    """A flexible link."""

    modal_frequencies_hz: list[float] | None
    """Of a modal link: natural frequencies with A held, all of them (Hz)."""


class MountingInfo(TypedDict):
    """Springs under the base."""

    name: str
    """Name."""
    position_m: list[float]
    """Where they are, in the base link (m)."""
    quaternion_wxyz: list[float]
    """Their axes in the base link, w first."""
    stiffness: list[list[float]]
    """Stiffness in their axes, 6×6, linear first."""
    mass_kg: float
    """What rides on them beside the base (kg)."""


class CouplingInfo(TypedDict):
    """Motors that move several joints."""

    joints: list[str]
    """The joints."""
    matrix: list[list[float]]
    """C of `q_joints = C q_motors`, motors behind their gears."""


class TcpInfo(TypedDict):
    """Pose of the tool centre point in the world."""

    link: str
    """Link that carries it."""
    position_m: list[float]
    """Position (m)."""
    quaternion_wxyz: list[float]
    """Attitude, w first."""


class BalancerInfo(TypedDict):
    """A balancer at a pose."""

    name: str
    """Name."""
    type: str
    """`line` or `joint`."""
    length: float
    """Length of a line (m), or value of the joint (rad or m)."""
    tension: float
    """Tension: what draws the ends together, or the joint to lower values (N; N m or N)."""
    stiffness: float
    """Its derivative by the length (N/m; N m/rad)."""
    torque: list[float]
    """What it puts on each joint (N m or N), in coordinate order."""


class DependentInfo(TypedDict):
    """A dependent joint."""

    name: str
    """Name."""
    type: str
    """revolute, continuous, prismatic."""
    lower: float | None
    """Lowest position (rad or m)."""
    upper: float | None
    """Highest position (rad or m)."""
    q: float
    """Where it is (rad or m)."""


class LoopInfo(TypedDict):
    """A loop at a pose."""

    name: str
    """Name."""
    dependent: list[DependentInfo]
    """The joints that follow from it."""
    transmission_angle: float
    """Transmission angle (rad, at most a right angle)."""
    smallest_transmission_angle: float | None
    """The smallest one in poses spread over the joint ranges, without those that limits of dependent joints exclude."""


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
    """Pose asked for, in the order of `joints`."""
    velocity: list[float]
    """Velocity asked for."""
    jacobian: list[list[float]]
    """6 rows × one column per joint."""
    mass_matrix: list[list[float]]
    """Of the rigid robot with its payload."""
    gravity_torque: list[float]
    """Forces that hold the pose, against gravity and balancers."""
    bias: list[float]
    """`τ = M q̈ + bias`: gravity with centrifugal and Coriolis forces."""
    coriolis: list[float]
    """`bias - gravity_torque`."""
    mass_kg: float
    """Total mass (kg), payload and base included."""
    warnings: list[str]
    """What the caveats warn of, as sentences."""
    caveats: list[CaveatDict]
    """What is probably wrong with the input."""


class Inspection(_Inspection, total=False):
    """Answer of `flexarm inspect`. SI units; the Jacobian's rows are linear first, world axes, at the TCP."""

    mounting: MountingInfo | None
    """Springs under the base; a beam or a mesh there is one of the flexible links."""
    coupling: CouplingInfo | None
    """Motors that move several joints."""
    balancers: list[BalancerInfo]
    """Balancers at the pose; `gravity_torque` and `bias` have them in."""
    loops: list[LoopInfo]
    """Closed loops at the pose; their dependent joints are none of `joints`."""


class _Finding(TypedDict):
    """What is always there."""

    severity: str
    """error, warning or note."""
    code: str
    """Short, stable name of the kind of finding."""
    where: str
    """File and line, or joint or link."""
    message: str
    """What was found."""
    help: str
    """How to mend it."""


class Finding(_Finding, total=False):
    """One thing found."""

    value: float | None
    """Value that was found, if it is one."""
    yardstick: float | None
    """What it was compared with."""
    unit: str
    """Unit of both."""
    likely: str
    """The slip that would explain it."""


class NewJoint(TypedDict):
    """A joint of the arm; limits are null where there are none."""

    name: str
    """Its name."""
    type: str
    """Word of the URDF for its kind."""
    lower: float | None
    """Least position (rad or m)."""
    upper: float | None
    """Greatest position."""
    velocity: float | None
    """Speed limit (rad/s or m/s)."""
    effort: float | None
    """Effort limit of the description (N m or N)."""
    effort_fault: str | None
    """What is wrong with the effort limit, in words; null if nothing."""
    weight_torque: float
    """Largest torque of weight over the workspace, with payload (N m or N)."""
    needed_torque: float
    """The same with that of coming to full speed in 0.35 s."""


class NewHeld(TypedDict):
    """A joint that is held."""

    joint: str
    """Its name."""
    at: float
    """Where (rad or m)."""
    why: str
    """Why."""


class NewLink(TypedDict):
    """A link of the arm. Lengths in m."""

    name: str
    """Its name."""
    distal: str
    """Joint at its far end."""
    length: float
    """From its frame to that joint, or of its body where the frames do not run along it."""
    mass: float | None
    """Mass (kg)."""
    section: str | None
    """`box`, `tube`, `rectangle`, `circle`; null if none is proposed."""
    width: float | None
    """Along y of the section; the diameter of round ones."""
    height: float | None
    """Along z of the section."""
    wall: float | None
    """Thickness of the wall; null for solid ones."""
    wall_of_half_mass: float | None
    """Thickness if only half of the mass is wall."""
    material: str | None
    """Name of the material."""
    y_axis: list[float] | None
    """Direction of the section's y in link axes."""
    offset: list[float] | None
    """From the line between the joints to the beam, link axes."""
    ends: list[list[float]] | None
    """Where the beam itself begins and ends, link axes; null from the link's frame to the distal joint."""
    taper: float | None
    """Largest over smallest outer width along the beam."""
    open_cuts: float | None
    """Part of the cuts through the mesh whose outline was not closed: there its convex hull counts."""
    reason: str | None
    """Why no section is proposed."""
    assumed: bool
    """Whether section and material are assumed: always, where there are some."""


class NewDrive(TypedDict):
    """A drive that is proposed."""

    joint: str
    """Its joint."""
    stiffness: float
    """Torsional stiffness at the joint (N m/rad)."""
    low: float
    """Lowest that the class shows."""
    high: float
    """Highest that the class shows."""
    rated_torque: float
    """Rated torque of the class (N m)."""
    damping_ratio: float
    """Damping ratio."""
    source: str
    """Where the stiffness and its range come from."""
    assumed: bool
    """Always."""


class NewPayload(TypedDict):
    """What the tool carries."""

    mass: float
    """Mass (kg)."""
    inertia: float
    """Moment of inertia about each axis (kg m²)."""
    assumed: bool
    """Whether the mass is assumed."""


class Assumption(TypedDict):
    """Something that was assumed."""

    about: str
    """What it is about: a joint, a link, the payload."""
    text: str
    """What was assumed."""
    mend: str
    """How to know better."""


class MotionPeak(TypedDict):
    """The largest values of a joint, with their times (s); limits are null where there are none."""

    joint: str
    """Its name."""
    unit: str
    """`rad`, `m`, or `rad or m` without a robot."""
    lower: float
    """Least position."""
    lower_at_s: float
    """When."""
    lower_limit: float | None
    """The limit."""
    upper: float
    """Greatest position."""
    upper_at_s: float
    """When."""
    upper_limit: float | None
    """The limit."""
    speed: float
    """Speed of greatest magnitude, with its sign."""
    speed_at_s: float
    """When."""
    speed_limit: float | None
    """The limit."""
    acceleration: float
    """Acceleration of greatest magnitude."""
    acceleration_at_s: float
    """When."""
    jerk: float
    """Jerk of greatest magnitude, jumps of the acceleration apart."""
    jerk_at_s: float
    """When."""
    jerk_limit: float | None
    """The limit: that of a path file."""
    acceleration_jump: float
    """Largest jump of the acceleration."""
    torque: float | None
    """Torque or force of greatest magnitude that the rigid robot with its payload needs (N m, N), with a robot."""
    torque_at_s: float | None
    """When."""
    torque_limit: float | None
    """The limit."""


class NewRobot(TypedDict):
    """Answer of `flexarm new`."""

    robot: str
    """The robot file."""
    motion: str
    """The sample motion."""
    urdf: str
    """The description that the robot file refers to."""
    name: str
    """Name of the robot."""
    placed: str
    """Whether the description was copied, and from where, in words."""
    base: str
    """Link at which the arm begins."""
    tool: str
    """Link that is the tool."""
    chain: list[str]
    """Links from the base to the tool."""
    joints: list[NewJoint]
    """Joints of the arm, in the order of the description."""
    held: list[NewHeld]
    """Joints that stay where they are."""
    links: list[NewLink]
    """Links of the arm, with a section where one is proposed."""
    drives: list[NewDrive]
    """Proposed drives."""
    payload: NewPayload
    """What the tool carries."""
    reach_m: float
    """Largest distance of the tool from the first joint in the poses that were looked at (m)."""
    moving_mass_kg: float
    """Mass that the joints of the arm move, without payload (kg)."""
    assumptions: list[Assumption]
    """Everything that was assumed."""
    questions: list[str]
    """What to ask of the maker, or to measure."""
    duration_s: float
    """How long the sample motion takes (s)."""
    peaks: list[MotionPeak]
    """Its largest values against the limits."""
    violations: list[str]
    """Limits that it passes, in words: those of effort that the arm cannot keep at all."""
    findings: list[Finding]
    """What `check` finds in the result."""
    files: list[str]
    """Files that were written."""
    summary: RunSummary | None
    """The first run, if there was one."""
