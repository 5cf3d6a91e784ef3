//! Columns of a map: names, units, order, and the direction of improvement.
//!
//! Start at [`Layout::new`]: rows are written in the same order by [`super::evaluate`]. Names end
//! in the unit.
//!
//! Not here: values of the poses (`evaluate.rs`), files (`files.rs`).

use flexarm_stepping::Plant;

use super::MapError;
use flexarm_chatter::CuttingTool;

/// Maximum number of natural frequencies of a map.
pub(super) const MAX_FREQUENCIES: usize = 12;

/// A column of a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapColumn {
    /// Name, which ends in the unit.
    pub name: String,
    /// Short description.
    pub meaning: String,
    /// Whether it is a result; otherwise it describes the pose.
    pub quantity: bool,
    /// Whether larger values are better, as for frequencies.
    pub more_is_better: bool,
}

impl MapColumn {
    /// Returns the cost to minimise: the value, or its negative where larger is better; infinite
    /// for non-finite values.
    #[doc(hidden)]
    pub fn cost(&self, value: f64) -> f64 {
        match self.more_is_better {
            _ if !value.is_finite() => f64::INFINITY,
            true => -value,
            false => value,
        }
    }
}

/// Returns the index with the minimum cost, the first of equal ones; infinite costs are ignored.
pub fn cheapest(count: usize, cost: impl Fn(usize) -> f64) -> Option<usize> {
    (0..count).filter(|&k| cost(k).is_finite()).min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
}

/// Columns of a row, in order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) columns: Vec<MapColumn>,
    pub(super) joints: usize,
    pub(super) frequencies: usize,
    pub(super) loaded: bool,
    pub(super) cuts: bool,
    /// Whether the full compliance matrix is included.
    pub(super) matrix: bool,
    /// Range of coordinates of each elastic element, after the joints.
    pub(super) elements: Vec<std::ops::Range<usize>>,
}

/// Columns before the joints: position of the rigid TCP, number of the place or instant, of the
/// tool direction, of the branch.
pub(super) const HEAD: [(&str, &str); 6] = [
    ("x_m", "position of the TCP of the rigid arm, world axes"),
    ("y_m", "position of the TCP of the rigid arm, world axes"),
    ("z_m", "position of the TCP of the rigid arm, world axes"),
    ("place", "index of the place (x varies fastest), or of the instant"),
    ("direction", "index of the tool direction"),
    ("branch", "index of the inverse kinematics solution"),
];

/// Index of the number of the place in [`HEAD`].
pub(super) const PLACE: usize = 3;

impl Layout {
    /// Lists the columns of a map.
    ///
    /// * `joints`: names, and whether they are prismatic.
    /// * `loaded`: whether a wrench acts in addition to gravity.
    /// * `tool`: a cutting tool.
    /// * `matrix`: whether to include the full compliance matrix.
    pub(super) fn new(
        plant: &Plant,
        joints: &[(String, bool)],
        loaded: bool,
        frequencies: usize,
        tool: Option<&CuttingTool>,
        matrix: bool,
    ) -> Self {
        let elastic = plant.model.n_elastic();
        let frequencies = frequencies.min(elastic).min(MAX_FREQUENCIES);
        // Place and pose.
        let mut columns: Vec<MapColumn> = HEAD.iter().map(|(name, meaning)| place(name, meaning)).collect();
        columns.extend(
            joints.iter().map(|(joint, slides)| {
                place(&format!("{joint}_{}", if *slides { "m" } else { "rad" }), "joint position")
            }),
        );
        // Displacements under gravity, and under the load as well.
        columns.extend(displacement("sag", "displacement of the TCP relative to the rigid arm under gravity"));
        if loaded {
            let meaning = "displacement of the TCP relative to the rigid arm under gravity and the load";
            columns.extend(displacement("error", meaning));
            columns.push(less("load_m", "displacement of the TCP due to the load"));
        }
        columns.extend(compliance(matrix));
        // Frequencies, limit of a cutting tool, shares of the elements.
        for k in 1..=frequencies {
            let column = less(&format!("frequency_{k}_hz"), "undamped natural frequency under gravity, drives locked");
            columns.push(MapColumn { more_is_better: true, ..column });
        }
        if let Some(tool) = tool {
            let rpm: Vec<String> = tool.rpm.iter().map(f64::to_string).collect();
            let (rpm, most) = (rpm.join(", "), tool.deepest);
            let meaning =
                format!("depth of cut above which {} chatters at {rpm} 1/min; {most} if it does not", tool.name);
            columns.push(MapColumn { more_is_better: true, ..less("depth_m", &meaning) });
        }
        let whole = if loaded { "error" } else { "sag" };
        for element in &plant.elements {
            let meaning = format!("share of the element in the {whole}, along the {whole}, first order");
            columns.push(MapColumn { quantity: true, ..place(&format!("share_{}", element.name), &meaning) });
        }
        let range = |first: usize, size: usize| first..first + size;
        let elements = plant.elements.iter().map(|element| range(plant.offset(element), element.size)).collect();
        Self { columns, joints: joints.len(), frequencies, loaded, cuts: tool.is_some(), matrix, elements }
    }

    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Returns the column by which poses are compared.
    ///
    /// # Errors
    /// [`MapError::Input`] if there is no such result column.
    pub(super) fn compared_by(&self, name: Option<&str>) -> Result<usize, MapError> {
        let usual = match (self.cuts, self.loaded) {
            (true, _) => "depth_m",
            (false, true) => "error_m",
            (false, false) => "compliance_worst_m_per_n",
        };
        let wanted = name.unwrap_or(usual);
        self.columns.iter().position(|c| c.quantity && c.name == wanted).ok_or_else(|| {
            let known: Vec<&str> = self.columns.iter().filter(|c| c.quantity).map(|c| &*c.name).collect();
            let known = known.join(", ");
            MapError::Input(format!("the map has no quantity {wanted:?} to compare poses by; it has {known}"))
        })
    }
}

fn place(name: &str, meaning: &str) -> MapColumn {
    MapColumn { name: name.to_owned(), meaning: meaning.to_owned(), quantity: false, more_is_better: false }
}

fn less(name: &str, meaning: &str) -> MapColumn {
    MapColumn { quantity: true, ..place(name, meaning) }
}

/// Columns of the compliance: along the axes, coupling between them, worst direction; with `matrix`
/// all entries.
fn compliance(matrix: bool) -> Vec<MapColumn> {
    let mut columns = Vec::new();
    for (axis, name) in ["compliance_x_m_per_n", "compliance_y_m_per_n", "compliance_z_m_per_n"].iter().enumerate() {
        columns.push(less(name, &format!("displacement along {} per force along it", ["x", "y", "z"][axis])));
    }
    for pair in ["xy", "xz", "yz"] {
        let (along, by) = pair.split_at(1);
        let meaning = format!("displacement along {along} per force along {by}, averaged with its transpose");
        columns.push(place(&format!("compliance_{pair}_m_per_n"), &meaning));
    }
    columns.push(less("compliance_worst_m_per_n", "maximum displacement per force over all directions"));
    for name in ["worst_x", "worst_y", "worst_z"] {
        columns.push(place(name, "direction of that force, world axes"));
    }
    columns.push(less("rotation_worst_rad_per_nm", "maximum rotation per moment over all directions"));
    if matrix {
        columns.extend(full_compliance());
    }
    columns
}

/// Columns of the 6×6 compliance, row by row: displacement and rotation per force and moment.
fn full_compliance() -> Vec<MapColumn> {
    let moved = [("x", "m"), ("y", "m"), ("z", "m"), ("rx", "rad"), ("ry", "rad"), ("rz", "rad")];
    let pushed = [("fx", "n"), ("fy", "n"), ("fz", "n"), ("tx", "nm"), ("ty", "nm"), ("tz", "nm")];
    let entry = |(row, unit): (&str, &str), (column, per): (&str, &str)| {
        let meaning = format!("entry of the 6x6 compliance: {row} of the TCP per {column} on it, world axes");
        place(&format!("c_{row}_{column}_{unit}_per_{per}"), &meaning)
    };
    moved.iter().flat_map(|row| pushed.iter().map(move |column| entry(*row, *column))).collect()
}

/// Columns of a displacement: components, norm, and angle.
fn displacement(what: &str, meaning: &str) -> Vec<MapColumn> {
    let mut columns: Vec<MapColumn> =
        ["x", "y", "z"].iter().map(|axis| place(&format!("{what}_{axis}_m"), meaning)).collect();
    columns.push(less(&format!("{what}_m"), meaning));
    columns.push(less(&format!("{what}_rad"), &format!("{meaning}: angle")));
    columns
}
