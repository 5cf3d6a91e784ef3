//! Settling in words.

use flexarm_run::{HoldFigures, Settling, TcpFigures};

fn with_stops(settling: &[Option<f64>]) -> TcpFigures {
    let hold = |(k, settling_s): (usize, &Option<f64>)| HoldFigures {
        start_s: k as f64,
        end_s: k as f64 + 0.5,
        settling_s: *settling_s,
        ..HoldFigures::default()
    };
    TcpFigures { holds: settling.iter().enumerate().map(hold).collect(), ..TcpFigures::default() }
}

#[test]
fn the_stop_that_takes_longest_counts() {
    let settling = with_stops(&[Some(0.1), Some(0.3), Some(0.0)]).settling_state();
    assert_eq!(settling, Settling::Settled { after_s: 0.3, stop: Some(2), of: 3 });
    assert_eq!(settling.note("within 0.1 mm"), "at stop 2, the longest of 3, within 0.1 mm");
}

#[test]
fn a_stop_that_never_settles_is_not_hidden_by_one_that_does() {
    let settling = with_stops(&[None, None, Some(0.0)]).settling_state();
    assert_eq!((settling.time_s(), settling.short()), (None, "not settled"));
    let words = "not settled at stop 1, which lasts 0.500 s, stop 2, which lasts 0.500 s (2 of 3 stops), within 0.1 mm";
    assert_eq!(settling.note("within 0.1 mm"), words);
}

#[test]
fn without_a_stop_nothing_is_said_to_settle() {
    assert_eq!(with_stops(&[]).settling_state(), Settling::NoStop);
    assert_eq!(with_stops(&[Some(0.0)]).settling_state().note(""), "after the move");
}
