//! Tangent matrices of the equations of motion at the current state, and the derivatives of these
//! equations with respect to parameters.

use flexarm_kinematics::{Data, PointLoad, State, StaticTangent};
use nalgebra::{DMatrix, DVector};

use crate::arm::FlexibleArm;
use crate::gear::GearState;
use crate::integrator::Current;
use crate::reduced::ReducedArm;
use crate::run_slopes::forces::ForceTangent;
use crate::run_slopes::gears::GearSlopes;
use crate::run_slopes::{Direction, SpringSlope};

/// Matrices of (1) of the parent module at the current state.
pub(super) struct Tangent {
    dynamic: ForceTangent,
    pub(super) inertia: ForceTangent,
    loads: StaticTangent,
    points: Vec<PointLoad>,
    /// Whether there are loads or balancers.
    loaded: bool,
    /// Workspace for configurations other than the current one.
    pub(super) work: Data,
    /// `∂r/∂q`, `∂r/∂q̇` and M of all coordinates, nv × nv.
    pub(super) by_q: DMatrix<f64>,
    pub(super) by_rate: DMatrix<f64>,
    pub(super) M: DMatrix<f64>,
    G: DMatrix<f64>,
    /// Stiffness about the relaxed springs, over the free coordinates.
    pub(super) K: DMatrix<f64>,
    /// The three matrices with rows and columns of the free coordinates.
    pub(super) own: [DMatrix<f64>; 3],
    /// The three matrices with rows of the free coordinates and columns of the joints; zero for
    /// joints that are free.
    pub(super) by_joints: [DMatrix<f64>; 3],
    /// Tangent of gear effects other than elasticity.
    pub(super) gears: Option<GearSlopes>,
}

/// State of a run at which its equations are differentiated.
pub(super) struct LinearisationPoint<'a> {
    pub(super) arm: &'a FlexibleArm,
    pub(super) data: &'a Data,
    /// Free coordinates and rates.
    pub(super) x: &'a [f64],
    pub(super) v: &'a [f64],
    pub(super) free: &'a [usize],
    /// Rates of the joints.
    pub(super) rates: &'a [f64],
    pub(super) gears: Option<&'a GearState>,
    /// Number of changes of inertia that are over.
    pub(super) changes: usize,
}

impl<'a> LinearisationPoint<'a> {
    /// Returns the state of an integrator at which the system was last evaluated.
    pub(super) fn at(system: &'a ReducedArm, now: &'a Current) -> Self {
        Self {
            arm: &system.arm,
            data: &system.data,
            x: now.x.as_slice(),
            v: now.v.as_slice(),
            free: &system.free,
            rates: system.state.qdot.as_slice(),
            gears: system.gears.as_deref(),
            changes: system.events.changes_over(),
        }
    }
}

impl Tangent {
    pub(super) fn new(arm: &FlexibleArm, directions: usize) -> Self {
        let model = &arm.model;
        let (nv, m, driven, size) = (model.nv(), model.n_actuated(), arm.torque_driven.len(), arm.n_free());
        let square = |n: usize| DMatrix::zeros(n, n);
        let mut K = square(size);
        let n = size - driven;
        K.view_mut((driven, driven), (n, n)).copy_from(&arm.stiffness());
        let dynamic = ForceTangent::new(model);
        Self {
            inertia: ForceTangent::new(model),
            loads: StaticTangent::new(model, 0),
            points: Vec::with_capacity(arm.loads.len()),
            loaded: !dynamic.has_loads() && (!arm.loads.is_empty() || !model.balancers().is_empty()),
            dynamic,
            work: Data::new(model),
            by_q: square(nv),
            by_rate: square(nv),
            M: square(nv),
            G: square(nv),
            K,
            own: std::array::from_fn(|_| square(size)),
            by_joints: std::array::from_fn(|_| DMatrix::zeros(size, m)),
            gears: arm.has_gear_laws().then(|| GearSlopes::new(arm, directions)),
        }
    }

    /// Computes `∂r/∂q` and `∂r/∂q̇` at the motion last evaluated in `data`, with the loads at time
    /// `t`; `gears` must belong to the same motion.
    pub(super) fn compute(
        &mut self,
        arm: &FlexibleArm,
        t: f64,
        data: &Data,
        state: &State,
        qddot: &DVector<f64>,
        gears: Option<&GearState>,
    ) {
        let model = &arm.model;
        let (m, n) = (model.n_actuated(), arm.n_elastic_coordinates());
        self.dynamic.compute(model, (data, state, qddot), Some((arm, t)), &mut self.by_q, &mut self.by_rate);
        if self.loaded {
            self.points.clear();
            self.points.extend(arm.loads.iter().map(|load| load.point_load(t, &data.X_WB[load.body])));
            self.loads.of_loads(model, data, &state.q, &self.points, &mut self.G);
            self.by_q += &self.G;
        }
        if let (Some(slopes), Some(gears)) = (&mut self.gears, gears) {
            return slopes.compute(arm, state, gears, &mut self.by_q, &mut self.by_rate);
        }
        for element in &arm.elements {
            let first = element.coordinate;
            match &element.curve {
                Some(curve) => self.by_q[(first, first)] += curve.slope(state.q[first], state.q.as_slice()),
                None => {
                    let mut block = self.by_q.view_mut((first, first), (element.size, element.size));
                    block += &element.K;
                }
            }
        }
        let mut block = self.by_rate.view_mut((m, m), (n, n));
        block += &arm.D;
        for &k in &arm.torque_driven {
            self.by_rate[(k, k)] += arm.friction.get(k).map_or(0.0, |friction| friction.slope(state.qdot[k]));
        }
    }

    /// Extracts rows and columns of the free coordinates, and with `moves` also the columns of the
    /// joints.
    pub(super) fn gather(&mut self, arm: &FlexibleArm, free: &[usize], moves: bool) {
        let Self { by_q, by_rate, M, own, by_joints, .. } = self;
        for ((from, to), joints) in [&*by_q, by_rate, M].into_iter().zip(own).zip(by_joints) {
            for (j, &column) in free.iter().enumerate() {
                free.iter().enumerate().for_each(|(i, &row)| to[(i, j)] = from[(row, column)]);
            }
            if !moves {
                continue;
            }
            for column in 0..joints.ncols() {
                let prescribed = !arm.torque_driven.contains(&column);
                for (i, &row) in free.iter().enumerate() {
                    joints[(i, column)] = if prescribed { from[(row, column)] } else { 0.0 };
                }
            }
        }
    }

    /// Adds `∂r/∂p` of a direction to `to` (free coordinates) at the motion of
    /// [`Tangent::compute`], without the contributions of joint motion and controllers.
    pub(super) fn add_explicit(
        &mut self,
        at: &LinearisationPoint<'_>,
        (number, direction): (usize, &Direction),
        room: &mut DVector<f64>,
        to: &mut [f64],
    ) {
        let arm = at.arm;
        let driven = arm.torque_driven.len();
        if let (Some(slopes), Some(gears)) = (&self.gears, at.gears) {
            slopes.add_explicit(at, gears, (number, direction), room, to);
        } else {
            let (x, v) = (&at.x[driven..], &at.v[driven..]);
            add_springs(arm, direction, None, x, &mut to[driven..]);
            if let Some(dD) = direction.damping_after(at.changes) {
                add_columns(dD, v, &mut to[driven..]);
            }
            for (coordinate, by) in &direction.friction {
                if let (Some(i), Some(friction)) = (place(arm, *coordinate), arm.friction.get(*coordinate)) {
                    to[i] += friction.change(at.v[i], by);
                }
            }
        }
        if !direction.inertias.is_empty() {
            room.fill(0.0);
            for (body, more) in direction.inertias_after(arm, at.changes) {
                self.dynamic.add_inertia_forces(&arm.model, at.data, body, more, room.as_mut_slice());
            }
            to.iter_mut().zip(at.free).for_each(|(to, k)| *to += room[*k]);
        }
    }
}

/// Returns the index of a coordinate among those driven by torque.
pub(super) fn place(arm: &FlexibleArm, coordinate: usize) -> Option<usize> {
    arm.torque_driven.iter().position(|k| *k == coordinate)
}

/// Adds the forces due to changes of springs at the deflections x, over the elastic coordinates.
pub(super) fn add_springs(
    arm: &FlexibleArm,
    direction: &Direction,
    gears: Option<&GearState>,
    x: &[f64],
    to: &mut [f64],
) {
    if let Some(dK) = &direction.stiffness {
        add_columns(dK, x, to);
    }
    for (number, slope) in &direction.springs {
        let element = &arm.elements[*number];
        let range = arm.offset(element)..arm.offset(element) + element.size;
        match (&element.curve, slope) {
            (Some(curve), SpringSlope::Factor(factor)) => {
                let with_past = gears.and_then(|gears| gears.hysteresis_torque(arm, *number));
                to[range.start] += factor * with_past.unwrap_or_else(|| curve.torque(x[range.start], &[]));
            }
            _ => slope.add_linear(&element.K, &x[range.clone()], &mut to[range]),
        }
    }
}

impl SpringSlope {
    /// Adds its share of `δK x`.
    pub(super) fn add_linear(&self, K: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
        let (matrix, factor) = match self {
            Self::Factor(factor) => (K, *factor),
            Self::Matrix(dK) => (dK, 1.0),
        };
        for (column, x) in matrix.as_slice().chunks_exact(matrix.nrows()).zip(x) {
            to.iter_mut().zip(column).for_each(|(to, k)| *to += factor * k * x);
        }
    }
}

/// Computes `to += A x` for a square A.
pub(super) fn add_columns(A: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
    for (column, x) in A.as_slice().chunks_exact(A.nrows()).zip(x).filter(|(_, x)| **x != 0.0) {
        to.iter_mut().zip(column).for_each(|(to, a)| *to += a * x);
    }
}

/// Copies the values of a direction into its row.
pub(super) fn put(from: &[f64], to: &mut DMatrix<f64>, row: usize) {
    from.iter().enumerate().for_each(|(i, x)| to[(row, i)] = *x);
}
