//! Errors of a program that the arm cannot run.

use flexarm_trajectory::TrajectoryError;

use crate::curve::ArcError;
use crate::follow::Blocked;
use crate::program::Item;
use crate::range::OutOfRange;

/// Error for a program that the arm cannot run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PathError {
    /// The program has no move.
    #[error("the program has no move")]
    NoMove,
    /// Tool path from an unknown start.
    #[error(
        "line {line}: {statement}: the program begins with a move of the tool, and where it starts is not known: begin with a \
         joint move, or tell a start"
    )]
    NoStart {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
    },
    /// More axis values than the arm has axes.
    #[error("line {line}: {statement}: {found} axis values for an arm of {axes} axes")]
    Axes {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Number of values.
        found: usize,
        /// Number of axes of the arm.
        axes: usize,
    },
    /// No joint values reach the target.
    #[error("line {line}: {statement}: no joint values bring the tool there: {why}")]
    Unreachable {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Reason.
        why: String,
    },
    /// A path that leaves the workspace or passes a singular pose.
    #[error("line {line}: {statement}: {why}")]
    Blocked {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Place and cause as numbers.
        blocked: Blocked,
        /// The same as a sentence.
        why: String,
    },
    /// Three points that do not define a circle.
    #[error("line {line}: {statement}: {source}")]
    Arc {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Cause.
        source: ArcError,
    },
    /// Number that is not finite, or outside the range of a robot.
    #[error("line {line}: {statement}: {source}")]
    Value {
        /// Line.
        line: usize,
        /// Statement.
        statement: String,
        /// Cause.
        source: OutOfRange,
    },
    /// No time law was found.
    #[error("line {line}: {statement}: {why}")]
    Law {
        /// Line of the first move up to the next stop.
        line: usize,
        /// Statement.
        statement: String,
        /// Reason.
        why: String,
    },
    /// The joint trajectory is invalid.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

impl PathError {
    pub(crate) fn out_of_range(item: &Item, source: OutOfRange) -> Self {
        match item {
            Item::Move(of) => Self::Value { line: of.line, statement: of.statement.clone(), source },
            Item::Dwell { line, .. } => Self::Value { line: *line, statement: "wait".to_owned(), source },
        }
    }
}
