//! Static equilibrium of the elastic coordinates, drives fixed: Newton's method on
//! `K e + g_e(q_a, e) = 0`.
//!
//! K is the stiffness of the springs, `g_e` weight, loads and load-dependent stiffness. Start at
//! [`static_equilibrium`]; [`static_forces`] and [`StaticSlopes`] serve all statics of the crate. Not
//! here: Newton's iteration (`equilibrium`), many poses (`operating_point`).

use flexarm_kinematics::products::{add, cross, lift, tr_mul};
use flexarm_kinematics::{
    Data, Frame, PointLoad, Real, StaticTangent, Twist, Wrench, forward_kinematics, gravity_forces,
    gravity_forces_at_poses,
};
use nalgebra::{DMatrix, DVector};

use crate::equilibrium::{Forces, TOLERANCE, equilibrium};
use crate::error::StepError;
use crate::geometric::add_geometric_forces;
use crate::plant::Plant;

/// Computes the elastic coordinates at which the springs carry gravity and the loads at time `t`
/// (s), n long (m, rad).
///
/// Inertia forces are neglected: the drives are held at the position of the motion at `t`.
///
/// # Errors
/// [`StepError::NoEquilibrium`], [`StepError::Singular`] or [`StepError::OpenLoop`].
pub fn static_equilibrium(plant: &Plant, t: f64) -> Result<DVector<f64>, StepError> {
    let n = plant.model.n_elastic();
    // Start from the equilibrium computed with the modes, which is the solution if nothing has
    // changed since; with nonlinear springs (backlash) start undeformed.
    let straight = plant.elements.iter().all(|element| element.curve.is_none());
    let known = t == 0.0 && straight && plant.modes.equilibrium.len() == n;
    let e = if known { plant.modes.equilibrium.clone() } else { DVector::zeros(n) };
    if n == 0 {
        return Ok(e);
    }
    if let Some(apart) = plant.apart(&joints_at(plant, t)) {
        return Err(apart);
    }
    let mut weight = UnderWeight { plant, data: Data::new(&plant.model), K: plant.stiffness(), t };
    Ok(equilibrium(&mut weight, e)?.e)
}

/// An arm under gravity and its loads at time t, drives held.
struct UnderWeight<'a> {
    plant: &'a Plant,
    data: Data,
    K: DMatrix<f64>,
    t: f64,
}

impl Forces for UnderWeight<'_> {
    fn unbalanced(&mut self, e: &DVector<f64>) -> Result<(DVector<f64>, f64), StepError> {
        let Self { plant, data, t, .. } = self;
        let g = gravity_part(plant, data, *t, e);
        let spring = spring_forces(plant, &joints_at(plant, *t), e);
        let scale = g.amax().max(spring.amax()).max(plant.friction_of_gears());
        StepError::open_loop(&plant.model, data, *t).map_or(Ok((spring + g, scale)), Err)
    }

    fn step(&mut self, e: &DVector<f64>, r: &DVector<f64>, scale: f64) -> Result<DVector<f64>, StepError> {
        let Self { plant, data, K, t } = self;
        let q = joints_at(plant, *t);
        let steep = with_curves(plant, K, &q, e);
        let mut tangent = |K: &DMatrix<f64>| tangent_stiffness(plant, data, *t, e, K).cholesky();
        let factor = tangent(&leave_play(plant, &q, e, r, scale, &steep)).or_else(|| tangent(&steep));
        let singular = StepError::Singular { matrix: "static stiffness (with the effect of weight)", t: *t };
        Ok(to_the_edge(plant, &q, e, factor.ok_or(singular)?.solve(r)))
    }

    fn has_hysteresis(&self) -> bool {
        self.plant.has_hysteresis()
    }

    fn time(&self) -> f64 {
        self.t
    }
}

/// Returns the spring forces over the elastic coordinates, with the joints at `q`.
pub(crate) fn spring_forces(plant: &Plant, q: &[f64], e: &DVector<f64>) -> DVector<f64> {
    let mut f = DVector::zeros(e.len());
    add_spring_forces(plant, q, e.as_slice(), f.as_mut_slice());
    f
}

/// Returns the joint positions at time `t`; empty if no spring depends on them.
fn joints_at(plant: &Plant, t: f64) -> Vec<f64> {
    if plant.transmission.is_empty() && !plant.has_guides() {
        return Vec::new();
    }
    plant.coordinates_at(t, &DVector::zeros(plant.model.n_elastic())).as_slice().to_vec()
}

/// Adds the spring forces, `f += K e` or the curves, over the elastic coordinates, with the joints
/// at `q`.
pub(crate) fn add_spring_forces(plant: &Plant, q: &[f64], e: &[f64], f: &mut [f64]) {
    for (k, element) in plant.elements.iter().enumerate() {
        let range = plant.offset(element)..plant.offset(element) + element.size;
        match element.size {
            1 => element.add_spring_force(&[plant.deflection(k, e[range.start], q)], q, &mut f[range]),
            _ => element.add_spring_force(&e[range.clone()], q, &mut f[range]),
        }
    }
    plant.add_cross_forces(e, f);
}

/// Writes the static forces without springs at `q` into `p`, over all coordinates: weight, the
/// loads at time `t`, a wrench at the tool's origin (world axes) and load-dependent stiffness. Does
/// not allocate.
pub(crate) fn static_forces(
    plant: &Plant,
    tool: Option<(&Frame, &Wrench)>,
    t: f64,
    data: &mut Data,
    q: &DVector<f64>,
    p: &mut DVector<f64>,
) {
    let (model, m) = (&plant.model, plant.model.n_actuated());
    forward_kinematics(model, data, q);
    data.clear_external_wrenches();
    plant.apply_loads(data, t);
    if let Some((tool, F_T_W)) = tool {
        add_wrench(data, tool, F_T_W);
    }
    p.copy_from(gravity_forces_at_poses(model, data, q));
    add_geometric_forces(plant, data, &q.as_slice()[m..], &mut p.as_mut_slice()[m..]);
}

/// Adds a wrench at a frame's origin (world axes) to the external wrench on its body, for the poses
/// in `data.X_WB`.
#[inline(always)]
pub(crate) fn add_wrench<T: Real>(data: &mut Data<T>, at: &Frame, F_W: &Wrench) {
    let R_WB = data.X_WB[at.body].rotation.matrix();
    let (force, moment) = (tr_mul(R_WB, &lift(&F_W.force)), tr_mul(R_WB, &lift(&F_W.torque)));
    let p_B = lift(&at.X_BF.translation.vector);
    data.F_ext[at.body] += Wrench::new(force, add(&moment, &cross(&p_B, &force)));
}

/// Returns weight, loads and load-dependent stiffness over the elastic coordinates.
fn gravity_part(plant: &Plant, data: &mut Data, t: f64, e: &DVector<f64>) -> DVector<f64> {
    let (model, q) = (&plant.model, plant.coordinates_at(t, e));
    if !plant.loads.is_empty() {
        forward_kinematics(model, data, &q);
        plant.apply_loads(data, t);
    }
    let mut g = gravity_forces(model, data, &q).rows(model.n_actuated(), e.len()).clone_owned();
    add_geometric_forces(plant, data, e.as_slice(), g.as_mut_slice());
    g
}

/// Returns the stiffness with the tangent slopes of nonlinear springs; within backlash, where the
/// slope is zero, the steepest slope is used to leave it.
pub(crate) fn with_curves(plant: &Plant, K: &DMatrix<f64>, q: &[f64], e: &DVector<f64>) -> DMatrix<f64> {
    let mut tangent = K.clone();
    for (number, element) in plant.elements.iter().enumerate() {
        if let Some(curve) = &element.curve {
            let k = plant.offset(element);
            tangent[(k, k)] = curve.slope_beyond_play(plant.deflection(number, e[k], q), q);
        }
    }
    tangent
}

/// Works as [`with_curves`] for small motions: friction does not slip, so that sliders act as
/// springs.
pub(crate) fn for_vibration(plant: &Plant, K: &DMatrix<f64>, q: &[f64], e: &DVector<f64>) -> DMatrix<f64> {
    let mut tangent = with_curves(plant, K, q, e);
    for (number, element) in plant.elements.iter().enumerate() {
        if let Some(law) = &element.hysteresis {
            let k = plant.offset(element);
            tangent[(k, k)] = law.stuck_slope(plant.deflection(number, e[k], q));
        }
    }
    tangent
}

/// Distance over which a step of Newton's method leaves a play, divided by that to its edge.
const BEYOND_EDGE: f64 = 1.001;

/// Returns the stiffness K with which Newton's step out of a backlash ends just beyond its edge,
/// however small the unbalanced force r. Forces below the accepted part of `scale` do not count.
pub(crate) fn leave_play(
    plant: &Plant,
    q: &[f64],
    e: &DVector<f64>,
    r: &DVector<f64>,
    scale: f64,
    K: &DMatrix<f64>,
) -> DMatrix<f64> {
    let mut K = K.clone();
    for (number, element) in plant.elements.iter().enumerate() {
        let k = plant.offset(element);
        if let Some(curve) = &element.curve
            && r[k].abs() > TOLERANCE * scale
            && let Some(way) = curve.way_out(plant.deflection(number, e[k], q), -r[k])
        {
            K[(k, k)] = K[(k, k)].min(r[k].abs() / (BEYOND_EDGE * way));
        }
    }
    K
}

/// Returns a step of Newton's method, to be subtracted from `e`, that takes no coordinate out of its
/// play further than just beyond the edge: the force on it there is not that of the step's start if
/// others move too.
pub(crate) fn to_the_edge(plant: &Plant, q: &[f64], e: &DVector<f64>, mut step: DVector<f64>) -> DVector<f64> {
    for (number, element) in plant.elements.iter().enumerate() {
        let k = plant.offset(element);
        if let Some(curve) = &element.curve
            && let Some(way) = curve.way_out(plant.deflection(number, e[k], q), -step[k])
        {
            let most = BEYOND_EDGE * way;
            step[k] = step[k].clamp(-most, most);
        }
    }
    step
}

/// Returns `K + dg/de` under weight and the loads at time `t`, symmetrised.
pub(crate) fn tangent_stiffness(
    plant: &Plant,
    data: &mut Data,
    t: f64,
    e: &DVector<f64>,
    K: &DMatrix<f64>,
) -> DMatrix<f64> {
    let (m, n) = (plant.model.n_actuated(), e.len());
    let mut G = DMatrix::zeros(n, n);
    StaticSlopes::new(plant, m).compute(plant, None, t, data, &plant.coordinates_at(t, e), &mut G);
    K + (&G + G.transpose()) * 0.5
}

/// Step size of the central differences (m, rad).
const DIFFERENCE: f64 = 1e-6;

/// Derivatives of [`static_forces`] with respect to the coordinates, with workspace: in closed
/// form, or by central differences if loads change the stiffness of modal bodies.
#[derive(Clone, Debug)]
pub(crate) struct StaticSlopes {
    /// First coordinate: 0, or that of the first spring.
    first: usize,
    exact: StaticTangent,
    loads: Vec<PointLoad>,
    moved: DVector<f64>,
    up: DVector<f64>,
    down: DVector<f64>,
}

/// Returns a wrench at a frame's origin with constant direction (world axes) as a point load.
pub(crate) fn load_at(frame: &Frame, F_W: &Wrench) -> PointLoad {
    PointLoad { body: frame.body, p_B: frame.X_BF.translation.vector, F_W: *F_W, turns: false }
}

impl StaticSlopes {
    pub(crate) fn new(plant: &Plant, first: usize) -> Self {
        let zeros = DVector::zeros(plant.model.nv());
        Self {
            first,
            exact: StaticTangent::new(&plant.model, first),
            loads: Vec::with_capacity(plant.loads.len() + 1),
            moved: zeros.clone(),
            up: zeros.clone(),
            down: zeros,
        }
    }

    /// Writes the derivatives into `G`, one row and column per coordinate from the first one on;
    /// leaves the poses at `q` in `data`.
    ///
    /// * `tool`: a frame T with the wrench `F_To_W` on it, in world axes.
    pub(crate) fn compute(
        &mut self,
        plant: &Plant,
        tool: Option<(&Frame, &Wrench)>,
        t: f64,
        data: &mut Data,
        q: &DVector<f64>,
        G: &mut DMatrix<f64>,
    ) {
        forward_kinematics(&plant.model, data, q);
        self.compute_at_poses(plant, tool, t, data, q, G);
    }

    /// Works as [`StaticSlopes::compute`] with the poses at `q` already in `data`.
    pub(crate) fn compute_at_poses(
        &mut self,
        plant: &Plant,
        tool: Option<(&Frame, &Wrench)>,
        t: f64,
        data: &mut Data,
        q: &DVector<f64>,
        G: &mut DMatrix<f64>,
    ) {
        if plant.elements.iter().any(|element| element.geometric.is_some()) {
            self.difference(plant, tool, t, data, q, G);
            return forward_kinematics(&plant.model, data, q);
        }
        self.loads.clear();
        self.loads.extend(plant.loads.iter().map(|load| load.point_load(t, &data.X_WB[load.body])));
        self.loads.extend(tool.map(|(tool, F_T_W)| load_at(tool, F_T_W)));
        self.exact.compute(&plant.model, data, q, &self.loads, G);
    }

    /// [`StaticTangent::add_moved_subtree`], after [`StaticSlopes::compute`]; the twist of the moved
    /// body is about the world origin, in world axes.
    pub(crate) fn add_moved_subtree(
        &mut self,
        plant: &Plant,
        data: &Data,
        moved: (usize, &Twist),
        observed: usize,
        p: &mut [f64],
    ) -> Twist {
        self.exact.add_moved_subtree(&plant.model, data, moved, observed, p)
    }

    /// Writes the derivative of the static forces into `G` by central differences.
    fn difference(
        &mut self,
        plant: &Plant,
        tool: Option<(&Frame, &Wrench)>,
        t: f64,
        data: &mut Data,
        q: &DVector<f64>,
        G: &mut DMatrix<f64>,
    ) {
        let Self { first, moved, up, down, .. } = self;
        moved.copy_from(q);
        for (k, mut column) in (*first..q.len()).zip(G.column_iter_mut()) {
            moved[k] = q[k] + DIFFERENCE;
            static_forces(plant, tool, t, data, moved, up);
            moved[k] = q[k] - DIFFERENCE;
            static_forces(plant, tool, t, data, moved, down);
            moved[k] = q[k];
            let slopes = up.iter().zip(down.iter()).skip(*first).map(|(up, down)| (up - down) / (2.0 * DIFFERENCE));
            column.iter_mut().zip(slopes).for_each(|(to, slope)| *to = slope);
        }
    }
}
