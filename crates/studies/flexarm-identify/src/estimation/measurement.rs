//! Residuals: readings predicted by an arm with given parameters against measured ones.
//!
//! Start at [`MeasuredArm`]. Each reading gives rows, predicted minus measured, and their derivatives with
//! respect to the parameters and to the unknowns of the measurement (pose of the instrument, position of
//! the target). Readings under one load share an operating point ([`Workspaces`]).
//!
//! Frames: W world, T tool, I instrument, F frame of a target; vectors in world axes unless named.
//! Not here: derivatives of the arm itself ([`super::sensitivity`], [`super::response`]).

use std::borrow::Cow;

use flexarm_kinematics::{ElasticAngles, Frame, Pose, SpatialInertia, Wrench, rotation_vector};
use flexarm_stepping::{OperatingPoint, StepError};
use nalgebra::{
    DMatrix, DVector, Matrix3, Matrix3xX, Matrix6xX, Rotation3, RowDVector, Translation3, Vector3, Vector6,
};

use crate::estimation::least_squares::Residuals;
use crate::estimation::parameter::{
    Effect, NominalArm, Parameter, carried_along, displacement, link_change, tool_shift,
};
use crate::estimation::reading::{
    Component, LoadCase, MeasuredResponse, MeasuredShape, Measurements, Reading, ReadingKind, Row,
};
use crate::estimation::response::structure_slopes;
use crate::estimation::sensitivity::{frequency_slopes, slopes_at_rest, with_deflection};

/// An arm with unknown parameters and the measurements made on it.
pub struct MeasuredArm<'a> {
    /// Nominal arm.
    pub nominal: &'a NominalArm,
    /// Unknown parameters.
    pub parameters: &'a [Parameter],
    /// Measurements.
    pub measurements: &'a Measurements,
}

/// Error: the arm has no solution for a reading.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reading}: {source}")]
pub struct NoAnswer {
    /// Name of the reading.
    pub reading: String,
    /// Cause.
    pub source: StepError,
}

/// Up to a few predicted numbers and their derivatives: rows by unknowns.
struct Block {
    values: Vec<f64>,
    slopes: DMatrix<f64>,
}

/// Frame at rest at a pose, and its derivatives with respect to the parameters.
struct AtRest {
    X_WF: Pose,
    /// Twists (world axes, at the frame's origin).
    slopes: Option<Matrix6xX<f64>>,
}

impl AtRest {
    /// Returns a point of the frame in the world.
    fn point(&self, p_F: &Vector3<f64>) -> Vector3<f64> {
        self.X_WF.translation.vector + self.X_WF.rotation * p_F
    }

    /// Returns the angular velocities, world axes.
    fn turns(&self) -> Option<Matrix3xX<f64>> {
        self.slopes.as_ref().map(|slopes| slopes.fixed_rows::<3>(3).into_owned())
    }

    /// Returns the velocities of a point of the frame, `v + w × R p_F`.
    fn point_slopes(&self, p_F: &Vector3<f64>) -> Option<Matrix3xX<f64>> {
        let p_W = self.X_WF.rotation * p_F;
        let (slopes, turns) = (self.slopes.as_ref()?, self.turns()?);
        let mut velocities = slopes.fixed_rows::<3>(0).into_owned();
        for (mut v, w) in velocities.column_iter_mut().zip(turns.column_iter()) {
            v += w.cross(&p_W);
        }
        Some(velocities)
    }
}

/// Operating point under a load, the parameters there, and the pose and wrench for which it was
/// solved last.
struct Workspace<'a> {
    at: Vector3<f64>,
    carried: SpatialInertia,
    point: OperatingPoint,
    parameters: Cow<'a, [Parameter]>,
    solved: Option<(Vec<f64>, Wrench)>,
}

/// Operating points of the loads met so far.
struct Workspaces<'a> {
    nominal: NominalArm,
    parameters: &'a [Parameter],
    /// Coordinates of the parameters.
    x: Vec<f64>,
    known: Vec<Workspace<'a>>,
}

impl<'a> Workspaces<'a> {
    /// Returns the operating point at a pose under a load.
    fn solved(&mut self, q: &[f64], load: &LoadCase) -> Result<&mut Workspace<'a>, StepError> {
        let known =
            self.known.iter().position(|workspace| workspace.at == load.at && workspace.carried == load.carried);
        let number = match known {
            Some(number) => number,
            None => {
                let tool = &self.nominal.tool;
                let X = Pose::from_parts(Translation3::from(load.at), Rotation3::identity());
                let frame = Frame { name: tool.name.clone(), body: tool.body, X_BF: tool.X_BF * X };
                let point = OperatingPoint::new(self.loaded(&load.carried).at_rest(q)?, frame);
                let parameters = self.under(&load.carried);
                self.known.push(Workspace { at: load.at, carried: load.carried, point, parameters, solved: None });
                self.known.len() - 1
            }
        };
        let workspace = &mut self.known[number];
        if !workspace.solved.as_ref().is_some_and(|(at, wrench)| at == q && *wrench == load.wrench) {
            workspace.solved = None;
            workspace.point.solve(q, &load.wrench)?;
            workspace.solved = Some((q.to_vec(), load.wrench));
        }
        Ok(workspace)
    }

    /// Solves for a frame at rest at a pose under a load; `None` for the tool.
    fn at_rest(
        &mut self,
        q: &[f64],
        load: &LoadCase,
        frame: Option<&Frame>,
        slopes: bool,
    ) -> Result<AtRest, StepError> {
        let own = frame.cloned().unwrap_or_else(|| self.nominal.tool.clone());
        let turn = tool_shift(self.parameters, &self.x).1;
        let all = self.parameters;
        let Workspace { point: at, parameters, .. } = self.solved(q, load)?;
        let X_WF = at.pose_of(&own);
        if !slopes {
            return Ok(AtRest { X_WF, slopes: None });
        }
        let (mut forces, mut twists) = slopes_at_rest(at, parameters, &own);
        let R_WT = at.tcp_pose().rotation;
        let J = at.jacobian().columns_range(at.plant().model.n_actuated()..).into_owned();
        for (k, [v, w]) in tool_twists(all, &R_WT, &turn) {
            // The applied force moves with the tool, which changes its moment.
            let moment = (v + w.cross(&(R_WT * load.at))).cross(&load.wrench.force);
            forces.column_mut(k).gemv_tr(-1.0, &J.fixed_rows::<3>(3), &moment, 1.0);
            if frame.is_none() {
                twists.set_column(k, &Vector6::from_iterator(v.iter().chain(&w).copied()));
            }
        }
        Ok(AtRest { X_WF, slopes: Some(with_deflection(at, &own, &forces, twists)) })
    }

    /// Returns the parameters for an arm that carries a mass at its tool: moving the tool also
    /// moves that mass. Twists of joint frames are in the axes after all displacements; masses and
    /// centres of mass of links are linearised at their present values.
    fn under(&self, carried: &SpatialInertia) -> Cow<'a, [Parameter]> {
        // The parameters serve as they are if none depends on the values of others or on the load.
        let depends = |p: &Parameter| matches!(p.effect, Effect::Tool(_) | Effect::Frame { .. } | Effect::Link { .. });
        if !self.parameters.iter().any(depends) {
            return Cow::Borrowed(self.parameters);
        }
        let (body, X_BF) = (self.nominal.tool.body, self.nominal.tool.X_BF);
        let I = carried.at_parent(&X_BF);
        let mut all = self.parameters.to_vec();
        for (k, [v, w]) in tool_twists(self.parameters, &X_BF.rotation, &tool_shift(self.parameters, &self.x).1) {
            let per_kg = carried_along(&I, &X_BF.translation.vector, &v, &w);
            all[k].effect = Effect::Mass(vec![(body, per_kg)]);
        }
        for (own, old) in all.iter_mut().zip(self.parameters) {
            if let Effect::Link { parts, .. } = &old.effect {
                let (factor, shift) = link_change(self.parameters, &self.x, parts);
                own.effect = Effect::Mass(old.effect.inertia_rates(factor, &shift));
            }
        }
        for k in 0..all.len() {
            let (before, after) = all.split_at_mut(k);
            let (Effect::Frame { body, twist, .. }, Some(x)) = (&after[0].effect, self.x.get(k)) else { continue };
            // Earlier displacements of the same frame are followed by this one.
            let X = displacement(&(twist * *x));
            for other in before {
                if let Effect::Frame { body: own, twist, .. } = &mut other.effect
                    && own == body
                {
                    let [v, w]: [Vector3<f64>; 2] = [0, 3].map(|first| twist.fixed_rows::<3>(first).into_owned());
                    let back = X.rotation.inverse();
                    let [v, w] = [back * (v + w.cross(&X.translation.vector)), back * w];
                    *twist = Vector6::from_iterator(v.iter().chain(&w).copied());
                }
            }
        }
        Cow::Owned(all)
    }

    /// Returns the arm that carries a load's mass, and its parameters, none without derivatives.
    fn vibrating(&self, load: &LoadCase, slopes: bool) -> (NominalArm, Cow<'a, [Parameter]>) {
        let parameters = if slopes { self.under(&load.carried) } else { Cow::Borrowed(&[][..]) };
        (self.loaded(&load.carried), parameters)
    }

    /// Returns the arm with a mass at its tool; inertia about the tool's origin, tool axes.
    fn loaded(&self, carried: &SpatialInertia) -> NominalArm {
        let tool = &self.nominal.tool;
        self.nominal.carrying(tool.body, &carried.at_parent(&tool.X_BF))
    }
}

impl MeasuredArm<'_> {
    /// Returns the predicted numbers of all readings in their own units, reading after reading.
    ///
    /// # Errors
    /// [`NoAnswer`] if the arm has no solution for a reading.
    pub fn predicted(&self, unknowns: &DVector<f64>) -> Result<Vec<f64>, NoAnswer> {
        let mut workspaces = self.workspaces(unknowns);
        let own = &unknowns.as_slice()[self.parameters.len()..];
        let mut values = Vec::new();
        for reading in &self.measurements.readings {
            values.extend(self.block(&mut workspaces, reading, own, false)?.values);
        }
        Ok(values)
    }

    /// Returns the measured numbers in the order of [`Self::predicted`].
    pub fn observed(&self) -> Vec<f64> {
        let values_of = |reading: &Reading| -> Vec<f64> {
            match &reading.kind {
                ReadingKind::Displacement { rows, .. } => rows.iter().map(|row| row.value).collect(),
                ReadingKind::Place { rows, .. } | ReadingKind::Frequencies { rows, .. } => {
                    rows.iter().map(|row| row.value).collect()
                }
                ReadingKind::Known { value, .. } => vec![*value],
                ReadingKind::TargetAt { value, .. } => value.iter().copied().collect(),
                ReadingKind::InstrumentAt { value, std, .. } => {
                    let place =
                        std.map_or(Vec::new(), |_| value.inverse().translation.vector.iter().copied().collect());
                    place.into_iter().chain([0.0; 3]).collect()
                }
                ReadingKind::Response(response) => {
                    (0..response.points.len()).flat_map(|k| response.numbers(k, response.points[k].1)).collect()
                }
                ReadingKind::Shape(shape) => shape.unit().iter().copied().collect(),
            }
        };
        self.measurements.readings.iter().flat_map(values_of).collect()
    }

    /// Returns, for each measured mode shape, the number of its reading, the index of the most
    /// similar mode of the arm, and their modal assurance criterion (0 to 1).
    ///
    /// # Errors
    /// [`NoAnswer`] if the arm has no solution for a reading.
    pub fn assurances(&self, unknowns: &DVector<f64>) -> Result<Vec<(usize, usize, f64)>, NoAnswer> {
        let workspaces = self.workspaces(unknowns);
        let mut all = Vec::new();
        for (number, reading) in self.measurements.readings.iter().enumerate() {
            let ReadingKind::Shape(shape) = &reading.kind else { continue };
            let nominal = workspaces.loaded(&shape.load.carried);
            let found = structure_slopes(&nominal, &[], &reading.q, &shape.probes);
            let found = found.map_err(|source| NoAnswer { reading: reading.name.clone(), source })?;
            all.extend(shape.likeliest(&found).map(|(mode, assurance, _)| (number, mode, assurance)));
        }
        Ok(all)
    }

    /// Returns the readings with their first rows, those of one pose one after another, which share
    /// its equilibrium.
    fn by_pose(&self) -> Vec<(&Reading, usize)> {
        let mut row = 0;
        let placed = self.measurements.readings.iter().map(|reading| {
            row += reading.rows();
            (reading, row - reading.rows())
        });
        let mut all: Vec<(&Reading, usize)> = placed.collect();
        all.sort_by(|a, b| a.0.q.partial_cmp(&b.0.q).unwrap_or(std::cmp::Ordering::Equal));
        all
    }

    /// Returns the arm at the values of the parameters, without operating points.
    fn workspaces(&self, unknowns: &DVector<f64>) -> Workspaces<'_> {
        let x = unknowns.as_slice()[..self.parameters.len()].to_vec();
        Workspaces {
            nominal: self.nominal.with(self.parameters, &x),
            parameters: self.parameters,
            x,
            known: Vec::new(),
        }
    }

    /// Predicts the numbers of a reading, and their derivatives with respect to all unknowns if
    /// `slopes`.
    fn block(
        &self,
        workspaces: &mut Workspaces<'_>,
        reading: &Reading,
        own: &[f64],
        slopes: bool,
    ) -> Result<Block, NoAnswer> {
        let named = |source| NoAnswer { reading: reading.name.clone(), source };
        match &reading.kind {
            ReadingKind::Displacement { before, after, point, rows } => {
                self.displacement(workspaces, &reading.q, [before, after], point, rows, own, slopes).map_err(named)
            }
            ReadingKind::Place { load, target, instrument, rows } => {
                let link = self.measurements.links.get(*target).and_then(Option::as_ref);
                let at = workspaces.at_rest(&reading.q, load, link, slopes).map_err(named)?;
                let whole = self.place(&at, *target, *instrument, own);
                let axes: Vec<usize> = rows.iter().map(|row| row.of).collect();
                let values = axes.iter().map(|axis| whole.values[*axis]).collect();
                Ok(Block { values, slopes: whole.slopes.select_rows(&axes) })
            }
            ReadingKind::Known { parameter, .. } => {
                // A parameter that is not fitted stays at zero.
                let number = self.parameters.iter().position(|p| p.name == *parameter);
                let value = number.map_or(0.0, |k| workspaces.x[k]);
                let columns = if slopes { self.parameters.len() + own.len() } else { 0 };
                let slope = |_, j: usize| f64::from(u8::from(Some(j) == number));
                Ok(Block { values: vec![value], slopes: DMatrix::from_fn(1, columns, slope) })
            }
            ReadingKind::TargetAt { target, .. } => {
                let (p_T, first) = self.measurements.target(*target, own);
                let column = |i: usize| first.map(|first| first + i);
                let slopes = self.of_own(3, own.len(), slopes, |i, j| f64::from(u8::from(column(i) == Some(j))));
                Ok(Block { values: p_T.iter().copied().collect(), slopes })
            }
            ReadingKind::InstrumentAt { instrument, value, std, .. } => {
                Ok(self.instrument_at(*instrument, value, std.is_some(), own, slopes))
            }
            ReadingKind::Frequencies { load, rows } => {
                let (nominal, parameters) = workspaces.vibrating(load, slopes);
                let found = frequency_slopes(&nominal, &parameters, &reading.q).map_err(named)?;
                let values = rows.iter().map(|row| found.hz.get(row.of).copied().unwrap_or(f64::NAN)).collect();
                let slopes = self.with_own(rows.len(), own.len(), slopes, |i, j| found.slopes[(rows[i].of, j)]);
                Ok(Block { values, slopes })
            }
            ReadingKind::Response(measured) => {
                self.response(workspaces, &reading.q, measured, own.len(), slopes).map_err(named)
            }
            ReadingKind::Shape(measured) => {
                self.shape(workspaces, &reading.q, measured, own.len(), slopes).map_err(named)
            }
        }
    }

    /// Pads derivatives with respect to the parameters with zeros for the unknowns of the
    /// measurements.
    fn with_own(&self, rows: usize, own: usize, slopes: bool, slope: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let p = self.parameters.len();
        let columns = if slopes { p + own } else { 0 };
        DMatrix::from_fn(rows, columns, |i, j| if j < p { slope(i, j) } else { 0.0 })
    }

    /// Pads derivatives with respect to the unknowns of the measurements with zeros for the
    /// parameters.
    fn of_own(&self, rows: usize, own: usize, slopes: bool, slope: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let p = self.parameters.len();
        let columns = if slopes { p + own } else { 0 };
        DMatrix::from_fn(rows, columns, |i, j| if j < p { 0.0 } else { slope(i, j - p) })
    }

    /// Predicts prior knowledge of an instrument: its position in the world if `placed`, and the rotation
    /// vector φ, in its axes, by which it is turned from the given pose `X`.
    ///
    /// ```text
    /// R_IW Rᵀ = exp(φ),   dφ = J_l(φ)^-1 w,   dp_WI = R_WI (w × p_IW - dp_IW)
    /// ```
    /// with the angular velocity w in instrument axes per unknown of the rotation.
    fn instrument_at(&self, number: usize, X: &Pose, placed: bool, own: &[f64], slopes: bool) -> Block {
        let (X_IW, place, turn) = self.measurements.instrument(number, own);
        let X_WI = X_IW.inverse();
        // Values: p_WI if the instrument is placed, then φ.
        let phi = rotation_vector((X_IW.rotation * X.rotation.inverse()).matrix());
        let p_WI = placed.then_some(X_WI.translation.vector);
        let values: Vec<f64> = p_WI.iter().flatten().chain(&phi).copied().collect();
        let mut by_own = DMatrix::zeros(values.len(), own.len());
        let rows = values.len() - 3;
        // Derivatives with respect to the rotation: of φ, and of p_WI.
        if let Some(first) = turn {
            let rates = left_jacobian(&vector_at(own, first));
            let back = left_jacobian(&phi).try_inverse().unwrap_or_else(Matrix3::identity);
            for k in 0..3 {
                let w: Vector3<f64> = rates.column(k).into_owned();
                by_own.view_mut((rows, first + k), (3, 1)).copy_from(&(back * w));
                if placed {
                    let moved = X_WI.rotation * w.cross(&X_IW.translation.vector);
                    by_own.view_mut((0, first + k), (3, 1)).copy_from(&moved);
                }
            }
        }
        // Derivatives with respect to the position.
        if let (Some(first), true) = (place, placed) {
            by_own.view_mut((0, first), (3, 3)).copy_from(&(-X_WI.rotation.matrix()));
        }
        let slopes = self.of_own(values.len(), own.len(), slopes, |i, j| by_own[(i, j)]);
        Block { values, slopes }
    }

    /// Predicts the numbers of a frequency response.
    fn response(
        &self,
        workspaces: &Workspaces<'_>,
        q: &[f64],
        measured: &MeasuredResponse,
        own: usize,
        slopes: bool,
    ) -> Result<Block, StepError> {
        let (nominal, parameters) = workspaces.vibrating(&measured.load, slopes);
        let probes = [measured.watched.clone(), measured.hit.clone()];
        let omega: Vec<f64> = measured.points.iter().map(|(omega, ..)| *omega).collect();
        let found = structure_slopes(&nominal, &parameters, q, &probes)?.response(0, 1, measured.answer, &omega)?;
        let values = found.values.iter().enumerate().flat_map(|(k, value)| measured.numbers(k, *value)).collect();
        let slope = |i: usize, j: usize| {
            let k = i / 2;
            measured.number_slopes(found.values[k], found.slopes[(k, j)])[i % 2]
        };
        Ok(Block { values, slopes: self.with_own(2 * omega.len(), own, slopes, slope) })
    }

    /// Predicts the amplitudes of the most similar mode, normalised to length 1.
    fn shape(
        &self,
        workspaces: &Workspaces<'_>,
        q: &[f64],
        measured: &MeasuredShape,
        own: usize,
        slopes: bool,
    ) -> Result<Block, StepError> {
        let (nominal, parameters) = workspaces.vibrating(&measured.load, slopes);
        let found = structure_slopes(&nominal, &parameters, q, &measured.probes)?;
        let none = || StepError::Singular { matrix: "mode shapes at the measured points (they do not move)", t: 0.0 };
        let (mode, _, unit) = measured.likeliest(&found).ok_or_else(none)?;
        let amplitudes = |rows: &[RowDVector<f64>], shape: &DVector<f64>| {
            DVector::from_iterator(rows.len(), rows.iter().map(|row| (row * shape)[0]))
        };
        let phi = found.shapes.column(mode).into_owned();
        let a = amplitudes(&found.structure.rows, &phi);
        let sign = a.dot(&unit).signum();
        // d(a/|a|) = (1 - u uᵀ) da / |a|: only the part normal to the unit vector u counts.
        let changes: Vec<DVector<f64>> = found
            .shape_slopes(mode)
            .iter()
            .zip(&found.slopes)
            .map(|(dphi, slope)| {
                let da = amplitudes(&found.structure.rows, dphi) + amplitudes(&slope.rows, &phi);
                let change = da * (sign / a.norm());
                &change - &unit * unit.dot(&change)
            })
            .collect();
        let slopes = self.with_own(unit.len(), own, slopes, |i, j| changes[j][i]);
        Ok(Block { values: unit.iter().copied().collect(), slopes })
    }

    /// Predicts the position of a target in the axes of an instrument, `p_I = X_IW p_W`.
    fn place(&self, at: &AtRest, target: usize, instrument: usize, own: &[f64]) -> Block {
        let p = self.parameters.len();
        let (X_IW, place, turn) = self.measurements.instrument(instrument, own);
        let (p_T, three) = self.measurements.target(target, own);
        let turned_I = X_IW.rotation * at.point(&p_T);
        let values = (turned_I + X_IW.translation.vector).iter().copied().collect();
        let Some(moved) = at.point_slopes(&p_T) else { return Block { values, slopes: DMatrix::zeros(3, 0) } };
        let mut slopes = DMatrix::zeros(3, p + own.len());
        slopes.columns_mut(0, p).copy_from(&(X_IW.rotation * moved));
        if let Some(first) = place {
            slopes.view_mut((0, p + first), (3, 3)).fill_with_identity();
        }
        if let Some(first) = turn {
            // The unknowns are increments of a rotation vector; the left Jacobian maps their rates
            // to the angular velocity.
            let rates = left_jacobian(&vector_at(own, first));
            for k in 0..3 {
                slopes.view_mut((0, p + first + k), (3, 1)).copy_from(&rates.column(k).cross(&turned_I));
            }
        }
        if let Some(first) = three {
            slopes.view_mut((0, p + first), (3, 3)).copy_from(&(X_IW.rotation * at.X_WF.rotation).into_inner());
        }
        Block { values, slopes }
    }
}

/// Returns the velocity at the tool's origin and the angular velocity per unit of each parameter
/// that moves the tool, with the index of the parameter.
///
/// * `R`: present rotation of the tool in the axes of the result.
/// * `turn`: rotation vector of the part of `R` that the parameters contribute.
fn tool_twists<'a>(
    parameters: &'a [Parameter],
    R: &Rotation3<f64>,
    turn: &Vector3<f64>,
) -> impl Iterator<Item = (usize, [Vector3<f64>; 2])> + use<'a> {
    let before = R * Rotation3::new(*turn).inverse();
    let rates = before * left_jacobian(turn);
    parameters.iter().enumerate().filter_map(move |(k, parameter)| match parameter.effect {
        Effect::Tool(axis @ 0..3) => Some((k, [before * Vector3::ith(axis, 1.0), Vector3::zeros()])),
        Effect::Tool(axis) => Some((k, [Vector3::zeros(), rates.column(axis - 3).into_owned()])),
        _ => None,
    })
}

/// Returns the left Jacobian of a rotation vector: angular velocity (fixed axes) per rate of the
/// vector.
fn left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    ElasticAngles::RotationVector.pose(v).1.transpose()
}

impl MeasuredArm<'_> {
    /// Predicts components of the displacement of a point of the tool between two loads.
    ///
    /// ```text
    /// u = p(after) - p(before),   R = R_after R_beforeᵀ = exp(φ)          value = dᵀ u or dᵀ φ
    /// du = v_a - v_b,             dφ = J_l(φ)^-1 (w_a - R w_b)
    /// ```
    /// * `p_T`: the point, tool axes (m).
    #[expect(clippy::too_many_arguments, reason = "what a displacement is made of")]
    fn displacement(
        &self,
        workspaces: &mut Workspaces<'_>,
        q: &[f64],
        [before, after]: [&LoadCase; 2],
        p_T: &Vector3<f64>,
        rows: &[Row<Component>],
        own: &[f64],
        slopes: bool,
    ) -> Result<Block, StepError> {
        let before = workspaces.at_rest(q, before, None, slopes)?;
        let after = workspaces.at_rest(q, after, None, slopes)?;
        let u = after.point(p_T) - before.point(p_T);
        let R = after.X_WF.rotation * before.X_WF.rotation.inverse();
        let phi = rotation_vector(R.matrix());
        // Directions in an instrument's axes are rotated into the world.
        let instrument = |row: &Row<Component>| row.of.instrument.map(|k| self.measurements.instrument(k, own));
        let world = |row: &Row<Component>| {
            instrument(row).map_or(row.of.direction, |(X_IW, ..)| X_IW.rotation.inverse() * row.of.direction)
        };
        let values = rows.iter().map(|row| world(row).dot(if row.of.rotation { &phi } else { &u })).collect();
        let (Some(v_a), Some(v_b), Some(w_a), Some(w_b)) =
            (after.point_slopes(p_T), before.point_slopes(p_T), after.turns(), before.turns())
        else {
            return Ok(Block { values, slopes: DMatrix::zeros(rows.len(), 0) });
        };
        let rate = left_jacobian(&phi).try_inverse().unwrap_or_else(Matrix3::identity);
        let p = v_a.ncols();
        let mut all = DMatrix::zeros(rows.len(), p + own.len());
        for (i, row) in rows.iter().enumerate() {
            let d = world(row);
            for k in 0..p {
                all[(i, k)] = match row.of.rotation {
                    false => d.dot(&(v_a.column(k) - v_b.column(k))),
                    true => d.dot(&(rate * (w_a.column(k) - R * w_b.column(k)))),
                };
            }
            // An instrument that turns sees the same vector in other axes.
            let Some((X_IW, _, Some(first))) = instrument(row) else { continue };
            let vector_I = X_IW.rotation * if row.of.rotation { phi } else { u };
            let rates = left_jacobian(&vector_at(own, first));
            for k in 0..3 {
                all[(i, p + first + k)] = row.of.direction.dot(&rates.column(k).cross(&vector_I));
            }
        }
        Ok(Block { values, slopes: all })
    }
}

/// Returns three unknowns as a vector.
fn vector_at(own: &[f64], first: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&own[first..first + 3])
}

impl Residuals for MeasuredArm<'_> {
    type Error = NoAnswer;

    fn evaluate(&self, unknowns: &DVector<f64>, J: Option<&mut DMatrix<f64>>) -> Result<DVector<f64>, NoAnswer> {
        let own = &unknowns.as_slice()[self.parameters.len()..];
        let mut workspaces = self.workspaces(unknowns);
        let m = self.measurements.rows();
        let mut residuals = DVector::zeros(m);
        let observed = self.observed();
        let slopes = J.is_some();
        let mut all = DMatrix::zeros(if slopes { m } else { 0 }, unknowns.len());
        // Reading after reading of one pose, each into its rows.
        for (reading, first) in self.by_pose() {
            let block = self.block(&mut workspaces, reading, own, slopes)?;
            // Derivatives do not exist at a dead point of a loop.
            if let (Some(dead), false) =
                (self.nominal.model.loops().first(), block.slopes.iter().all(|x| x.is_finite()))
            {
                let source = StepError::OpenLoop { t: 0.0, name: dead.name.clone() };
                return Err(NoAnswer { reading: reading.name.clone(), source });
            }
            for (i, value) in block.values.iter().enumerate() {
                residuals[first + i] = value - observed[first + i];
            }
            if slopes {
                all.rows_mut(first, block.values.len()).copy_from(&block.slopes);
            }
        }
        if let Some(J) = J {
            *J = all;
        }
        Ok(residuals)
    }
}
