//! Transmissions of a URDF.

use roxmltree::Node;

use crate::xml::elements;

/// A `<transmission>`, listed for information.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// Name.
    pub name: String,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Gear ratio, if given.
    pub reduction: Option<f64>,
}

/// Reads a `<transmission>`.
pub(crate) fn transmission(node: Node<'_, '_>) -> Transmission {
    let joints = elements(node).filter(|n| n.tag_name().name() == "joint");
    let reduction = node.descendants().find(|n| n.tag_name().name() == "mechanicalReduction");
    Transmission {
        name: node.attribute("name").unwrap_or("").to_owned(),
        joints: joints.filter_map(|j| j.attribute("name")).map(str::to_owned).collect(),
        reduction: reduction.and_then(|r| r.text()).and_then(|t| t.trim().parse().ok()),
    }
}
