//! User's assignment of table columns to the time and the joints.
//!
//! Start at [`ColumnMap`]; columns count from 1. Not here: assignment by the names of the header
//! (`table/layout.rs`).

use std::str::FromStr;

/// Assignment of table columns to the time and the joints. Without one, the names in the header
/// decide.
///
/// ```
/// use flexarm_trajectory::ColumnMap;
///
/// let typed = ColumnMap::default().with_time("Time[ms]").with_joint("joint_1", "A1[deg]");
/// assert_eq!("t=Time[ms],joint_1=A1[deg]".parse(), Ok(typed));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMap {
    /// Time column.
    pub time: Option<String>,
    /// Joints and their columns. A column is given by its full name in the header, by its name
    /// without the unit, by its name with another unit in brackets (`A1[deg]`), or by its number
    /// from 1 (`#2[rad]`).
    pub joints: Vec<(String, String)>,
}

impl ColumnMap {
    /// Sets the time column.
    #[must_use]
    pub fn with_time(mut self, column: &str) -> Self {
        self.time = Some(column.to_owned());
        self
    }

    /// Adds the column of a joint.
    #[must_use]
    pub fn with_joint(mut self, joint: &str, column: &str) -> Self {
        self.joints.push((joint.to_owned(), column.to_owned()));
        self
    }
}

/// Text that is not a valid column map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{found:?}: expected pairs such as t=Time[s],joint_1=A1[deg] with t (or time) and the names of joints before the signs"
)]
pub struct ColumnMapError {
    /// The invalid part.
    pub found: String,
}

impl FromStr for ColumnMap {
    type Err = ColumnMapError;

    /// Parses pairs such as `t=Time[s],joint_1=A1[deg]`; `t` and `time` both mean the time.
    fn from_str(text: &str) -> Result<Self, ColumnMapError> {
        let mut map = Self::default();
        for pair in text.split(',').filter(|pair| !pair.trim().is_empty()) {
            let wrong = || ColumnMapError { found: pair.to_owned() };
            let (name, column) = pair.split_once('=').ok_or_else(wrong)?;
            let (name, column) = (name.trim(), column.trim());
            let is_repeated = map.joints.iter().any(|(joint, _)| joint == name);
            if name.is_empty() || column.is_empty() || is_repeated {
                return Err(wrong());
            }
            match name {
                "t" | "time" if map.time.is_none() => map.time = Some(column.to_owned()),
                "t" | "time" => return Err(wrong()),
                joint => map.joints.push((joint.to_owned(), column.to_owned())),
            }
        }
        if map == Self::default() {
            return Err(ColumnMapError { found: text.to_owned() });
        }
        Ok(map)
    }
}
