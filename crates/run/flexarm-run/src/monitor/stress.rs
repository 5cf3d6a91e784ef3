//! Stress of the flexible links whose stress fields are stored beside their reduced links.
//!
//! The monitor keeps the amplitudes of the fields at every logged sample; [`StressMonitor::result`]
//! finds the maxima over the run for every node of the surface.

use flexarm_analysis::{SnCurve, rainflow_repeating};
#[cfg(feature = "png")]
use flexarm_draw::mesh_picture::{Image, StressPicture, stress_sheet};
use flexarm_fem::stress::{StressFields, StressMap, inertia_loads, parse_stress, von_mises};
use flexarm_fem::{Material, ReducedLink, RigidPart};
use flexarm_flexlink::LinkForm;
use flexarm_kinematics::{Data, Frame, State, inverse_dynamics};
use flexarm_stepping::{FlexibleArm, Observation, PooledWorkspace};
use nalgebra::{DMatrix, DVector, Matrix3};

use crate::error::Error;
use crate::flexible::{FlexibleRobot, Owner, RobotLink};
use crate::options::Modelling;
use crate::robot::Robot;
use crate::summary::{LinkStressFigures, StressPlaceFigures};

/// Seats this close to a tied node are left out, as a fraction of the distance between the
/// interfaces: the stress beside a rigid tie is that of the tie.
const NEAR_TIE: f64 = 0.05;
/// Minimum distance between the worst places, as the same fraction.
const APART: f64 = 0.05;
/// Number of worst places per link.
const PLACES: usize = 5;
/// Stress by which the polyline of the amplitudes may be off, over that of the largest amplitude.
const POLYLINE: f32 = 2e-3;
/// Samples and seats evaluated together.
const SAMPLES: usize = 128;
const SEATS: usize = 512;

/// Monitors the stress of links.
pub(crate) struct StressMonitor {
    links: Vec<LinkStress>,
    data: PooledWorkspace<Data>,
    state: State,
    times: Vec<f64>,
}

/// A link with its map from coordinates to stress.
struct LinkStress {
    name: String,
    fields: StressFields,
    map: StressMap,
    /// Coordinates of its elements in the model: first one and number.
    elements: Vec<(usize, usize)>,
    /// Link frame on its body.
    frame: Frame,
    /// Distance between its interfaces (m).
    length: f64,
    /// Amplitudes and loads of all samples.
    amplitudes: Vec<f32>,
}

impl StressMonitor {
    /// Returns the monitor, or `None` if no link has stress fields.
    ///
    /// # Errors
    /// [`Error::File`] for a stress file that is damaged or belongs to another link.
    pub(crate) fn new(
        robot: &Robot,
        flexible: &FlexibleRobot,
        arm: &FlexibleArm,
        modelling: &Modelling,
    ) -> Result<Option<Self>, Error> {
        let mut links = Vec::new();
        for (k, link) in robot.flexible.iter().enumerate().filter(|(_, link)| link.stress.is_some()) {
            let span = &flexible.spans[k];
            let owned = arm.elements.iter().zip(&flexible.owners).filter(|(_, owner)| **owner == Owner::Link(k));
            let elements: Vec<_> = owned.map(|(element, _)| (element.coordinate, element.size)).collect();
            let Some(file) = link.stress.as_ref().filter(|_| !elements.is_empty()) else { continue };
            let fail = |what: String| Error::File { path: file.clone(), what };
            let bytes = std::fs::read(file).map_err(|error| fail(error.to_string()))?;
            let fields = parse_stress(&bytes).map_err(fail)?;
            let map = map_of(link, &fields, modelling).map_err(fail)?;
            let frame = arm.model.frame(&span.link).expect("a link of the substitution").clone();
            let (name, length) = (span.link.clone(), span.length);
            links.push(LinkStress { name, fields, map, elements, frame, length, amplitudes: Vec::new() });
        }
        if links.is_empty() {
            return Ok(None);
        }
        let (data, state) = (arm.lend_data(), State::zeros(&arm.model));
        Ok(Some(Self { links, data, state, times: Vec::new() }))
    }

    /// Adds a sample; one without accelerations is left out.
    pub(crate) fn update(&mut self, seen: &Observation) {
        if seen.qddot.iter().any(|a| a.is_nan()) {
            return;
        }
        self.times.push(seen.t);
        self.state.q.copy_from(&seen.q);
        self.state.qdot.copy_from(&seen.qdot);
        inverse_dynamics(&seen.model, &mut self.data, &self.state, &seen.qddot);
        let mut q = Vec::new();
        for link in &mut self.links {
            // A holds spatial accelerations minus gravity; ω × v makes them those of the point.
            let V = self.data.V[link.frame.body].at_child(&link.frame.X_BF);
            let A = self.data.A[link.frame.body].at_child(&link.frame.X_BF);
            let a = A.linear + V.angular.cross(&V.linear);
            q.clear();
            for &(first, size) in &link.elements {
                q.extend_from_slice(&seen.q.as_slice()[first..first + size]);
            }
            link.map.append(&q, &inertia_loads(&a, &A.angular, &V.angular), &mut link.amplitudes);
        }
    }

    /// Returns the worst places of each link.
    pub(crate) fn result(&self) -> Vec<LinkStressFigures> {
        self.links.iter().filter(|_| !self.times.is_empty()).map(|link| link.figures(&self.times)).collect()
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

/// Returns the map for the model of the link.
fn map_of(link: &RobotLink, fields: &StressFields, modelling: &Modelling) -> Result<StressMap, String> {
    let reduced = &link.flexible.reduced;
    let (joints, parts) = match link.form(modelling)? {
        LinkForm::Modal(modal) => return fields.modal_map(&modal, link.stiffness_factor),
        LinkForm::TwoParts => (vec![reduced.split.clone()], vec![reduced.proximal.clone(), reduced.distal.clone()]),
        LinkForm::Chain(chain) => (chain.joints, chain.parts),
    };
    let springs: Vec<_> = joints.iter().map(|joint| link.scaled(&joint.K_S)).collect();
    fields.chain_map(&joints, &without_attached(reduced, parts), &springs)
}

/// Returns the parts without the bodies attached to the link, whose loads act at its interfaces.
fn without_attached(reduced: &ReducedLink, mut parts: Vec<RigidPart>) -> Vec<RigidPart> {
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
    fn amplitudes(&self) -> DMatrix<f32> {
        let columns = self.map.columns();
        DMatrix::from_column_slice(columns, self.amplitudes.len() / columns, &self.amplitudes)
    }

    /// Draws the largest stress of every node.
    #[cfg(feature = "png")]
    fn sheet(&self) -> Image {
        let amplitudes = self.amplitudes();
        let peaks = self.peaks(&amplitudes.select_columns(&self.corners(&amplitudes)));
        let positions: Vec<_> = self.fields.seats.iter().map(|seat| seat.position).collect();
        let [X_LA, X_LB] = [0, 1].map(|k| self.fields.poses[k].translation.vector);
        stress_sheet(&StressPicture {
            link: &self.name,
            remark: "the numbers are those of the worst places in summary.json",
            positions: &positions,
            triangles: &self.fields.triangles,
            stress: &peaks.iter().map(|stress| f64::from(*stress)).collect::<Vec<_>>(),
            worst: &self.worst(&peaks),
            along: X_LB - X_LA,
        })
    }

    /// Returns the seats that are judged: those that are not near a tied node.
    fn judged(&self) -> Vec<usize> {
        let clear = NEAR_TIE * self.length;
        (0..self.fields.seats.len()).filter(|k| self.fields.seats[*k].from_tie >= clear).collect()
    }

    /// Returns the worst seats, which are apart from each other.
    fn worst(&self, peaks: &[f32]) -> Vec<usize> {
        let mut order = self.judged();
        order.sort_by(|a, b| peaks[*b].total_cmp(&peaks[*a]));
        let mut worst: Vec<usize> = Vec::new();
        for k in order {
            let p = self.fields.seats[k].position;
            let is_new = |other: &usize| (p - self.fields.seats[*other].position).norm() > APART * self.length;
            if worst.iter().all(is_new) {
                worst.push(k);
            }
            if worst.len() == PLACES {
                break;
            }
        }
        worst
    }

    /// Returns the worst places over the run.
    fn figures(&self, times: &[f64]) -> LinkStressFigures {
        let amplitudes = self.amplitudes();
        let peaks = self.peaks(&amplitudes.select_columns(&self.corners(&amplitudes)));
        let place = |k: usize| {
            let seat = &self.fields.seats[k];
            let history = self.signed_history(k, &amplitudes);
            let sample = (0..history.len()).max_by(|a, b| history[*a].abs().total_cmp(&history[*b].abs()));
            let sample = sample.unwrap_or(0);
            let stress = history[sample].abs();
            let strength = strength_of(&self.fields.materials[seat.material]);
            let damage = |strength: &Strength| strength.curve().damage(&rainflow_repeating(&history)).min(1.0);
            StressPlaceFigures {
                node: seat.node,
                position_m: seat.position.into(),
                t_s: times[sample],
                von_mises_pa: stress,
                of_yield: strength.map(|strength| stress / strength.yield_pa),
                material: strength.map(|strength| strength.name.to_owned()),
                damage: strength.map(damage),
            }
        };
        let worst: Vec<StressPlaceFigures> = self.worst(&peaks).into_iter().map(place).collect();
        LinkStressFigures {
            name: self.name.clone(),
            nodes: peaks.len(),
            left_out: peaks.len() - self.judged().len(),
            clear_of_ties_m: NEAR_TIE * self.length,
            peak_pa: worst.first().map_or(0.0, |place| place.von_mises_pa),
            of_yield: worst.first().and_then(|place| place.of_yield),
            damage: worst.iter().filter_map(|place| place.damage).reduce(f64::max),
            worst,
        }
    }

    /// Returns the von Mises stress of a seat over the run (Pa), with the sign of the principal
    /// stress of the largest magnitude.
    fn signed_history(&self, seat: usize, amplitudes: &DMatrix<f32>) -> Vec<f64> {
        let own = self.map.stress().rows(6 * seat, 6) * amplitudes;
        let signed = own.column_iter().map(|column| {
            let [xx, yy, zz, xy, yz, zx] = [0, 1, 2, 3, 4, 5].map(|c| f64::from(column[c]));
            let principal = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz).symmetric_eigenvalues();
            von_mises([xx, yy, zz, xy, yz, zx]).copysign(principal.max() + principal.min())
        });
        signed.collect()
    }

    /// Returns the samples at the corners of a polyline that is close to the amplitudes.
    ///
    /// The von Mises stress is a convex function of the amplitudes: on a straight line it is nowhere
    /// larger than at both ends. So the samples in between are not needed to find the worst nodes;
    /// the stress is off by [`POLYLINE`] at most.
    fn corners(&self, amplitudes: &DMatrix<f32>) -> Vec<usize> {
        let stress = self.map.stress();
        // Largest stress per unit of each amplitude: bounds the stress of a difference.
        let units = stress.column_iter().map(|column| {
            let seats = column.as_slice().as_chunks::<6>().0;
            seats.iter().map(von_mises_squared).fold(0.0, f32::max).sqrt()
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

    /// Returns the maximum von Mises stress of each seat (Pa).
    fn peaks(&self, amplitudes: &DMatrix<f32>) -> Vec<f32> {
        let stress = self.map.stress();
        let mut peaks = vec![0.0_f32; self.fields.seats.len()];
        let mut product = DMatrix::zeros(6 * SEATS, SAMPLES);
        for (block, peaks) in peaks.chunks_mut(SEATS).enumerate() {
            let own = stress.rows(6 * SEATS * block, 6 * peaks.len());
            for first in (0..amplitudes.ncols()).step_by(SAMPLES) {
                let count = SAMPLES.min(amplitudes.ncols() - first);
                let mut product = product.view_mut((0, 0), (own.nrows(), count));
                product.gemm(1.0, &own, &amplitudes.columns(first, count), 0.0);
                for column in product.column_iter() {
                    let seats = column.as_slice().as_chunks::<6>().0;
                    for (peak, stress) in peaks.iter_mut().zip(seats) {
                        *peak = peak.max(von_mises_squared(stress));
                    }
                }
            }
        }
        peaks.iter_mut().for_each(|square| *square = square.sqrt());
        peaks
    }
}

/// Square of the von Mises stress.
fn von_mises_squared([xx, yy, zz, xy, yz, zx]: &[f32; 6]) -> f32 {
    let (a, b, c) = (xx - yy, yy - zz, zz - xx);
    0.5 * (a * a + b * b + c * c) + 3.0 * (xy * xy + yz * yz + zx * zx)
}

/// Strength of a material.
#[derive(Clone, Copy)]
struct Strength {
    /// Material with its class.
    name: &'static str,
    material: Material,
    /// Yield strength; of grey iron, which does not yield, the tensile strength (Pa).
    yield_pa: f64,
    tensile_pa: f64,
    /// Fatigue strength for reversed stress over the tensile strength.
    fatigue: f64,
}

impl Strength {
    /// S-N curve of parts that are not welded: knee at 1e6 cycles, slope 5 (FKM guideline, 6th
    /// edition, 4.4.3), for a probability of survival of 97.5 %, without surface and size effects.
    fn curve(&self) -> SnCurve {
        SnCurve { amplitude_pa: self.fatigue * self.tensile_pa, cycles: 1e6, slope: 5.0, tensile_pa: self.tensile_pa }
    }
}

fn strength_of(material: &Material) -> Option<&'static Strength> {
    STRENGTHS.iter().find(|strength| strength.material == *material)
}

/// Strengths of the least class that the presets name: EN 10025-2, EN 1999-1-1 (table 3.2b), EN
/// 1561, EN 1563; ratios of fatigue to tensile strength: FKM guideline, table 4.2.1.
static STRENGTHS: [Strength; 4] = [
    Strength { name: "S235", material: Material::STEEL, yield_pa: 235e6, tensile_pa: 360e6, fatigue: 0.45 },
    Strength { name: "EN AW-6082 T6", material: Material::ALUMINIUM, yield_pa: 250e6, tensile_pa: 290e6, fatigue: 0.3 },
    Strength { name: "EN-GJL-250", material: Material::CAST_IRON, yield_pa: 250e6, tensile_pa: 250e6, fatigue: 0.3 },
    Strength {
        name: "EN-GJS-400",
        material: Material::DUCTILE_IRON,
        yield_pa: 250e6,
        tensile_pa: 400e6,
        fatigue: 0.34,
    },
];
