//! Linear map over one tooth period: from the state of the structure and the chips of the last
//! tooth to those one period later.
//!
//! ```text
//! z' = Λ z + l F(t)      F = -Σ_k P_k(t) (w_k(t) - w_k(t - T))      w_k = N_k(t)ᵀ u(t)
//! ```
//! The period is divided where teeth enter or leave the cut. While no tooth cuts, the free motion
//! of the structure is exact. The rest is divided into elements: in each the force is the
//! polynomial through its values at the Gauss nodes, and the response of the poles to it is exact.
//! The unknowns are the chip thicknesses at the nodes, so that their number depends on the duration
//! and frequency of the cutting motion, not on the structure.
//!
//! In terms of its error this is a semi-discretisation [Insperger & Stépán 2004] of the whole
//! force, that is, a full discretisation [Ding 2010], with elements of sixth order in place of
//! steps of first order.
//!
//! Not here: the search for the limit (`limit.rs`), the force of a tooth (`cutter.rs`).

use nalgebra::{Complex, DMatrix, Matrix3, Vector3};

use crate::milling::cutter::{Cutter, Regeneration};
use crate::milling::moments::{Moments, NODES, RULE};
use crate::milling::structure::Structure;

/// Division of a tooth period.
pub struct Period<'a> {
    structure: &'a Structure,
    cutter: &'a Cutter,
    /// Spindle speed (rad/s).
    spindle: f64,
    /// Maximum length of an element (s).
    longest: f64,
    /// Stretches computed once, if they do not depend on the depth.
    straight: Option<Vec<Stretch>>,
}

/// Interval of free motion, or of cutting with elements of equal length.
struct Stretch {
    /// Cutter angle at its start (rad).
    start: f64,
    /// Length of an element (s).
    length: f64,
    /// Number of elements; one for free motion.
    elements: usize,
    motion: Motion,
}

enum Motion {
    /// Factors `e^{λ h}` of the poles.
    Free(Vec<Complex<f64>>),
    Cutting(Box<Answers>),
}

/// Response of the structure within an element.
struct Answers {
    /// `e^{λ h}`, by pole.
    decay: Vec<Complex<f64>>,
    /// Displacement at each node per initial state, 3×nz.
    to_nodes: Vec<DMatrix<f64>>,
    /// Displacement at node i per force at node j (m/N).
    gains: Vec<[Matrix3<f64>; NODES]>,
    /// State at the end per force at node j, nz×3.
    to_end: Vec<DMatrix<f64>>,
}

/// Node with chips, for evaluating an eigenvector.
pub(crate) struct CutNode {
    /// Time from the start of the period (s).
    pub(crate) time: f64,
    /// Weight of the node in an integral over the period (s).
    pub(crate) weight: f64,
    /// Index of its first chip among the unknowns, and the force law of the chips.
    pub(crate) first: usize,
    pub(crate) regeneration: Regeneration,
}

impl<'a> Period<'a> {
    /// Prepares a tooth period at a spindle speed (rad/s), in elements of at most `longest` seconds.
    ///
    /// Cost: without a helix the responses of the poles are computed here, once for all depths.
    pub fn new(structure: &'a Structure, cutter: &'a Cutter, spindle: f64, longest: f64) -> Self {
        let mut period = Self { structure, cutter, spindle, longest, straight: None };
        if cutter.is_straight() {
            period.straight = Some(period.stretches(1.0));
        }
        period
    }

    /// Calls a function with the stretches for a depth.
    fn with_stretches<T>(&self, depth: f64, run: impl FnOnce(&[Stretch]) -> T) -> T {
        match &self.straight {
            Some(stretches) => run(stretches),
            None => run(&self.stretches(depth)),
        }
    }

    /// Divides the period at entries and exits of teeth.
    fn stretches(&self, depth: f64) -> Vec<Stretch> {
        let events = self.cutter.events(depth);
        let stretch = |ends: &[f64]| {
            let (start, duration) = (ends[0], (ends[1] - ends[0]) / self.spindle);
            if self.cutter.force_matrix(0.5 * (ends[0] + ends[1]), depth).amax() == 0.0 {
                let decay = self.structure.poles().iter().map(|p| (p.value * duration).exp()).collect();
                return Stretch { start, length: duration, elements: 1, motion: Motion::Free(decay) };
            }
            let elements = (duration / self.longest * (1.0 - 1e-9)).ceil().max(1.0) as usize;
            let length = duration / elements as f64;
            Stretch { start, length, elements, motion: Motion::Cutting(Box::new(self.answers(length))) }
        };
        events.windows(2).map(stretch).collect()
    }

    /// Computes the response of all poles within an element of length `h` (s), by its moments.
    fn answers(&self, h: f64) -> Answers {
        let (poles, nz) = (self.structure.poles(), self.structure.n_states());
        let mut answers = Answers {
            decay: Vec::with_capacity(poles.len()),
            to_nodes: vec![DMatrix::zeros(3, nz); NODES],
            gains: vec![[Matrix3::zeros(); NODES]; NODES],
            to_end: vec![DMatrix::zeros(nz, 3); NODES],
        };
        let mut row = 0;
        for pole in poles {
            let Moments { decay, integrals } = RULE.moments(pole.value * h);
            let (reading, pair) = (pole.reading(), pole.n_states() == 2);
            for i in 0..NODES {
                // A complex state is two real states, its real and imaginary part.
                let shown = reading * decay[i];
                answers.to_nodes[i].set_column(row, &shown.map(|x| x.re));
                if pair {
                    answers.to_nodes[i].set_column(row + 1, &shown.map(|x| -x.im));
                }
                for (gain, integral) in answers.gains[i].iter_mut().zip(&integrals[i]) {
                    *gain += (reading * (integral * h) * pole.input.transpose()).map(|x| x.re);
                }
                let moved = pole.input.transpose() * (integrals[NODES][i] * h);
                answers.to_end[i].set_row(row, &moved.map(|x| x.re));
                if pair {
                    answers.to_end[i].set_row(row + 1, &moved.map(|x| x.im));
                }
            }
            answers.decay.push(decay[NODES]);
            row += pole.n_states();
        }
        answers
    }

    /// Returns a depth below which the mean force causes no chatter at any speed:
    /// `|b (1 - e^{-i ω T})| = 1/|λ|` with an eigenvalue λ of `G H`.
    pub(crate) fn mean_force_bound(&self) -> f64 {
        let H = self.cutter.mean_force_matrix().map(|x| Complex::new(x, 0.0));
        let size = |w: &f64| (self.structure.frequency_response(*w) * H).norm();
        let largest = self.structure.frequencies().iter().map(size).fold(0.0, f64::max);
        0.5 / largest.max(f64::MIN_POSITIVE)
    }

    /// Returns the size of the map.
    pub(crate) fn unknowns(&self, depth: f64) -> usize {
        let chips = self.with_stretches(depth, |stretches| {
            let cutting = |s: &&Stretch| matches!(s.motion, Motion::Cutting(_));
            let pairs = |s: &Stretch| {
                let middle = s.start + 0.5 * s.length * self.spindle * s.elements as f64;
                s.elements * NODES * self.cutter.regeneration(middle, depth).pairs.len()
            };
            stretches.iter().filter(cutting).map(pairs).sum::<usize>()
        });
        self.structure.n_states() + chips
    }

    /// Computes the map over one period at a depth (m): the states of the poles first, then the chip
    /// thicknesses (m) at the nodes in the order of time.
    pub fn at(&self, depth: f64) -> PeriodMap {
        self.with_stretches(depth, |stretches| {
            let mut first = self.structure.n_states();
            let mut pieces = Vec::new();
            for (stretch, cuts) in stretches.iter().zip(self.regenerations(stretches, depth)) {
                match &stretch.motion {
                    Motion::Free(decay) => pieces.push(Piece::Free(self.rotations(decay))),
                    Motion::Cutting(answers) => {
                        let decay = self.rotations(&answers.decay);
                        for nodes in &cuts {
                            let element = self.element(answers, nodes, first, &decay);
                            first += element.chips.nrows();
                            pieces.push(Piece::Cutting(element));
                        }
                    }
                }
            }
            PeriodMap { n_states: self.structure.n_states(), size: first, pieces }
        })
    }

    /// Returns the force laws at the nodes, by stretch and element.
    fn regenerations(&self, stretches: &[Stretch], depth: f64) -> Vec<Vec<Vec<Regeneration>>> {
        let at = |s: &Stretch, e: usize, x: f64| {
            self.cutter.regeneration(s.start + (e as f64 + x) * s.length * self.spindle, depth)
        };
        let element = |s: &Stretch, e: usize| RULE.nodes.iter().map(|x| at(s, e, *x)).collect();
        let all = |s: &Stretch| match s.motion {
            Motion::Free(_) => Vec::new(),
            Motion::Cutting(_) => (0..s.elements).map(|e| element(s, e)).collect(),
        };
        stretches.iter().map(all).collect()
    }

    /// Computes the matrices of one element: its chips from the initial state and the chips of the
    /// last tooth, then the state at its end.
    fn element(&self, answers: &Answers, nodes: &[Regeneration], first: usize, decay: &[Rotation]) -> Element {
        let nz = self.structure.n_states();
        let pairs: Vec<(usize, Vector3<f64>, Vector3<f64>)> = nodes
            .iter()
            .enumerate()
            .flat_map(|(i, r)| r.pairs.iter().map(move |(push, chip)| (i, *push, *chip)))
            .collect();
        let n = pairs.len();
        // w = S z - Z (w - w_old): (1 + Z) w = S z + Z w_old.
        let mut S = DMatrix::zeros(n, nz);
        for (row, (i, _, chip)) in pairs.iter().enumerate() {
            S.set_row(row, &(chip.transpose() * &answers.to_nodes[*i]));
        }
        let mut Z = DMatrix::from_fn(n, n, |row, column| {
            let ((i, _, chip), (j, push, _)) = (&pairs[row], &pairs[column]);
            chip.dot(&(answers.gains[*i][*j] * push))
        });
        let left = (DMatrix::identity(n, n) + &Z).lu();
        let solved = left.solve_mut(&mut S) && left.solve_mut(&mut Z);
        debug_assert!(solved, "an element so short that its own force cannot make the system singular");

        let mut to_end = DMatrix::zeros(nz, n);
        for (column, (j, push, _)) in pairs.iter().enumerate() {
            to_end.set_column(column, &(&answers.to_end[*j] * push));
        }
        Element { first, decay: decay.to_vec(), chips: S, old: Z, to_end }
    }

    /// Returns the free motion of the states for the factors `e^{λ h}`.
    fn rotations(&self, decay: &[Complex<f64>]) -> Vec<Rotation> {
        let poles = self.structure.poles().iter().zip(decay);
        poles.map(|(pole, e)| Rotation { pair: pole.n_states() == 2, by: *e }).collect()
    }

    /// Returns the nodes with chips, in the order of the unknowns.
    pub(crate) fn cut_nodes(&self, depth: f64) -> Vec<CutNode> {
        self.with_stretches(depth, |stretches| {
            let mut nodes = Vec::new();
            let mut first = self.structure.n_states();
            for (stretch, elements) in stretches.iter().zip(self.regenerations(stretches, depth)) {
                for (e, element) in elements.into_iter().enumerate() {
                    for (i, regeneration) in element.into_iter().enumerate() {
                        let time = stretch.start / self.spindle + (e as f64 + RULE.nodes[i]) * stretch.length;
                        let n = regeneration.pairs.len();
                        nodes.push(CutNode { time, weight: RULE.weights[i] * stretch.length, first, regeneration });
                        first += n;
                    }
                }
            }
            nodes
        })
    }
}

/// Free motion of one pole.
#[derive(Clone, Copy)]
struct Rotation {
    pair: bool,
    by: Complex<f64>,
}

/// Matrices of an element at a depth.
struct Element {
    /// Index of its first chip among the unknowns.
    first: usize,
    decay: Vec<Rotation>,
    /// Chips per initial state, n×nz.
    chips: DMatrix<f64>,
    /// Chips per chip of the last tooth, n×n.
    old: DMatrix<f64>,
    /// Negative derivative of the final state with respect to the change of the chips, nz×n.
    to_end: DMatrix<f64>,
}

enum Piece {
    Free(Vec<Rotation>),
    Cutting(Element),
}

/// Map from states and chips of the last tooth to those one period later.
pub struct PeriodMap {
    n_states: usize,
    size: usize,
    pieces: Vec<Piece>,
}

impl PeriodMap {
    /// Returns the number of states of the structure.
    pub(crate) fn n_states(&self) -> usize {
        self.n_states
    }

    /// Returns the number of states and chips.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Applies the map to vectors, column by column.
    pub(crate) fn apply(&self, from: &DMatrix<f64>, to: &mut DMatrix<f64>) {
        let mut state = from.rows(0, self.n_states).into_owned();
        for piece in &self.pieces {
            match piece {
                Piece::Free(decay) => rotate(&mut state, decay),
                Piece::Cutting(element) => {
                    let n = element.chips.nrows();
                    let old = from.rows(element.first, n);
                    let mut chips = &element.chips * &state;
                    chips.gemm(1.0, &element.old, &old, 1.0);
                    to.rows_mut(element.first, n).copy_from(&chips);
                    // The force is proportional to the change from tooth to tooth.
                    chips -= old;
                    rotate(&mut state, &element.decay);
                    state.gemm(-1.0, &element.to_end, &chips, 1.0);
                }
            }
        }
        to.rows_mut(0, self.n_states).copy_from(&state);
    }

    /// Returns the map as a square matrix; its eigenvalues are the Floquet multipliers.
    pub fn matrix(&self) -> DMatrix<f64> {
        let mut map = DMatrix::zeros(self.size, self.size);
        self.apply(&DMatrix::identity(self.size, self.size), &mut map);
        map
    }
}

/// Multiplies the states of each pole by its factor `e^{λ h}`.
fn rotate(state: &mut DMatrix<f64>, rotations: &[Rotation]) {
    for mut column in state.column_iter_mut() {
        let mut row = 0;
        for Rotation { pair, by } in rotations {
            if *pair {
                let z = Complex::new(column[row], column[row + 1]) * by;
                (column[row], column[row + 1]) = (z.re, z.im);
                row += 2;
            } else {
                column[row] *= by.re;
                row += 1;
            }
        }
    }
}
