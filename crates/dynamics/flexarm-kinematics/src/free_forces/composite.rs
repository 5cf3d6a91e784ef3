//! Mass matrix of the free coordinates by composite bodies, O(n × depth).
//!
//! ```text
//!   F_k = I_k S_k            wrench at the body's origin that gives joint k, and all outward of it, a unit acceleration  (10)
//!   M_ik = S_iᵀ F_k          for all k outward of i, F_k carried to the origin of i's body                               (11)
//! ```
//! All of it is in the axes of the first body whose wrench counts, so that a wrench keeps its force on the way inward and only its moment
//! changes. Three columns go together, component by component: the translations or the rotations of an elastic joint, or up to three
//! joints of one coordinate, one behind the other.
//!
//! Source: [Featherstone 2008], section 6.2.

use std::ops::Range;

use flexarm_spatial::Real;
use flexarm_spatial::space::{Fixed, Space};
use nalgebra::Vector3;

use super::node::{Node, NodeJoint};
use super::{Part, PointTree};

/// The workspace.
#[derive(Clone, Debug)]
pub(super) struct Composites<S: Space> {
    /// One for each node.
    bodies: Vec<Composite<S>>,
    /// Wrenches on their way inward, three columns each.
    threes: Vec<Three<S>>,
    /// Whether some coordinates do not meet, or meet more than once.
    sums: bool,
}

/// A body with all that it carries outward, in the common axes.
#[derive(Clone, Debug)]
struct Composite<S: Space> {
    mass: S::Real,
    /// First moment and inertia about Bo.
    h: S::Vector,
    I: S::Matrix,
    /// Turns vectors of the body's axes.
    R: S::Both,
    /// From the parent's origin to the body's.
    r: S::Vector,
    /// The parent, if its wrench counts.
    parent: Option<usize>,
    /// The first of its joint's columns among the threes, if it is free.
    own: Option<Place>,
    /// Threes that move with it.
    threes: Range<usize>,
}

/// A column.
#[derive(Clone, Copy, Debug)]
struct Place {
    three: usize,
    lane: usize,
}

/// Wrenches of up to three columns whose rows in M follow each other.
#[derive(Clone, Debug)]
struct Three<S: Space> {
    row: usize,
    count: usize,
    /// `Fᵀ`: a row for each of them, a column for each component.
    force: S::Matrix,
    torque: S::Matrix,
}

/// Room for the columns of a joint: beside the next free one inward, if that is the last so far and both have one coordinate.
#[inline(always)]
fn place_columns<S: Space>(threes: &mut Vec<Three<S>>, inner: Option<Place>, row: usize, size: usize) -> Place {
    if let (Some(inner), Some(last), 1) = (inner, threes.len().checked_sub(1), size)
        && inner.three == last
        && inner.lane + 1 == threes[last].count
        && threes[last].count < 3
        && threes[last].row + threes[last].count == row
    {
        threes[last].count += 1;
        return Place { lane: inner.lane + 1, ..inner };
    }
    let first = Place { three: threes.len(), lane: 0 };
    let zero = S::fixed(&Fixed::default());
    let none = S::of_columns([zero; 3]);
    for row in (row..row + size).step_by(3) {
        threes.push(Three { row, count: size.min(3), force: none, torque: none });
    }
    first
}

impl<S: Space> Composites<S> {
    /// For n free coordinates.
    #[inline(always)]
    fn new(nodes: &[Node<S>], n: usize) -> Self {
        let real = S::Real::splat;
        let zero = S::fixed(&Fixed::default());
        let parent = |i: usize| nodes[i].parent.filter(|parent| nodes[*parent].part == Part::Loading);
        let mut bodies: Vec<Composite<S>> = Vec::with_capacity(nodes.len());
        let mut threes: Vec<Three<S>> = Vec::new();
        let (mut columns, mut branches) = (0, false);
        for (i, node) in nodes.iter().enumerate() {
            let is_beside = |j: usize| j != i && nodes[j].part == Part::Loading && parent(j) == parent(i);
            branches |= node.part == Part::Loading && (0..nodes.len()).any(is_beside);
            let mut body = Composite {
                mass: real(0.0),
                h: zero,
                I: S::of_columns([zero; 3]),
                R: S::dyad_both(&zero, &zero, &zero, real(1.0)),
                r: zero,
                parent: parent(i),
                own: None,
                threes: 0..0,
            };
            if let Some(row) = node.row {
                let mut carriers = std::iter::successors(body.parent, |carrier| bodies[*carrier].parent);
                let inner = carriers.find_map(|carrier| bodies[carrier].own);
                let own = place_columns(&mut threes, inner, row, node.size());
                columns += node.size();
                (body.own, body.threes) = (Some(own), own.three..threes.len());
                let mut carrier = body.parent;
                while let Some(carrying) = carrier.map(|body| &mut bodies[body]) {
                    let first = if carrying.threes.is_empty() { own.three } else { carrying.threes.start };
                    carrying.threes = first..threes.len();
                    carrier = carrying.parent;
                }
            }
            bodies.push(body);
        }
        Self { bodies, threes, sums: branches || columns != n }
    }

    /// Own inertias, turned to the common axes.
    #[inline(always)]
    fn begin(&mut self, nodes: &[Node<S>]) {
        for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node.part == Part::Loading) {
            let (inward, outward) = self.bodies.split_at_mut(i);
            let body = &mut outward[0];
            body.mass = node.mass;
            let Some(parent) = body.parent.map(|parent| &inward[parent]) else {
                (body.h, body.I) = (node.h, node.I);
                continue;
            };
            body.R = S::turned(&parent.R, &node.R);
            body.r = S::turn(&parent.R, &node.p);
            body.h = S::turn(&body.R, &node.h);
            body.I = S::congruent(&body.R, &node.I);
        }
    }

    /// (10) and (11), column after column into M.
    #[inline(always)]
    fn meet<const SUMS: bool>(&mut self, nodes: &[Node<S>], M: &mut Entries<'_, S::Real, SUMS>) {
        for (i, node) in nodes.iter().enumerate().filter(|(_, node)| node.part == Part::Loading).rev() {
            let (inward, outward) = self.bodies.split_at_mut(i);
            let body = &outward[0];
            let parent = body.parent.map(|parent| &mut inward[parent]);
            if let (Some(own), Some(row)) = (body.own, node.row) {
                let base = match &parent {
                    Some(parent) => parent.R,
                    None => S::transposed(&node.R),
                };
                let outward = &mut self.threes[own.three..body.threes.end];
                match node.joint {
                    NodeJoint::Elastic { .. } => body.elastic(node, &base, outward, row, M),
                    _ => body.single(node, &base, outward, Column { lane: own.lane, row }, M),
                }
            }
            if let Some(parent) = parent {
                for three in &mut self.threes[body.threes.clone()] {
                    three.carry(&body.r);
                }
                parent.take(body);
            }
        }
    }
}

impl<S: Space> Composite<S> {
    /// A joint of one coordinate; `base` turns vectors of the parent's axes.
    #[inline(always)]
    fn single<const SUMS: bool>(
        &self,
        node: &Node<S>,
        base: &S::Both,
        outward: &mut [Three<S>],
        at: Column,
        M: &mut Entries<'_, S::Real, SUMS>,
    ) {
        let ratio = S::Real::splat(node.ratio);
        let (axis, along) = match &node.joint {
            NodeJoint::Turns { axis, along, .. } => (Some(axis), along.as_ref()),
            NodeJoint::Slides { along } => (None, Some(along)),
            NodeJoint::Elastic { .. } => (None, None),
        };
        let own = &mut outward[0];
        if at.lane + 1 == own.count {
            own.clear();
        }
        let zero = S::fixed(&Fixed::default());
        let (mut turns, mut slides) = (zero, zero);
        if let Some(axis) = axis {
            turns = S::scaled(&S::turn(&self.R, &S::fixed(axis)), ratio);
            own.add(at.lane, &S::cross(&turns, &self.h), &S::mul(&self.I, &turns));
        }
        if let Some(along) = along {
            slides = S::scaled(&S::turn(base, &S::fixed(along)), ratio);
            own.add(at.lane, &S::scaled(&slides, self.mass), &S::cross(&self.h, &slides));
        }
        for (number, three) in outward.iter().enumerate() {
            let mut products = zero;
            if axis.is_some() {
                products = S::mul(&three.torque, &turns);
            }
            if along.is_some() {
                products = S::add(&products, &S::mul(&three.force, &slides));
            }
            let products = S::components(&products);
            match number {
                0 => M.put_own(at.row, three, at.lane, &products),
                _ => M.put_row(at.row, three, &products),
            }
        }
    }

    /// A joint of six coordinates.
    #[inline(always)]
    fn elastic<const SUMS: bool>(
        &self,
        node: &Node<S>,
        base: &S::Both,
        outward: &mut [Three<S>],
        row: usize,
        M: &mut Entries<'_, S::Real, SUMS>,
    ) {
        let is_parallel = matches!(node.joint, NodeJoint::Elastic { is_parallel: true, .. });
        let L = if is_parallel { *base } else { S::turned(base, &node.R_PJ) };
        let B = S::turned(&self.R, &node.B);
        let h = S::components(&self.h);
        // m L and [h]x L, then -[h]x B and I B, by their rows.
        let rows = [S::row(&L, 0), S::row(&L, 1), S::row(&L, 2)];
        outward[0].force = S::of_columns([
            S::scaled(&rows[0], self.mass),
            S::scaled(&rows[1], self.mass),
            S::scaled(&rows[2], self.mass),
        ]);
        outward[0].torque = S::of_columns(crossed::<S>(&h, &rows));
        let rows = [S::row(&B, 0), S::row(&B, 1), S::row(&B, 2)];
        outward[1].force = S::of_columns(crossed::<S>(&-h, &rows));
        let [x, y, z] = S::columns(&self.I);
        outward[1].torque = S::of_columns([S::turn_back(&B, &x), S::turn_back(&B, &y), S::turn_back(&B, &z)]);

        // The translations meet the mass alone.
        let zero = S::Real::splat(0.0);
        for c in 0..3 {
            let mut own = [zero; 3];
            own[c] = self.mass;
            M.put_own(row + c, &outward[0], c, &own.into());
        }
        for three in &outward[1..] {
            M.put_three::<S>(row, three, &L, &three.force);
        }
        let (own, others) = (&outward[1], &outward[2..]);
        for c in 0..3 {
            M.put_own(row + 3 + c, own, c, &S::components(&S::mul(&own.torque, &S::column(&B, c))));
        }
        for three in others {
            M.put_three::<S>(row + 3, three, &B, &three.torque);
        }
    }

    /// Takes in one that sits at its r.
    #[inline(always)]
    fn take(&mut self, other: &Self) {
        let real = S::Real::splat;
        let zero = S::fixed(&Fixed::default());
        let (r, h) = (&other.r, &other.h);
        // I + (2 r·h + m r·r) 1 - (r hᵀ + h rᵀ + m r rᵀ), with k = h + m r/2
        let moment = S::scaled(r, other.mass);
        let k = S::add(h, &S::scaled(&moment, real(0.5)));
        let [back, k_back] = [S::scaled(r, real(-1.0)), S::scaled(&k, real(-1.0))];
        let moved =
            S::sum(&S::dyad(&back, &k, &zero, real(2.0) * S::dot(r, &k)), &S::dyad(&k_back, r, &zero, real(0.0)));
        self.I = S::sum(&self.I, &S::sum(&other.I, &moved));
        self.h = S::add(&self.h, &S::add(h, &moment));
        self.mass += other.mass;
    }
}

/// A column, and its row in M.
#[derive(Clone, Copy)]
struct Column {
    lane: usize,
    row: usize,
}

impl<S: Space> Three<S> {
    /// No wrenches.
    #[inline(always)]
    fn clear(&mut self) {
        let zero = S::fixed(&Fixed::default());
        (self.force, self.torque) = (S::of_columns([zero; 3]), S::of_columns([zero; 3]));
    }

    /// What a column whose wrench is zero gets.
    #[inline(always)]
    fn add(&mut self, lane: usize, force: &S::Vector, torque: &S::Vector) {
        const UNITS: [Fixed; 3] = [Fixed::unit(0), Fixed::unit(1), Fixed::unit(2)];
        let unit = S::fixed(&UNITS[lane]);
        for (to, v) in [(&mut self.force, force), (&mut self.torque, torque)] {
            let (v, [x, y, z]) = (S::components(v), S::columns(to));
            *to = S::of_columns([
                S::add(&x, &S::scaled(&unit, v.x)),
                S::add(&y, &S::scaled(&unit, v.y)),
                S::add(&z, &S::scaled(&unit, v.z)),
            ]);
        }
    }

    /// About a point r before this one.
    #[inline(always)]
    fn carry(&mut self, r: &S::Vector) {
        let moved = S::of_columns(crossed::<S>(&S::components(r), &S::columns(&self.force)));
        self.torque = S::sum(&self.torque, &moved);
    }
}

/// `[v]x A`, by rows.
#[inline(always)]
fn crossed<S: Space>(v: &Vector3<S::Real>, [x, y, z]: &[S::Vector; 3]) -> [S::Vector; 3] {
    [
        S::sub(&S::scaled(z, v.y), &S::scaled(y, v.z)),
        S::sub(&S::scaled(x, v.z), &S::scaled(z, v.x)),
        S::sub(&S::scaled(y, v.x), &S::scaled(x, v.y)),
    ]
}

/// The mass matrix that is being filled, n columns of n; zero before if it SUMS, because some coordinates do not meet, or meet more than
/// once.
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

    /// What two columns meet.
    #[inline(always)]
    fn put(&mut self, row: usize, other: usize, product: T) {
        self.put_one(row, other, product);
        self.put_one(other, row, product);
    }

    /// What a column meets among its own three: itself and those behind it.
    #[inline(always)]
    fn put_own<S: Space<Real = T>>(&mut self, row: usize, three: &Three<S>, lane: usize, products: &Vector3<T>) {
        self.put_one(row, row, products[lane]);
        for k in lane + 1..three.count {
            self.put(row, three.row + k, products[k]);
        }
    }

    /// What a column meets among three others.
    #[inline(always)]
    fn put_row<S: Space<Real = T>>(&mut self, row: usize, three: &Three<S>, products: &Vector3<T>) {
        if SUMS || three.count < 3 {
            for k in 0..three.count {
                self.put(row, three.row + k, products[k]);
            }
            return;
        }
        self.M[row * self.n + three.row..][..3].copy_from_slice(products.as_slice());
        let [x, y, z] = self.three_columns(three.row);
        (x[row], y[row], z[row]) = (products.x, products.y, products.z);
    }

    /// What three columns of an elastic joint, with these axes, meet among three others.
    #[inline(always)]
    fn put_three<S: Space<Real = T>>(&mut self, row: usize, three: &Three<S>, axes: &S::Both, wrenches: &S::Matrix) {
        let a = S::components(&S::mul(wrenches, &S::column(axes, 0)));
        let b = S::components(&S::mul(wrenches, &S::column(axes, 1)));
        let c = S::components(&S::mul(wrenches, &S::column(axes, 2)));
        let other = three.row;
        if SUMS || three.count < 3 {
            for k in 0..three.count {
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

    /// From this one on.
    #[inline(always)]
    fn three_columns(&mut self, first: usize) -> [&mut [T]; 3] {
        let n = self.n;
        let (x, others) = self.M[first * n..].split_at_mut(n);
        let (y, others) = others.split_at_mut(n);
        [x, y, &mut others[..n]]
    }
}

impl<S: Space> PointTree<S> {
    /// Mass matrix of the free coordinates (kg, kg m, kg m²) at the poses of the last forces, column after column into M.
    #[inline(always)]
    pub(crate) fn mass(&mut self, M: &mut [S::Real]) {
        let (nodes, n) = (&self.nodes, M.len().isqrt());
        let composites = self.composites.get_or_insert_with(
            #[inline(always)]
            || Box::new(Composites::new(nodes, n)),
        );
        composites.begin(nodes);
        if composites.sums {
            M.fill(S::Real::splat(0.0));
            composites.meet(nodes, &mut Entries::<_, true> { M, n });
        } else {
            composites.meet(nodes, &mut Entries::<_, false> { M, n });
        }
        for &(row, coordinate, inertia) in &self.rotors {
            let column = self.nodes.iter().find(|node| node.coordinate == coordinate).and_then(|node| node.row);
            if let Some(column) = column {
                M[column * n + row] += S::Real::splat(inertia);
            }
        }
    }
}
