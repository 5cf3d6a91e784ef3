//! The bound on the scatter of residuals.

use flexarm_identify::internals::chi_square_bound;

#[test]
fn the_bound_on_the_scatter_is_that_of_the_tables() {
    // Truth: upper 0.1 % quantiles of χ², 29.588 and 149.449 for 10 and 100 degrees of freedom.
    for (freedom, table) in [(10.0, 29.588), (100.0, 149.449)] {
        let found = chi_square_bound(freedom) * freedom;
        assert!((found / table - 1.0).abs() < 1e-2, "{found} for {table}"); // measured: 5.8e-3
    }
}
