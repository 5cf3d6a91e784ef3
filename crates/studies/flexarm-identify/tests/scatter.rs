//! The bounds on the scatter of residuals.

use flexarm_identify::internals::chi_square_bounds;

#[test]
fn the_bounds_on_the_scatter_are_those_of_the_tables() {
    // Truth: lower and upper 0.1 % quantiles of χ² for 10 and 100 degrees of freedom.
    for (freedom, table) in [(10.0, [1.479, 29.588]), (100.0, [61.918, 149.449])] {
        for (found, table) in chi_square_bounds(freedom).into_iter().zip(table) {
            let found = found * freedom;
            assert!((found / table - 1.0).abs() < 0.08, "{found} for {table}"); // measured: 0.065 at the lower one of ten, else 6e-3
        }
    }
}
