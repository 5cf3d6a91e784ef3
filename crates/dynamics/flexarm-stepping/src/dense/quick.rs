//! Small dense matrices and loops of single runs, with the vector instructions that the processor
//! has. Results are bitwise the same without them.

use super::{congruence, dot, largest_of_numbers, product, solve_in_place};

/// Loops over numbers, with all calls inlined.
pub(crate) trait Loops {
    /// Runs the loops.
    fn run(self);
}

/// Runs loops with the vector instructions that the processor has. Results are bitwise the same
/// without them.
#[inline(always)]
pub(crate) fn quickly(loops: impl Loops) {
    #[cfg(target_arch = "x86_64")]
    {
        struct Here<L>(L);
        impl<L: Loops> flexarm_kinematics::Loops for Here<L> {
            #[inline(always)]
            fn run(self) {
                self.0.run();
            }
        }
        flexarm_kinematics::quickly(Here(loops));
    }
    #[cfg(not(target_arch = "x86_64"))]
    loops.run();
}

/// Computes `y = A x` with the vector instructions that the processor has.
pub(crate) fn product_of_numbers(A: &[f64], x: &[f64], y: &mut [f64]) {
    struct Product<'a>(&'a [f64], &'a [f64], &'a mut [f64]);
    impl Loops for Product<'_> {
        #[inline(always)]
        fn run(self) {
            product(self.0, self.1, self.2);
        }
    }
    quickly(Product(A, x, y));
}

/// Computes `A ← L`, `Bᵀ ← A^-1 B` with the vector instructions that the processor has; returns
/// false if A (n × n) is not positive definite.
pub(crate) fn solve_quickly(A: &mut [f64], Bt: &mut [f64], n: usize) -> bool {
    struct Solve<'a>(&'a mut [f64], &'a mut [f64], usize, &'a mut bool);
    impl Loops for Solve<'_> {
        #[inline(always)]
        fn run(self) {
            let Self(A, Bt, n, positive) = self;
            *positive = solve_in_place(A, Bt, n);
        }
    }
    let mut positive = false;
    quickly(Solve(A, Bt, n, &mut positive));
    positive
}

/// Computes `S C Sᵀ` with `Sᵀ = 1 + c X` for a symmetric C (n × n), with the vector instructions
/// that the processor has; both workspaces are n × n.
pub(crate) fn congruence_quickly(c: f64, X: &[f64], C: &[f64], n: usize, room: [&mut [f64]; 2], product: &mut [f64]) {
    struct Congruence<'a>(f64, &'a [f64], &'a [f64], usize, [&'a mut [f64]; 2], &'a mut [f64]);
    impl Loops for Congruence<'_> {
        #[inline(always)]
        fn run(self) {
            let Self(c, X, C, n, room, product) = self;
            congruence(c, X, C, n, room, product);
        }
    }
    quickly(Congruence(c, X, C, n, room, product));
}

/// Returns `|x|`, with the vector instructions that the processor has.
pub(crate) fn norm(x: &[f64]) -> f64 {
    struct Square<'a>(&'a [f64], &'a mut f64);
    impl Loops for Square<'_> {
        #[inline(always)]
        fn run(self) {
            *self.1 = dot(self.0, self.0);
        }
    }
    let mut square = 0.0;
    quickly(Square(x, &mut square));
    square.sqrt()
}

/// Computes [`largest_of_numbers`] with the vector instructions that the processor has.
pub(crate) fn largest_quickly(x: &[f64]) -> f64 {
    struct Largest<'a>(&'a [f64], &'a mut f64);
    impl Loops for Largest<'_> {
        #[inline(always)]
        fn run(self) {
            *self.1 = largest_of_numbers(self.0);
        }
    }
    let mut largest = 0.0;
    quickly(Largest(x, &mut largest));
    largest
}
