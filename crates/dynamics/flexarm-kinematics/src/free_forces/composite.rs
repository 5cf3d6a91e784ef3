//! Mass matrix of the free coordinates by composite rigid bodies, O(n × depth).
//!
//! ```text
//!   F_k  = I_k S_k     wrench at Bo that gives joint k with its subtree a unit acceleration   (10)
//!   M_ik = S_iᵀ F_k    for all k outward of i, F_k carried to the origin of body i            (11)
//! ```
//! All quantities are in the axes of the first loading body, so that carrying a wrench inward
//! changes only its moment. Columns are processed in threes, component by component: the
//! translations or the rotations of an elastic joint, or up to three successive single-DoF joints.
//!
//! Source: [Featherstone 2008], section 6.2.

use std::ops::Range;

use flexarm_spatial::Real;
use flexarm_spatial::products::{
    add, add3, column, columns, cross, dot, dyad, lift, mul, mul3, scaled, sub, tr_mul3, transposed, turn_symmetric,
};
use nalgebra::{Matrix3, Vector3};

use super::node::{Node, NodeJoint};
use super::{FreeForces, Part};

/// Workspace of the mass matrix.
#[derive(Clone, Debug)]
pub(super) struct Composites<T: Real> {
    /// Composite bodies, one per node.
    bodies: Vec<Composite<T>>,
    /// Wrenches carried inward, up to three columns each.
    groups: Vec<ColumnGroup<T>>,
    /// Whether some pairs of coordinates contribute nothing, or more than once.
    sums: bool,
}

/// Body with everything outward of it, in the common axes.
#[derive(Clone, Debug)]
struct Composite<T: Real> {
    mass: T,
    /// First moment and inertia about Bo.
    h: Vector3<T>,
    I: Matrix3<T>,
    /// Rotation from body axes to the common axes.
    R: Matrix3<T>,
    /// Position of Bo relative to the parent's origin.
    r: Vector3<T>,
    /// Parent, if it is a loading body.
    parent: Option<usize>,
    /// First column of its joint, if the joint is free.
    own: Option<ColumnIndex>,
    /// Groups of columns in its subtree.
    groups: Range<usize>,
}

/// Location of a column: group and lane.
#[derive(Clone, Copy, Debug)]
struct ColumnIndex {
    group: usize,
    lane: usize,
}

/// Wrenches of up to three columns with successive rows in M.
#[derive(Clone, Debug)]
struct ColumnGroup<T: Real> {
    row: usize,
    count: usize,
    /// `Fᵀ`: one row per wrench, one column per component.
    force: Matrix3<T>,
    torque: Matrix3<T>,
}

/// Allocates columns for a joint. A single-DoF joint shares the group of the next free joint
/// inward, if that group is the last one, ends with that joint and has room.
#[inline(always)]
fn place_columns<T: Real>(
    groups: &mut Vec<ColumnGroup<T>>,
    inner: Option<ColumnIndex>,
    row: usize,
    size: usize,
) -> ColumnIndex {
    if let (Some(inner), Some(last), 1) = (inner, groups.len().checked_sub(1), size)
        && inner.group == last
        && inner.lane + 1 == groups[last].count
        && groups[last].count < 3
        && groups[last].row + groups[last].count == row
    {
        groups[last].count += 1;
        return ColumnIndex { lane: inner.lane + 1, ..inner };
    }
    let first = ColumnIndex { group: groups.len(), lane: 0 };
    for row in (row..row + size).step_by(3) {
        groups.push(ColumnGroup { row, count: size.min(3), force: Matrix3::zeros(), torque: Matrix3::zeros() });
    }
    first
}

impl<T: Real> Composites<T> {
    /// Creates the workspace for n free coordinates.
    #[inline(always)]
    fn new(nodes: &[Node<T>], n: usize) -> Self {
        let real = T::splat;
        let zero = Vector3::zeros();
        let parent = |i: usize| nodes[i].parent.filter(|parent| nodes[*parent].part == Part::Loading);
        let mut bodies: Vec<Composite<T>> = Vec::with_capacity(nodes.len());
        let mut groups: Vec<ColumnGroup<T>> = Vec::new();
        let (mut columns, mut branches) = (0, false);
        for (i, node) in nodes.iter().enumerate() {
            let is_beside = |j: usize| j != i && nodes[j].part == Part::Loading && parent(j) == parent(i);
            branches |= node.part == Part::Loading && (0..nodes.len()).any(is_beside);
            let mut body = Composite {
                mass: real(0.0),
                h: zero,
                I: Matrix3::zeros(),
                R: Matrix3::identity(),
                r: zero,
                parent: parent(i),
                own: None,
                groups: 0..0,
            };
            if let Some(row) = node.row {
                let mut carriers = std::iter::successors(body.parent, |carrier| bodies[*carrier].parent);
                let inner = carriers.find_map(|carrier| bodies[carrier].own);
                let own = place_columns(&mut groups, inner, row, node.size());
                columns += node.size();
                (body.own, body.groups) = (Some(own), own.group..groups.len());
                let mut carrier = body.parent;
                while let Some(carrying) = carrier.map(|body| &mut bodies[body]) {
                    let first = if carrying.groups.is_empty() { own.group } else { carrying.groups.start };
                    carrying.groups = first..groups.len();
                    carrier = carrying.parent;
                }
            }
            bodies.push(body);
        }
        Self { bodies, groups, sums: branches || columns != n }
    }

    /// Initialises the bodies with their own inertias, rotated to the common axes.
    #[inline(always)]
    fn begin(&mut self, nodes: &[Node<T>]) {
        for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node.part == Part::Loading) {
            let (inward, outward) = self.bodies.split_at_mut(i);
            let body = &mut outward[0];
            body.mass = node.mass;
            let Some(parent) = body.parent.map(|parent| &inward[parent]) else {
                (body.h, body.I) = (node.h, node.I);
                continue;
            };
            body.R = mul3(&parent.R, &node.R);
            body.r = mul(&parent.R, &node.p);
            body.h = mul(&body.R, &node.h);
            body.I = turn_symmetric(&body.R, &node.I);
        }
    }

    /// (10) and (11), column by column into M.
    #[inline(always)]
    fn meet<const SUMS: bool>(&mut self, nodes: &[Node<T>], M: &mut Entries<'_, T, SUMS>) {
        for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node.part == Part::Loading).rev() {
            let (inward, outward) = self.bodies.split_at_mut(i);
            let body = &outward[0];
            let parent = body.parent.map(|parent| &mut inward[parent]);
            if let (Some(own), Some(row)) = (body.own, node.row) {
                let base = match &parent {
                    Some(parent) => parent.R,
                    None => transposed(&node.R),
                };
                let outward = &mut self.groups[own.group..body.groups.end];
                match node.joint {
                    NodeJoint::Elastic { .. } => body.elastic(node, &base, outward, row, M),
                    _ => body.single(node, &base, outward, Column { lane: own.lane, row }, M),
                }
            }
            if let Some(parent) = parent {
                for group in &mut self.groups[body.groups.clone()] {
                    group.carry(&body.r);
                }
                parent.take(body);
            }
        }
    }
}

impl<T: Real> Composite<T> {
    /// Columns and entries of a single-DoF joint; `base` rotates vectors from the parent's axes.
    #[inline(always)]
    fn single<const SUMS: bool>(
        &self,
        node: &Node<T>,
        base: &Matrix3<T>,
        outward: &mut [ColumnGroup<T>],
        at: Column,
        M: &mut Entries<'_, T, SUMS>,
    ) {
        let ratio = T::splat(node.ratio);
        let (axis, along) = match &node.joint {
            NodeJoint::Turns { axis, along, .. } => (Some(axis), along.as_ref()),
            NodeJoint::Slides { along } => (None, Some(along)),
            NodeJoint::Elastic { .. } => (None, None),
        };
        let own = &mut outward[0];
        if at.lane + 1 == own.count {
            own.clear();
        }
        let zero = Vector3::zeros();
        let (mut turns, mut slides) = (zero, zero);
        if let Some(axis) = axis {
            turns = scaled(&mul(&self.R, &lift(axis)), ratio);
            own.add(at.lane, &cross(&turns, &self.h), &mul(&self.I, &turns));
        }
        if let Some(along) = along {
            slides = scaled(&mul(base, &lift(along)), ratio);
            own.add(at.lane, &scaled(&slides, self.mass), &cross(&self.h, &slides));
        }
        for (number, group) in outward.iter().enumerate() {
            let mut products = zero;
            if axis.is_some() {
                products = mul(&group.torque, &turns);
            }
            if along.is_some() {
                products = add(&products, &mul(&group.force, &slides));
            }
            match number {
                0 => M.put_own(at.row, group, at.lane, &products),
                _ => M.put_row(at.row, group, &products),
            }
        }
    }

    /// Columns and entries of a six-DoF joint; `base` rotates vectors from the parent's axes.
    #[inline(always)]
    fn elastic<const SUMS: bool>(
        &self,
        node: &Node<T>,
        base: &Matrix3<T>,
        outward: &mut [ColumnGroup<T>],
        row: usize,
        M: &mut Entries<'_, T, SUMS>,
    ) {
        let is_parallel = matches!(node.joint, NodeJoint::Elastic { is_parallel: true, .. });
        let L = if is_parallel { *base } else { mul3(base, &node.R_PJ) };
        let B = mul3(&self.R, &node.B);
        let h = &self.h;
        // Rows of m L and [h]x L, then of -[h]x B and I B.
        let Lt = transposed(&L);
        let rows = [column(&Lt, 0), column(&Lt, 1), column(&Lt, 2)];
        outward[0].force =
            columns(scaled(&rows[0], self.mass), scaled(&rows[1], self.mass), scaled(&rows[2], self.mass));
        outward[0].torque = crossed(h, &rows);
        let Bt = transposed(&B);
        let rows = [column(&Bt, 0), column(&Bt, 1), column(&Bt, 2)];
        outward[1].force = crossed(&-*h, &rows);
        outward[1].torque = tr_mul3(&B, &self.I);

        // Translation block: mass times identity.
        let zero = T::splat(0.0);
        for c in 0..3 {
            let mut own = [zero; 3];
            own[c] = self.mass;
            M.put_own(row + c, &outward[0], c, &own.into());
        }
        for group in &outward[1..] {
            M.put_three(row, group, &L, &group.force);
        }
        let (own, others) = (&outward[1], &outward[2..]);
        for c in 0..3 {
            M.put_own(row + 3 + c, own, c, &mul(&own.torque, &column(&B, c)));
        }
        for group in others {
            M.put_three(row + 3, group, &B, &group.torque);
        }
    }

    /// Adds the composite body `other`, located at its r.
    #[inline(always)]
    fn take(&mut self, other: &Self) {
        let real = T::splat;
        let zero = Vector3::zeros();
        let (r, h) = (&other.r, &other.h);
        // I + (2 r·h + m r·r) 1 - (r hᵀ + h rᵀ + m r rᵀ), with k = h + m r/2
        let moment = scaled(r, other.mass);
        let k = add(h, &scaled(&moment, real(0.5)));
        let [back, k_back] = [scaled(r, real(-1.0)), scaled(&k, real(-1.0))];
        let moved = add3(&dyad(&back, &k, &zero, real(2.0) * dot(r, &k)), &dyad(&k_back, r, &zero, real(0.0)));
        self.I = add3(&self.I, &add3(&other.I, &moved));
        self.h = add(&self.h, &add(h, &moment));
        self.mass += other.mass;
    }
}

/// Lane of a column and its row in M.
#[derive(Clone, Copy)]
struct Column {
    lane: usize,
    row: usize,
}

impl<T: Real> ColumnGroup<T> {
    /// Sets all wrenches to zero.
    #[inline(always)]
    fn clear(&mut self) {
        (self.force, self.torque) = (Matrix3::zeros(), Matrix3::zeros());
    }

    /// Adds a wrench to a column.
    #[inline(always)]
    fn add(&mut self, lane: usize, force: &Vector3<T>, torque: &Vector3<T>) {
        for (to, v) in [(&mut self.force, force), (&mut self.torque, torque)] {
            let [x, y, z] = &mut to.data.0;
            x[lane] += v.x;
            y[lane] += v.y;
            z[lane] += v.z;
        }
    }

    /// Shifts the reference point of the moments inward by r.
    #[inline(always)]
    fn carry(&mut self, r: &Vector3<T>) {
        let components = [column(&self.force, 0), column(&self.force, 1), column(&self.force, 2)];
        self.torque = add3(&self.torque, &crossed(r, &components));
    }
}

/// `([v]x A)ᵀ` from the rows of A.
#[inline(always)]
fn crossed<T: Real>(v: &Vector3<T>, [x, y, z]: &[Vector3<T>; 3]) -> Matrix3<T> {
    columns(
        sub(&scaled(z, v.y), &scaled(y, v.z)),
        sub(&scaled(x, v.z), &scaled(z, v.x)),
        sub(&scaled(y, v.x), &scaled(x, v.y)),
    )
}

/// Mass matrix being filled, n columns of length n. With `SUMS` it starts at zero and entries are
/// added, because some pairs of coordinates contribute nothing, or more than once.
struct Entries<'m, T, const SUMS: bool> {
    M: &'m mut [T],
    n: usize,
}

impl<T: Real, const SUMS: bool> Entries<'_, T, SUMS> {
    #[inline(always)]
    fn put_one(&mut self, row: usize, column: usize, product: T) {
        let entry = &mut self.M[column * self.n + row];
        *entry = if SUMS { *entry + product } else { product };
    }

    /// Writes an off-diagonal entry and its transpose.
    #[inline(always)]
    fn put(&mut self, row: usize, other: usize, product: T) {
        self.put_one(row, other, product);
        self.put_one(other, row, product);
    }

    /// Writes the entries of a column within its own group: the diagonal and the columns outward of
    /// it.
    #[inline(always)]
    fn put_own(&mut self, row: usize, group: &ColumnGroup<T>, lane: usize, products: &Vector3<T>) {
        self.put_one(row, row, products[lane]);
        for k in lane + 1..group.count {
            self.put(row, group.row + k, products[k]);
        }
    }

    /// Writes the entries of a row for another group of columns.
    #[inline(always)]
    fn put_row(&mut self, row: usize, group: &ColumnGroup<T>, products: &Vector3<T>) {
        if SUMS || group.count < 3 {
            for k in 0..group.count {
                self.put(row, group.row + k, products[k]);
            }
            return;
        }
        self.M[row * self.n + group.row..][..3].copy_from_slice(products.as_slice());
        let [x, y, z] = self.three_columns(group.row);
        (x[row], y[row], z[row]) = (products.x, products.y, products.z);
    }

    /// Writes the entries of three columns of an elastic joint, with these axes, for another group.
    #[inline(always)]
    fn put_three(&mut self, row: usize, group: &ColumnGroup<T>, axes: &Matrix3<T>, wrenches: &Matrix3<T>) {
        let a = mul(wrenches, &column(axes, 0));
        let b = mul(wrenches, &column(axes, 1));
        let c = mul(wrenches, &column(axes, 2));
        let other = group.row;
        if SUMS || group.count < 3 {
            for k in 0..group.count {
                self.put(row, other + k, a[k]);
                self.put(row + 1, other + k, b[k]);
                self.put(row + 2, other + k, c[k]);
            }
            return;
        }
        let [x, y, z] = self.three_columns(row);
        x[other..other + 3].copy_from_slice(a.as_slice());
        y[other..other + 3].copy_from_slice(b.as_slice());
        z[other..other + 3].copy_from_slice(c.as_slice());
        let [x, y, z] = self.three_columns(other);
        x[row..row + 3].copy_from_slice(&[a.x, b.x, c.x]);
        y[row..row + 3].copy_from_slice(&[a.y, b.y, c.y]);
        z[row..row + 3].copy_from_slice(&[a.z, b.z, c.z]);
    }

    /// Three successive columns of M, from `first` on.
    #[inline(always)]
    fn three_columns(&mut self, first: usize) -> [&mut [T]; 3] {
        let n = self.n;
        let (x, others) = self.M[first * n..].split_at_mut(n);
        let (y, others) = others.split_at_mut(n);
        [x, y, &mut others[..n]]
    }
}

impl<T: Real> FreeForces<T> {
    /// Computes the mass matrix of the free coordinates (kg, kg m, kg m²) at the poses of the last
    /// call, column by column into M, both triangles. Equals [`crate::mass_matrix`] to rounding.
    /// Allocates on the first call only.
    ///
    /// # Source
    /// [Featherstone 2008], section 6.2.
    #[inline(always)]
    pub fn mass(&mut self, M: &mut [T]) {
        let (nodes, n) = (&self.nodes, M.len().isqrt());
        let composites = self.composites.get_or_insert_with(
            #[inline(always)]
            || Box::new(Composites::new(nodes, n)),
        );
        composites.begin(nodes);
        if composites.sums {
            M.fill(T::splat(0.0));
            composites.meet(nodes, &mut Entries::<_, true> { M, n });
        } else {
            composites.meet(nodes, &mut Entries::<_, false> { M, n });
        }
        for &(row, coordinate, inertia) in &self.rotors {
            let column = self.nodes.iter().find(|node| node.coordinate == coordinate).and_then(|node| node.row);
            if let Some(column) = column {
                M[column * n + row] += T::splat(inertia);
            }
        }
    }

    /// As [`FreeForces::mass`], at the positions of all coordinates (rad or m).
    #[inline(always)]
    pub fn mass_at(&mut self, q: &[T], M: &mut [T]) {
        self.place(q);
        self.mass(M);
    }
}
