//! Stress of the flexible links, from stress fields stored beside reduced links or from the section
//! forces of beams.
//!
//! The monitor keeps the amplitudes of the fields at every logged sample; [`StressMonitor::result`]
//! finds the maxima over the run for every node of the surface. Stress in Pa, components `xx yy zz
//! xy yz zx` in link axes; L link, W world. Not here: stress fields (`flexarm-fem`), sentences
//! (`caveat`).

mod equivalent;
mod fatigue;

use std::cell::OnceCell;
use std::path::Path;
use std::sync::Arc;

#[cfg(feature = "png")]
use flexarm_draw::mesh_picture::{Image, StressPicture, stress_sheet};
use flexarm_draw::palette::magnitude;
use flexarm_fem::chain::Chain;
use flexarm_fem::stress::{StressError, StressFields, StressMap, inertia_loads};
use flexarm_fem::{FemError, ReducedLink, RigidPart};
use flexarm_flexlink::{FlexibleSpan, LinkForm};
use flexarm_kinematics::{Data, Frame, Pose, State, inverse_dynamics};
use flexarm_log::{GAUGE_ENDS, STRESS_VIEW, Scenery, SceneryForm};
use flexarm_stepping::{ElasticElement, Observation, Plant};
use nalgebra::{DMatrix, DVector, Matrix6, Point3, RowSVector};

use crate::arm::options::Modelling;
use crate::arm::{Arm, Owner};
use crate::error::Error;
use crate::robot::Robot;
use crate::robot::robot_link::{RobotLink, StressSource};
use crate::robot::strength::Strength;
use crate::run::summary::{
    LinkStressFigures, SectionForceFigures, StrainGaugeFigures, StressPlaceFigures, StressPointFigures,
};
pub use equivalent::signed_von_mises;
use equivalent::{principal, von_mises_squared};

/// Nodes this close to a tied node are left out, as a fraction of the distance between the
/// interfaces: the stress beside a rigid tie is that of the tie.
const NEAR_TIE: f64 = 0.05;
/// Minimum distance between the worst places, as the same fraction.
const APART: f64 = 0.05;
/// Number of worst places per link.
const PLACES: usize = 5;
/// Stress by which the polyline of the amplitudes may be off, over that of the largest amplitude.
const POLYLINE: f32 = 2e-3;
/// Samples and sites evaluated together.
const SAMPLES: usize = 128;
const SITES: usize = 512;

/// Monitors the stress of links.
pub(crate) struct StressMonitor {
    links: Vec<LinkStress>,
    gauges: Vec<PlacedGauge>,
    data: Data,
    state: State,
    times: Vec<f64>,
}

/// A link with its map from coordinates to stress.
struct LinkStress {
    name: String,
    fields: Arc<StressFields>,
    map: StressMap,
    /// Coordinates of its elements in the model: first one and number.
    elements: Vec<(usize, usize)>,
    /// Link frame on its body.
    frame: Frame,
    /// Distance between its interfaces (m).
    length: f64,
    /// Strength given in the robot file.
    strength: Option<Strength>,
    /// Amplitudes and loads of all samples.
    amplitudes: Vec<f32>,
    /// Poses of the link in the world at all samples.
    poses: Vec<Pose>,
    /// Maximum von Mises stress of each site (Pa) with positive and with negative sign, once it is
    /// computed.
    sides: OnceCell<Vec<[f32; 2]>>,
}

/// A gauge at a node of the surface.
struct PlacedGauge {
    name: String,
    /// Index into [`StressMonitor::links`].
    link: usize,
    site: usize,
    /// Strain per stress component (1/Pa) of a strain gauge; `None` for a stress point.
    strain: Option<[f64; 6]>,
}

impl StressMonitor {
    /// Returns the monitor, or `None` if no link has stress fields.
    ///
    /// # Errors
    /// [`Error::File`] for a stress file that is damaged or belongs to another link, and for a
    /// gauge that is not on the surface.
    pub(crate) fn new(arm: &Arm, plant: &Plant) -> Result<Option<Self>, Error> {
        let robot = arm.robot();
        let mut links = Vec::new();
        for (k, link) in robot.flexible_links.iter().enumerate().filter(|(_, link)| link.stress.is_some()) {
            // Rigid links have no spans.
            let Some(span) = arm.spans.get(k) else { continue };
            let owned = plant.elements.iter().zip(&arm.owners).filter(|(_, owner)| **owner == Owner::Link(k));
            let owned: Vec<&ElasticElement> = owned.map(|(element, _)| element).collect();
            if owned.is_empty() {
                continue;
            }
            let Some((fields, map)) = fields_and_map(robot, link, span, &owned, arm.modelling())? else {
                continue;
            };
            let elements = owned.iter().map(|element| (element.coordinate, element.size)).collect();
            let frame = plant.model.frame(&span.link).expect("a link of the substitution").clone();
            let (name, length) = (span.link.clone(), span.length);
            links.push(LinkStress {
                name,
                fields,
                map,
                elements,
                frame,
                length,
                strength: link.strength,
                amplitudes: Vec::new(),
                poses: Vec::new(),
                sides: OnceCell::new(),
            });
        }
        if links.is_empty() {
            return Ok(None);
        }
        let gauges = placed(robot, &links)?;
        let (data, state) = (Data::new(&plant.model), State::zeros(&plant.model));
        Ok(Some(Self { links, gauges, data, state, times: Vec::new() }))
    }

    /// Forgets all samples.
    pub(crate) fn clear(&mut self) {
        self.times.clear();
        for link in &mut self.links {
            link.amplitudes.clear();
            link.poses.clear();
            link.sides.take();
        }
    }

    /// Adds a sample; one without accelerations is left out.
    pub(crate) fn update(&mut self, observed: &Observation) {
        if observed.qddot.iter().any(|a| a.is_nan()) {
            return;
        }
        self.times.push(observed.t);
        self.state.q.copy_from(&observed.q);
        self.state.qdot.copy_from(&observed.qdot);
        inverse_dynamics(&observed.model, &mut self.data, &self.state, &observed.qddot);
        let mut q = Vec::new();
        for link in &mut self.links {
            // A holds spatial accelerations minus gravity; ω × v makes them those of the point.
            let V = self.data.V[link.frame.body].at_child(&link.frame.X_BF);
            link.poses.push(observed.X_WB[link.frame.body] * link.frame.X_BF);
            let A = self.data.A[link.frame.body].at_child(&link.frame.X_BF);
            let a = A.linear + V.angular.cross(&V.linear);
            q.clear();
            for &(first, size) in &link.elements {
                q.extend_from_slice(&observed.q.as_slice()[first..first + size]);
            }
            link.map.append(&q, &inertia_loads(&a, &A.angular, &V.angular), &mut link.amplitudes);
        }
    }

    /// Returns the names of the gauge channels.
    pub(crate) fn channels(&self) -> Vec<String> {
        let names = self.gauges.iter().flat_map(|gauge| match gauge.strain {
            Some(_) => vec![format!("{}_strain", gauge.name)],
            None => GAUGE_ENDS[1..].iter().map(|(end, _)| format!("{}{end}", gauge.name)).collect(),
        });
        names.collect()
    }

    /// Replaces `values` by those of the gauge channels at the last sample: strain (m/m), or signed
    /// von Mises, largest and smallest principal stress (Pa). NaN for a sample without
    /// accelerations.
    pub(crate) fn read_gauges(&self, observed: &Observation, values: &mut Vec<f64>) {
        values.clear();
        let is_blind = self.times.last() != Some(&observed.t);
        for gauge in &self.gauges {
            let stress = if is_blind { [f64::NAN; 6] } else { self.links[gauge.link].last_stress(gauge.site) };
            match gauge.strain {
                Some(strain) => values.push(strain.iter().zip(stress).map(|(by, stress)| by * stress).sum()),
                None if is_blind => values.extend([f64::NAN; 3]),
                None => {
                    let [largest, smallest] = principal(&stress);
                    values.extend([signed_von_mises(stress), largest, smallest]);
                }
            }
        }
    }

    /// Returns the worst places of each link, and the extremes of its gauges.
    pub(crate) fn result(&self) -> Vec<LinkStressFigures> {
        let figures = |(number, link): (usize, &LinkStress)| {
            let amplitudes = link.amplitudes();
            let own = || self.gauges.iter().filter(move |gauge| gauge.link == number);
            let points = own().filter(|gauge| gauge.strain.is_none()).map(|gauge| StressPointFigures {
                name: gauge.name.clone(),
                place: link.place(gauge.site, &amplitudes, &self.times),
            });
            let strain = |gauge: &PlacedGauge| {
                // Strain history: row of the gauge times the stress (Voigt) of its site.
                let by = RowSVector::<f32, 6>::from(gauge.strain?.map(|by| by as f32));
                let history = by * link.map.stress().fixed_rows::<6>(6 * gauge.site) * &amplitudes;
                let site = &link.fields.sites[gauge.site];
                Some(StrainGaugeFigures {
                    name: gauge.name.clone(),
                    node: site.node,
                    position_m: site.position.into(),
                    lowest: f64::from(history.min()),
                    highest: f64::from(history.max()),
                })
            };
            LinkStressFigures {
                points: points.collect(),
                gauges: own().filter_map(strain).collect(),
                ..link.figures(&amplitudes, &self.times)
            }
        };
        self.links.iter().enumerate().filter(|_| !self.times.is_empty()).map(figures).collect()
    }

    /// Returns the surfaces of the links in the world at the instant of the largest stress,
    /// coloured by the maximum of each node over the run, and labels of the worst places.
    pub(crate) fn scenery(&self) -> Vec<Scenery> {
        let links = || self.links.iter().filter(|_| !self.times.is_empty()).map(|link| (link, link.worst()));
        let worst = |(link, worst): &(&LinkStress, Vec<usize>)| worst.first().map_or(0.0, |k| link.peak(*k));
        // The link with the largest stress gives the scale of the colours and the instant.
        let Some(first) = links().max_by(|a, b| worst(a).total_cmp(&worst(b))) else { return Vec::new() };
        let scale = f64::from(worst(&first)).max(f64::MIN_POSITIVE);
        let Some(sample) = first.1.first().map(|k| first.0.time_of_peak(*k)) else { return Vec::new() };
        let objects = links().flat_map(|(link, worst)| {
            let X_WL = link.poses[sample];
            let place = |k: usize| (X_WL * Point3::from(link.fields.sites[k].position)).coords.map(|x| x as f32).into();
            let color = |stress: f32| {
                let [r, g, b] = magnitude((f64::from(stress) / scale).min(1.0));
                [r, g, b, 255]
            };
            // Surface coloured by stress, and labels at the worst places.
            let surface = SceneryForm::Surface {
                places: (0..link.fields.sites.len()).map(place).collect(),
                triangles: link.fields.triangles.clone(),
                colors: (0..link.fields.sites.len()).map(|k| color(link.peak(k))).collect(),
            };
            let labels = SceneryForm::Points {
                places: worst.iter().map(|k| place(*k)).collect(),
                colors: vec![[255; 4]],
                radius_m: 0.005 * link.length as f32,
                labels: worst.iter().map(|k| format!("{:.1} MPa", 1e-6 * link.peak(*k))).collect(),
            };
            [(link.name.clone(), surface), (format!("{} worst places", link.name), labels)]
        });
        objects.map(|(name, form)| Scenery { view: STRESS_VIEW.into(), name, form }).collect()
    }

    /// Returns a picture of the stress of every link, as PNG; `None` without samples.
    #[cfg(feature = "png")]
    pub(crate) fn picture(&self) -> Option<Vec<u8>> {
        let sheets: Vec<Image> = self.links.iter().filter(|_| !self.times.is_empty()).map(LinkStress::sheet).collect();
        let first = sheets.first()?;
        let (width, height) = (first.width, first.height);
        let mut whole = Image::new(width, height * sheets.len(), [255; 3]);
        for (number, sheet) in sheets.iter().enumerate() {
            whole.paste(sheet, 0, number * height);
        }
        whole.to_png().ok()
    }

    /// Without the feature `png` there is no picture.
    #[cfg(not(feature = "png"))]
    pub(crate) fn picture(&self) -> Option<Vec<u8>> {
        None
    }

    /// Whether the stepper gave no accelerations, so that there is no stress.
    pub(crate) fn is_blind(&self) -> bool {
        self.times.is_empty()
    }
}

/// Returns the stress of the links of an arm at rest at coordinates q, without times and damage.
pub(crate) fn stress_at_rest(arm: &Arm, plant: &Plant, q: &DVector<f64>) -> Result<Vec<LinkStressFigures>, Error> {
    let Some(mut monitor) = StressMonitor::new(arm, plant)? else { return Ok(Vec::new()) };
    let mut observed = Observation::new(plant);
    observed.q.copy_from(q);
    monitor.update(&observed);
    let mut links = monitor.result();
    for link in &mut links {
        link.damage = None;
        link.most_damaged = None;
        let points = link.points.iter_mut().map(|point| &mut point.place);
        link.worst.iter_mut().chain(points).for_each(|place| place.damage = None);
    }
    Ok(links)
}

/// Finds the nodes of the gauges of a robot; those on links that the arm has rigid are left out.
fn placed(robot: &Robot, links: &[LinkStress]) -> Result<Vec<PlacedGauge>, Error> {
    let mut gauges = Vec::new();
    for gauge in &robot.gauges {
        let Some(number) = links.iter().position(|link| link.name == gauge.link) else { continue };
        let fields = &links[number].fields;
        let place = || {
            let site = fields.nearest_site(&gauge.at)?;
            let strain = gauge.grid.map(|(direction, angle)| fields.strain_by_stress(site, &direction, angle));
            Ok::<_, StressError>((site, strain.transpose()?))
        };
        let entry = if gauge.grid.is_some() { "strain_gauge" } else { "stress_point" };
        let (site, strain) =
            place().map_err(|error| unusable(&robot.path, format_args!("{entry} {:?}: {error}", gauge.name)))?;
        gauges.push(PlacedGauge { name: gauge.name.clone(), link: number, site, strain });
    }
    Ok(gauges)
}

/// Returns the stress fields of a link and the map from the coordinates of its model; `None` for a
/// beam with modes.
fn fields_and_map(
    robot: &Robot,
    link: &RobotLink,
    span: &FlexibleSpan,
    elements: &[&ElasticElement],
    modelling: &Modelling,
) -> Result<Option<(Arc<StressFields>, StressMap)>, Error> {
    // Stress fields: from the file of a mesh link, or from the formulas of a beam.
    let (fields, path) = match (&link.stress, &link.beam, &span.lumped) {
        (Some(StressSource::File { path, fields }), ..) => (fields.clone(), path),
        (Some(StressSource::Beam), Some(beam), Some(lumped)) => {
            let named =
                |error: FemError| unusable(&robot.path, format_args!("stress of link {:?}: {error}", span.link));
            (Arc::new(beam.stress_fields(&lumped.joints, &lumped.parts).map_err(named)?), &robot.path)
        }
        _ => return Ok(None),
    };
    // Map from elastic coordinates of a chain, or from modal coordinates.
    let map = match &span.lumped {
        Some(Chain { joints, parts }) => {
            let spring = |element: &&ElasticElement| Matrix6::from_fn(|i, j| element.K[(i, j)]);
            let springs: Vec<Matrix6<f64>> = elements.iter().map(spring).collect();
            fields.chain_map(joints, &without_attached(&link.flexible.reduced, parts.clone()), &springs)
        }
        None => match robot.form_of(link, modelling)? {
            (LinkForm::Modal(modal), _) => fields.modal_map(&modal, link.stiffness_factor),
            _ => return Ok(None),
        },
    };
    Ok(Some((fields, map.map_err(|error| unusable(path, error))?)))
}

/// Returns an error about a stress file or a gauge.
fn unusable(path: &Path, what: impl std::fmt::Display) -> Error {
    Error::Modelling(format!("{}: {what}", path.display()))
}

/// Returns the parts without the bodies attached to the link, whose loads act at its interfaces.
pub(crate) fn without_attached(reduced: &ReducedLink, mut parts: Vec<RigidPart>) -> Vec<RigidPart> {
    let along = reduced.X_LB.translation.vector - reduced.X_LA.translation.vector;
    for body in reduced.details.iter().flat_map(|details| &details.attached) {
        let is_beyond = (body.com - reduced.split.X_LS.translation.vector).dot(&along) > 0.0;
        let end = if is_beyond { parts.last_mut() } else { parts.first_mut() };
        if let Some(end) = end {
            *end = end.less(body);
        }
    }
    parts
}

impl LinkStress {
    /// Returns the amplitudes of all samples, one column each.
    fn amplitudes(&self) -> DMatrix<f32> {
        let columns = self.map.columns();
        DMatrix::from_column_slice(columns, self.amplitudes.len() / columns, &self.amplitudes)
    }

    /// Draws the largest stress of every node.
    #[cfg(feature = "png")]
    fn sheet(&self) -> Image {
        let positions: Vec<_> = self.fields.sites.iter().map(|site| site.position).collect();
        let [X_LA, X_LB] = [0, 1].map(|k| self.fields.poses[k].translation.vector);
        stress_sheet(&StressPicture {
            link: &self.name,
            remark: "the numbers are those of the worst places in summary.json",
            note: if self.judged().len() < positions.len() { "nodes near tied ones are not judged" } else { "" },
            positions: &positions,
            triangles: &self.fields.triangles,
            stress: &(0..positions.len()).map(|k| f64::from(self.peak(k))).collect::<Vec<_>>(),
            worst: &self.worst(),
            along: X_LB - X_LA,
        })
    }

    /// Returns the sites that are judged: those that are not near a tied node.
    fn judged(&self) -> Vec<usize> {
        let clear = NEAR_TIE * self.length;
        (0..self.fields.sites.len()).filter(|k| self.fields.sites[*k].from_tie >= clear).collect()
    }

    /// Returns the worst sites, which are apart from each other.
    fn worst(&self) -> Vec<usize> {
        let mut order = self.judged();
        order.sort_by(|a, b| self.peak(*b).total_cmp(&self.peak(*a)));
        let mut worst: Vec<usize> = Vec::new();
        for k in order {
            let p = self.fields.sites[k].position;
            let is_new = |other: &usize| (p - self.fields.sites[*other].position).norm() > APART * self.length;
            if worst.iter().all(is_new) {
                worst.push(k);
            }
            if worst.len() == PLACES {
                break;
            }
        }
        worst
    }

    /// Returns the stress of a site at the last sample (Pa).
    fn last_stress(&self, site: usize) -> [f64; 6] {
        let last = &self.amplitudes[self.amplitudes.len() - self.map.columns()..];
        let stress = self.map.stress();
        std::array::from_fn(|c| {
            last.iter()
                .enumerate()
                .map(|(k, amplitude)| f64::from(stress[(6 * site + c, k)]) * f64::from(*amplitude))
                .sum()
        })
    }

    /// Returns the maximum of a site over the run.
    fn place(&self, k: usize, amplitudes: &DMatrix<f32>, times: &[f64]) -> StressPlaceFigures {
        let site = &self.fields.sites[k];
        let history = self.signed_history(k, amplitudes);
        let sample = largest(&history);
        let stress = history[sample].abs();
        let strength = self.strength_at(k);
        StressPlaceFigures {
            node: site.node,
            position_m: site.position.into(),
            t_s: times[sample],
            von_mises_pa: stress,
            of_yield: strength.map(|strength| stress / strength.yield_pa),
            material: strength.map(|strength| strength.name.to_owned()),
            damage: self.damage(k, &history),
        }
    }

    /// Returns the sample with the largest stress of a site.
    fn time_of_peak(&self, site: usize) -> usize {
        largest(&self.signed_history(site, &self.amplitudes()))
    }

    /// Returns the worst places over the run.
    fn figures(&self, amplitudes: &DMatrix<f32>, times: &[f64]) -> LinkStressFigures {
        let worst = self.worst().into_iter().map(|k| self.place(k, amplitudes, times));
        let worst: Vec<StressPlaceFigures> = worst.collect();
        let most_damaged = self.most_damaged(amplitudes).map(|k| self.place(k, amplitudes, times));
        LinkStressFigures {
            name: self.name.clone(),
            nodes: self.fields.sites.len(),
            left_out: self.fields.sites.len() - self.judged().len(),
            clear_of_ties_m: NEAR_TIE * self.length,
            peak_pa: worst.first().map_or(0.0, |place| place.von_mises_pa),
            of_yield: worst.first().and_then(|place| place.of_yield),
            damage: most_damaged.as_ref().and_then(|place| place.damage),
            most_damaged,
            worst,
            section_forces: self.section_forces(amplitudes),
            ..LinkStressFigures::default()
        }
    }

    /// Returns the extremes of the section forces of a beam over the run.
    fn section_forces(&self, amplitudes: &DMatrix<f32>) -> Vec<SectionForceFigures> {
        let Some(sections) = &self.fields.section_forces else { return Vec::new() };
        let forces = self.map.section_forces() * amplitudes;
        let extremes = |(plane, x): (usize, &f64)| SectionForceFigures {
            at_m: *x,
            lowest: std::array::from_fn(|c| f64::from(forces.row(6 * plane + c).min())),
            highest: std::array::from_fn(|c| f64::from(forces.row(6 * plane + c).max())),
        };
        sections.x.iter().enumerate().map(extremes).collect()
    }

    /// Returns the signed von Mises stress of a site over the run (Pa).
    fn signed_history(&self, site: usize, amplitudes: &DMatrix<f32>) -> Vec<f64> {
        let own = self.map.stress().rows(6 * site, 6) * amplitudes;
        own.column_iter().map(|column| signed_von_mises([0, 1, 2, 3, 4, 5].map(|c| f64::from(column[c])))).collect()
    }

    /// Returns the samples at the corners of a polyline that is close to the amplitudes.
    ///
    /// The von Mises stress is a convex function of the amplitudes: on a straight line it is
    /// nowhere larger than at both ends. So the samples in between are not needed to find the worst
    /// nodes; the stress is off by [`POLYLINE`] at most.
    fn corners(&self, amplitudes: &DMatrix<f32>) -> Vec<usize> {
        let stress = self.map.stress();
        // Largest stress per unit of each amplitude: bounds the stress of a difference.
        let units = stress.column_iter().map(|column| {
            let sites = column.as_slice().as_chunks::<6>().0;
            sites.iter().map(von_mises_squared).fold(0.0, f32::max).sqrt()
        });
        let scaled = DMatrix::from_diagonal(&DVector::from_iterator(stress.ncols(), units)) * amplitudes;
        let allowed = POLYLINE * scaled.amax();
        let (mut corners, mut pieces) = (vec![0], vec![(0, amplitudes.ncols() - 1)]);
        while let Some((first, last)) = pieces.pop() {
            let (start, slope) = (scaled.column(first), scaled.column(last) - scaled.column(first));
            let off = |k: usize| {
                let share = (k - first) as f32 / (last - first) as f32;
                (scaled.column(k) - start - &slope * share).lp_norm(1)
            };
            let farthest = (first + 1..last).map(|k| (k, off(k))).max_by(|a, b| a.1.total_cmp(&b.1));
            match farthest {
                Some((k, off)) if off > allowed => pieces.extend([(k, last), (first, k)]),
                _ => corners.push(last),
            }
        }
        corners.dedup();
        corners
    }

    /// Returns the maximum von Mises stress of a site over the run (Pa).
    fn peak(&self, site: usize) -> f32 {
        let [positive, negative] = self.sides()[site];
        positive.max(negative)
    }

    /// Returns the maximum von Mises stress of each site over the run (Pa) with positive and with
    /// negative sign.
    fn sides(&self) -> &[[f32; 2]] {
        self.sides.get_or_init(|| {
            let amplitudes = self.amplitudes();
            self.sides_of(&amplitudes.select_columns(&self.corners(&amplitudes)))
        })
    }

    /// Returns [`LinkStress::sides`] among the corners of a polyline.
    ///
    /// The sign is that of the trace where the trace exceeds half of the von Mises stress at both
    /// ends of a piece, and so in between. Other pieces count for both signs.
    fn sides_of(&self, amplitudes: &DMatrix<f32>) -> Vec<[f32; 2]> {
        let stress = self.map.stress();
        let mut sides = vec![[0.0_f32; 2]; self.fields.sites.len()];
        // Sign (0 if unknown) and square at the last corner.
        let mut last = vec![(0.0_f32, 0.0_f32); SITES];
        let mut product = DMatrix::zeros(6 * SITES, SAMPLES);
        for (block, sides) in sides.chunks_mut(SITES).enumerate() {
            let own = stress.rows(6 * SITES * block, 6 * sides.len());
            for first in (0..amplitudes.ncols()).step_by(SAMPLES) {
                let count = SAMPLES.min(amplitudes.ncols() - first);
                let mut product = product.view_mut((0, 0), (own.nrows(), count));
                product.gemm(1.0, &own, &amplitudes.columns(first, count), 0.0);
                for (k, column) in product.column_iter().enumerate() {
                    let sites = column.as_slice().as_chunks::<6>().0;
                    for ((side, last), stress) in sides.iter_mut().zip(&mut last).zip(sites) {
                        let square = von_mises_squared(stress);
                        let trace = stress[0] + stress[1] + stress[2];
                        let sign = if 4.0 * trace * trace > square { trace.signum() } else { 0.0 };
                        let (before, squared) = if first + k == 0 { (sign, square) } else { *last };
                        let is_mixed = sign != before || sign == 0.0;
                        let most = if is_mixed { square.max(squared) } else { square };
                        for (side, of) in side.iter_mut().zip([1.0, -1.0]) {
                            if is_mixed || sign == of {
                                *side = side.max(most);
                            }
                        }
                        *last = (sign, square);
                    }
                }
            }
        }
        sides.iter_mut().flatten().for_each(|square| *square = square.sqrt());
        sides
    }
}

/// Returns the index of the number of the largest magnitude; 0 if there is none.
fn largest(numbers: &[f64]) -> usize {
    (0..numbers.len()).max_by(|a, b| numbers[*a].abs().total_cmp(&numbers[*b].abs())).unwrap_or(0)
}
