//! Node selection by the user: as text on the command line, as text or table in a file.
//!
//! Start at [`NodeSelector`]. Lengths are in the unit of the mesh file.
//!
//! Not here: which nodes of a mesh it selects (`select`).

use std::fmt;
use std::str::FromStr;

use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Node selection. Lengths are in the unit of the mesh file.
///
/// Text form, as on a command line: `interface_A`, `"a name with & or ("`, `plane(0,0,0; 1,0,0)`,
/// `cylinder(0,0,0; 0,1,0; 0.05)`, `box(0,0,0; 1,1,1)`. A tolerance may follow as the last argument
/// of a plane, a cylinder or a box. Nodes must satisfy all terms joined by `&`.
///
/// In TOML either that text or a table: `{ plane = { point = [0, 0, 0], normal = [1, 0, 0] } }`.
///
/// ```
/// use flexarm_fem::NodeSelector;
/// let bore: NodeSelector = "cylinder(0,0,0; 0,1,0; 0.05) & box(-1,0,-1; 1,0.02,1)".parse()?;
/// assert_eq!(bore.to_string().parse::<NodeSelector>()?, bore);
/// # Ok::<(), flexarm_fem::mesh::SelectorSyntaxError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(remote = "Self", rename_all = "snake_case", deny_unknown_fields)]
pub enum NodeSelector {
    /// Node set of the mesh, by name.
    Set(String),
    /// Nodes of the skin in a plane.
    Plane {
        /// Point in the plane.
        point: [f64; 3],
        /// Normal of the plane, of any length.
        normal: [f64; 3],
        /// Maximum distance from the plane; 1e-6 of the diagonal of the mesh if not given.
        #[serde(default)]
        tolerance: Option<f64>,
    },
    /// Nodes of the skin on the wall of an infinite cylinder, such as a bore.
    Cylinder {
        /// Point on the axis.
        point: [f64; 3],
        /// Direction of the axis, of any length.
        axis: [f64; 3],
        /// Radius of the wall.
        radius: f64,
        /// Maximum distance from the wall; default as for a plane.
        #[serde(default)]
        tolerance: Option<f64>,
    },
    /// Nodes of the skin in an axis-aligned box, including its faces.
    Box {
        /// Minimum coordinates.
        min: [f64; 3],
        /// Maximum coordinates.
        max: [f64; 3],
        /// Maximum distance of a node outside the box; default as for a plane.
        #[serde(default)]
        tolerance: Option<f64>,
    },
    /// Nodes that all of these selectors select.
    All(Vec<NodeSelector>),
}

/// Syntax error in a node selection.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("node selection {text:?}: found {found}; expected {expected}")]
#[non_exhaustive]
pub struct SelectorSyntaxError {
    /// Term with the error.
    pub text: String,
    /// Text found.
    pub found: String,
    /// Text expected.
    pub expected: &'static str,
}

const FORMS: &str = "a set name, plane(x,y,z; nx,ny,nz), cylinder(x,y,z; ax,ay,az; radius) or box(x,y,z; x,y,z), \
                     each with an optional last tolerance, joined by &";

impl FromStr for NodeSelector {
    type Err = SelectorSyntaxError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        // Split at `&`, except inside quotes.
        let mut quoted = false;
        let terms = text.split(|c| {
            quoted ^= c == '"';
            c == '&' && !quoted
        });
        let mut terms = terms.map(term).collect::<Result<Vec<_>, _>>()?;
        match terms.len() {
            1 => Ok(terms.remove(0)),
            _ => Ok(Self::All(terms)),
        }
    }
}

/// Parses one term of the text form.
fn term(text: &str) -> Result<NodeSelector, SelectorSyntaxError> {
    let text = text.trim();
    let wrong = |found: String, expected| SelectorSyntaxError { text: text.to_owned(), found, expected };
    if text.is_empty() {
        return Err(wrong("nothing".into(), FORMS));
    }
    if let Some(name) = text.strip_prefix('"') {
        let name = name.strip_suffix('"').filter(|name| !name.contains('"'));
        return name.map(|name| NodeSelector::Set(name.into())).ok_or_else(|| wrong("one quote".into(), "two quotes"));
    }
    let Some((shape, rest)) = text.split_once('(') else { return Ok(NodeSelector::Set(text.to_owned())) };
    let inside = rest.strip_suffix(')').ok_or_else(|| wrong("no ) at the end".into(), FORMS))?;

    // Groups of one or three numbers, separated by `;`.
    let mut groups = Vec::new();
    for group in inside.split(';') {
        let numbers = group.split(',').map(|word| match word.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(wrong(format!("{:?}", word.trim()), "a finite number")),
        });
        groups.push(numbers.collect::<Result<Vec<_>, _>>()?);
    }
    let vector = |k: usize| groups.get(k).and_then(|group| <[f64; 3]>::try_from(group.as_slice()).ok());
    let number = |k: usize| groups.get(k).filter(|group| group.len() == 1).map(|group| group[0]);
    let shape = shape.trim().to_ascii_lowercase();
    let (form, built) = match shape.as_str() {
        "plane" => (
            "plane(x,y,z; nx,ny,nz) or plane(x,y,z; nx,ny,nz; tolerance)",
            vector(0).zip(vector(1)).map(|(point, normal)| NodeSelector::Plane { point, normal, tolerance: number(2) }),
        ),
        "cylinder" => (
            "cylinder(x,y,z; ax,ay,az; radius) or cylinder(x,y,z; ax,ay,az; radius; tolerance)",
            vector(0).zip(vector(1)).zip(number(2)).map(|((point, axis), radius)| NodeSelector::Cylinder {
                point,
                axis,
                radius,
                tolerance: number(3),
            }),
        ),
        "box" => (
            "box(x,y,z; x,y,z) or box(x,y,z; x,y,z; tolerance)",
            vector(0).zip(vector(1)).map(|(min, max)| NodeSelector::Box { min, max, tolerance: number(2) }),
        ),
        _ => return Err(wrong(format!("{shape:?}"), FORMS)),
    };
    // All groups must be used.
    let used = match &built {
        Some(NodeSelector::Cylinder { tolerance, .. }) => 3 + usize::from(tolerance.is_some()),
        Some(NodeSelector::Plane { tolerance, .. } | NodeSelector::Box { tolerance, .. }) => {
            2 + usize::from(tolerance.is_some())
        }
        _ => 0,
    };
    built.filter(|_| used == groups.len()).ok_or_else(|| wrong(format!("({inside})"), form))
}

impl fmt::Display for NodeSelector {
    /// Writes the text form.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triple = |[x, y, z]: &[f64; 3]| format!("{x},{y},{z}");
        let last = |tolerance: &Option<f64>| tolerance.map(|tolerance| format!("; {tolerance}")).unwrap_or_default();
        match self {
            Self::Set(name) if name.contains(['&', '(']) || name.trim() != name || name.is_empty() => {
                write!(f, "\"{name}\"")
            }
            Self::Set(name) => f.write_str(name),
            Self::Plane { point, normal, tolerance } => {
                write!(f, "plane({}; {}{})", triple(point), triple(normal), last(tolerance))
            }
            Self::Cylinder { point, axis, radius, tolerance } => {
                write!(f, "cylinder({}; {}; {radius}{})", triple(point), triple(axis), last(tolerance))
            }
            Self::Box { min, max, tolerance } => {
                write!(f, "box({}; {}{})", triple(min), triple(max), last(tolerance))
            }
            Self::All(terms) => {
                for (k, term) in terms.iter().enumerate() {
                    write!(f, "{}{term}", if k == 0 { "" } else { " & " })?;
                }
                Ok(())
            }
        }
    }
}

impl Serialize for NodeSelector {
    /// Serialises as text.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for NodeSelector {
    /// Deserialises from text or from a table.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TextOrTable;
        impl<'de> Visitor<'de> for TextOrTable {
            type Value = NodeSelector;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a choice of nodes: text such as \"interface_A\" or a table such as { plane = { ... } }")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<NodeSelector, E> {
                text.parse().map_err(E::custom)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NodeSelector, A::Error> {
                // Derived implementation (serde remote), an inherent function of the type.
                NodeSelector::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(TextOrTable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Interface {
        nodes: NodeSelector,
    }

    #[test]
    fn the_text_form_and_the_table_form_say_the_same() {
        for (text, table) in [
            ("\"interface_A\"", "{ set = \"interface_A\" }"),
            ("\"plane(0,0,0; 1,0,0)\"", "{ plane = { point = [0, 0, 0], normal = [1, 0, 0] } }"),
            (
                "\"Cylinder( 0,0, 1e-2 ;0,1,0; 0.05; 1e-4 )&A b\"",
                "{ all = [{ cylinder = { point = [0, 0, 0.01], axis = [0, 1, 0], radius = 0.05, tolerance = 1e-4 } }, \"A b\"] }",
            ),
            ("\"box(0,0,0; 1,1,1)\"", "{ box = { min = [0, 0, 0], max = [1, 1, 1] } }"),
        ] {
            let a: Interface = toml::from_str(&format!("nodes = {text}")).unwrap();
            let b: Interface = toml::from_str(&format!("nodes = {table}")).unwrap();
            assert_eq!(a, b);
            assert_eq!(toml::from_str::<Interface>(&toml::to_string(&a).unwrap()).unwrap(), a);
        }
    }

    #[test]
    fn a_set_name_with_special_characters_is_quoted_and_read_back() {
        let set = NodeSelector::Set("bolts (M8) & pins".into());
        assert_eq!(set.to_string(), "\"bolts (M8) & pins\"");
        assert_eq!(set.to_string().parse::<NodeSelector>().unwrap(), set);
    }

    #[test]
    fn wrong_text_is_answered_with_the_form_that_was_meant() {
        for (text, word) in [
            ("plane(0,0; 1,0,0)", "plane(x,y,z; nx,ny,nz)"),
            ("plane(0,0,0; 1,0,0; 1; 2)", "plane(x,y,z; nx,ny,nz)"),
            ("cylinder(0,0,0; 1,0,0)", "radius"),
            ("sphere(0,0,0; 1)", "cylinder"),
            ("plane(0,0,0; 1,x,0)", "\"x\""),
            ("box(0,0,0; 1,1,inf)", "finite"),
            ("A & ", "set name"),
            ("box(0,0,0; 1,1,1", "no )"),
        ] {
            let message = text.parse::<NodeSelector>().unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
        let message = toml::from_str::<Interface>("nodes = { plane = { point = [0,0,0] } }").unwrap_err().to_string();
        assert!(message.contains("normal"), "{message}");
    }
}
