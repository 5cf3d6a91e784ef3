//! The numbers of the headline.

use flexarm_run::internals::rounded;

/// Truth: sums of the printed numbers.
#[test]
fn rounded_parts_add_up_to_the_rounded_whole() {
    assert_eq!(rounded(&[1.414, 4.606], 6.02, 2), ["1.41", "4.61"]);
    assert_eq!(rounded(&[1.4157, 4.6051], 6.0208, 2), ["1.42", "4.60"]);
    assert_eq!(rounded(&[-0.126, 1.135], 1.009, 2), ["-0.13", "1.14"]);
    assert_eq!(rounded(&[-0.001, 1.0], 0.999, 2), ["0.00", "1.00"]);
    // Parts that do not add up stay as they are.
    assert_eq!(rounded(&[1.0, 2.0], 5.0, 1), ["1.0", "2.0"]);
    assert!(rounded(&[], 1.0, 2).is_empty());
}
