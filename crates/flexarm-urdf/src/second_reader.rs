//! Whether Rerun and other programs read the file: they do it with `urdf_rs`, which is asked.
//!
//! It reads a description twice with slow readers, for longer than a short run takes. So it is only asked about files that
//! have more than what it is known to read ([`is_plain`]): elements and attributes of links and joints, each in its place.

use flexarm_kinematics::Mechanism;
use roxmltree::Node;

use crate::finding::Place;
use crate::report::Report;

/// Says so if `urdf_rs` refuses the file or sees another robot.
pub(crate) fn ask(text: &str, root: Node<'_, '_>, mechanism: &Mechanism, place: &Place, report: &mut Report) {
    let (links, joints) = (mechanism.links.len(), mechanism.joints.len());
    if is_plain(text, root) && count(root, "link") == links && count(root, "joint") == joints {
        return;
    }
    let message = match urdf_rs::read_from_string(text) {
        Ok(other) if other.links.len() == links && other.joints.len() == joints => return,
        Ok(_) => "urdf-rs sees other links and joints in this file".to_owned(),
        Err(error) => format!("urdf-rs refuses this file: {error}"),
    };
    let help = "flexarm reads it; Rerun and other viewers built on urdf-rs may not show the robot";
    report.warning(place, "other-readers", message, help);
}

/// Whether the text has nothing but what `urdf_rs` is known to read, with all the links and joints below its root.
fn is_plain(text: &str, root: Node<'_, '_>) -> bool {
    has_plain_characters(text) && fits(root, &ROBOT)
}

/// Printed ASCII without entities, name spaces, CDATA; comments without anything that could end them too early.
fn has_plain_characters(text: &str) -> bool {
    let declared = ["<?xml version=\"1.0\"?>", "<?xml version=\"1.0\" encoding=\"UTF-8\"?>"];
    let declared = declared.iter().find_map(|declaration| text.strip_prefix(declaration));
    let mut text = declared.or_else(|| text.strip_prefix("<?xml version=\"1.0\" encoding=\"utf-8\"?>")).unwrap_or(text);
    let plain = |byte: u8| matches!(byte, b'\n' | b' '..=b'~') && byte != b'&';
    if !text.bytes().all(plain) || ["xml", "<?", "<![", "<!D"].iter().any(|part| text.contains(part)) {
        return false;
    }
    while let Some((_, rest)) = text.split_once("<!--") {
        let Some((comment, rest)) = rest.split_once("-->") else { return false };
        if comment.contains(['<', '>']) || comment.contains("--") || comment.starts_with('-') || comment.ends_with('-')
        {
            return false;
        }
        text = rest;
    }
    true
}

fn count(root: Node<'_, '_>, name: &str) -> usize {
    root.children().filter(|child| child.tag_name().name() == name).count()
}

/// What an attribute holds.
#[derive(Clone, Copy)]
enum Kind {
    Word,
    /// So many numbers.
    Numbers(usize),
    JointType,
}

impl Kind {
    fn takes(self, value: &str) -> bool {
        let is_number = |word: &str| word.parse::<f64>().is_ok();
        match self {
            Self::Word => !value.trim().is_empty() && !value.contains(['<', '>', '\'', '"', '\n']),
            // Of more than one number the words are divided by white space.
            Self::Numbers(1) => is_number(value.trim()),
            Self::Numbers(n) => value.split_whitespace().count() == n && value.split_whitespace().all(is_number),
            Self::JointType => matches!(value, "revolute" | "continuous" | "prismatic" | "fixed"),
        }
    }
}

/// How often an element stands in another one.
#[derive(Clone, Copy, PartialEq)]
enum Times {
    Once,
    AtMostOnce,
    Any,
}

/// Most kinds of elements in one.
const MOST_ELEMENTS: usize = 7;

/// An element: its attributes, and whether they must be there; the elements in it, in any order.
struct Form {
    attributes: &'static [(&'static str, Kind, bool)],
    elements: &'static [(&'static str, &'static Form, Times)],
    /// Whether other elements are passed over.
    open: bool,
    /// What must be true besides.
    also: fn(Node<'_, '_>) -> bool,
}

const NUMBER: Kind = Kind::Numbers(1);
static ROBOT: Form = Form {
    attributes: &[("name", Kind::Word, true)],
    elements: &[("link", &LINK, Times::Any), ("joint", &JOINT, Times::Any), ("material", &MATERIAL, Times::Any)],
    open: true,
    also: nothing_else,
};
static LINK: Form = Form {
    attributes: &[("name", Kind::Word, true)],
    elements: &[
        ("inertial", &INERTIAL, Times::AtMostOnce),
        ("visual", &VISUAL, Times::Any),
        ("collision", &COLLISION, Times::Any),
    ],
    open: true,
    also: visuals_stand_together,
};
static INERTIAL: Form = Form {
    attributes: &[],
    elements: &[
        ("origin", &ORIGIN, Times::AtMostOnce),
        ("mass", &closed(&[("value", NUMBER, true)]), Times::Once),
        (
            "inertia",
            &closed(&[
                ("ixx", NUMBER, true),
                ("ixy", NUMBER, true),
                ("ixz", NUMBER, true),
                ("iyy", NUMBER, true),
                ("iyz", NUMBER, true),
                ("izz", NUMBER, true),
            ]),
            Times::Once,
        ),
    ],
    open: false,
    also: nothing_else,
};
static VISUAL: Form = Form {
    attributes: &[("name", Kind::Word, false)],
    elements: &[
        ("origin", &ORIGIN, Times::AtMostOnce),
        ("geometry", &GEOMETRY, Times::Once),
        ("material", &MATERIAL, Times::AtMostOnce),
    ],
    open: false,
    also: nothing_else,
};
static COLLISION: Form = Form {
    attributes: &[("name", Kind::Word, false)],
    elements: &[("origin", &ORIGIN, Times::AtMostOnce), ("geometry", &GEOMETRY, Times::Once)],
    open: false,
    also: nothing_else,
};
static GEOMETRY: Form = Form {
    attributes: &[],
    elements: &[
        ("box", &closed(&[("size", Kind::Numbers(3), true)]), Times::AtMostOnce),
        ("cylinder", &closed(&[("radius", NUMBER, true), ("length", NUMBER, true)]), Times::AtMostOnce),
        ("sphere", &closed(&[("radius", NUMBER, true)]), Times::AtMostOnce),
        ("mesh", &closed(&[("filename", Kind::Word, true), ("scale", Kind::Numbers(3), false)]), Times::AtMostOnce),
    ],
    open: false,
    also: is_one_shape,
};
static MATERIAL: Form = Form {
    attributes: &[("name", Kind::Word, true)],
    elements: &[
        ("color", &closed(&[("rgba", Kind::Numbers(4), true)]), Times::AtMostOnce),
        ("texture", &closed(&[("filename", Kind::Word, true)]), Times::AtMostOnce),
    ],
    open: false,
    also: nothing_else,
};
static JOINT: Form = Form {
    attributes: &[("name", Kind::Word, true), ("type", Kind::JointType, true)],
    elements: &[
        ("origin", &ORIGIN, Times::AtMostOnce),
        ("parent", &closed(&[("link", Kind::Word, true)]), Times::Once),
        ("child", &closed(&[("link", Kind::Word, true)]), Times::Once),
        ("axis", &closed(&[("xyz", Kind::Numbers(3), true)]), Times::AtMostOnce),
        (
            "limit",
            &closed(&[
                ("lower", NUMBER, false),
                ("upper", NUMBER, false),
                ("effort", NUMBER, false),
                ("velocity", NUMBER, true),
            ]),
            Times::AtMostOnce,
        ),
        ("dynamics", &closed(&[("damping", NUMBER, false), ("friction", NUMBER, false)]), Times::AtMostOnce),
        (
            "mimic",
            &closed(&[("joint", Kind::Word, true), ("multiplier", NUMBER, false), ("offset", NUMBER, false)]),
            Times::AtMostOnce,
        ),
    ],
    open: false,
    also: nothing_else,
};
static ORIGIN: Form = closed(&[("xyz", Kind::Numbers(3), false), ("rpy", Kind::Numbers(3), false)]);

/// An element with nothing in it.
const fn closed(attributes: &'static [(&'static str, Kind, bool)]) -> Form {
    Form { attributes, elements: &[], open: false, also: nothing_else }
}

fn nothing_else(_: Node<'_, '_>) -> bool {
    true
}

fn is_one_shape(geometry: Node<'_, '_>) -> bool {
    geometry.children().filter(Node::is_element).count() == 1
}

/// A list that another element interrupts is two lists, which `urdf_rs` refuses; it moves all but masses behind visuals itself.
fn visuals_stand_together(link: Node<'_, '_>) -> bool {
    let names = link.children().map(|child| child.tag_name().name());
    let mut runs = names.filter(|name| matches!(*name, "visual" | "inertial")).collect::<Vec<_>>();
    runs.dedup();
    runs.len() <= 2
}

/// Whether an element has its form, and so have all in it.
fn fits(node: Node<'_, '_>, form: &Form) -> bool {
    let takes = |name: &str, value: &str| {
        form.attributes.iter().find(|(known, ..)| *known == name).is_some_and(|(_, kind, _)| kind.takes(value))
    };
    let attributes = node.attributes().all(|a| takes(a.name(), a.value()))
        && form.attributes.iter().all(|(name, _, needed)| !needed || node.has_attribute(*name));
    if !attributes || !(form.also)(node) {
        return false;
    }
    let mut found = [0; MOST_ELEMENTS];
    for child in node.children() {
        let known = form.elements.iter().position(|(name, ..)| child.has_tag_name(*name));
        let fitting = match known {
            Some(k) => {
                found[k] += 1;
                fits(child, form.elements[k].1)
            }
            None if child.is_element() => form.open,
            None => child.is_comment() || child.text().is_none_or(|text| text.trim().is_empty()),
        };
        if !fitting {
            return false;
        }
    }
    form.elements.iter().zip(found).all(|((.., times), found)| match times {
        Times::Once => found == 1,
        Times::AtMostOnce => found <= 1,
        Times::Any => true,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use roxmltree::Document;

    use super::*;

    fn plain(text: &str) -> bool {
        Document::parse(text).is_ok_and(|document| is_plain(text, document.root_element()))
    }

    /// Links and joints that `urdf_rs` sees.
    fn theirs(text: &str) -> Option<(usize, usize)> {
        urdf_rs::read_from_string(text).ok().map(|robot| (robot.links.len(), robot.joints.len()))
    }

    /// Second algorithm: what is plain is read by `urdf_rs`, with as many links and joints. All shipped files are plain.
    #[test]
    fn shipped_robots_are_plain_and_read_by_others() {
        let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots");
        let mut found = 0;
        for folder in std::fs::read_dir(robots).unwrap().flatten() {
            for file in std::fs::read_dir(folder.path()).into_iter().flatten().flatten() {
                let path = file.path();
                if path.extension().is_none_or(|ending| ending != "urdf") {
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let document = Document::parse(&text).unwrap();
                let root = document.root_element();
                assert!(is_plain(&text, root), "{}", path.display());
                assert_eq!(theirs(&text), Some((count(root, "link"), count(root, "joint"))), "{}", path.display());
                found += 1;
            }
        }
        assert!(found >= 10, "{found}");
    }

    const WHOLE: &str = r#"<?xml version="1.0"?>
<!-- A robot - made up. -->
<robot name="r">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/><texture filename="grey.png"/></material>
  <link name="a"/>
  <link name="b">
    <inertial><origin xyz="0 0 1" rpy="0 0 0"/><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual name="v"><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry><material name="grey"/></visual>
    <visual><geometry><mesh filename="package://r/b.stl" scale="1 1 1"/></geometry><!-- seen --></visual>
    <collision><geometry><cylinder radius="1" length="2"/></geometry></collision>
    <collision name="c"><origin rpy="0 0 1"/><geometry><sphere radius="1"/></geometry></collision>
  </link>
  <link name="c"><visual><geometry><sphere radius="2"/></geometry></visual><contact><k value="1"/></contact></link>
  <joint name="ab" type="revolute">
    <parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/><dynamics damping="1" friction="2"/>
  </joint>
  <joint name="bc" type="prismatic">
    <parent link="b"/><child link="c"/><limit velocity="1"/><mimic joint="ab" multiplier="2" offset="0.1"/>
  </joint>
  <transmission name="t"><type>simple</type><joint name="ab"/></transmission>
</robot>
"#;

    #[test]
    fn what_is_known_is_plain_and_what_is_not_is_asked() {
        assert!(plain(WHOLE));
        assert_eq!(theirs(WHOLE), Some((3, 2)));
        for (from, to) in [
            ("name=\"r\"", "name=\"r\" version=\"1.2\""),
            ("name=\"r\"", "name=\"r\" xmlns:x=\"urn:x\""),
            ("name=\"b\"", "name=\"b&amp;\""),
            ("made up", "made -> up"),
            (" velocity=\"2\"", ""),
            ("size=\"1 2 3\"", "size=\"1 2\""),
            ("<box size=\"1 2 3\"/>", "<box size=\"1 2 3\"/><box size=\"1 2 3\"/>"),
            ("prismatic", "screw"),
        ] {
            let text = WHOLE.replacen(from, to, 1);
            assert!(text != WHOLE && !plain(&text), "{from} {to}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Second algorithm: pieces of the file are dropped, doubled and exchanged. What still is plain is read by `urdf_rs`.
        #[test]
        fn whatever_is_plain_is_read_by_others(
            changes in prop::collection::vec((0usize..400, 0usize..400, 0u8..5), 1..4),
        ) {
            // Tags, and the words of tags.
            let mut pieces: Vec<&str> = WHOLE.split_inclusive(['>', ' ']).collect();
            for (at, from, how) in changes {
                let (at, from) = (at % pieces.len(), from % pieces.len());
                match how {
                    0 => drop(pieces.remove(at)),
                    1 => pieces.insert(at, pieces[at]),
                    2 => pieces[at] = pieces[from],
                    3 => pieces.swap(at, from),
                    _ => {
                        // A whole element, if it is one.
                        let end = (at + 6).min(pieces.len());
                        let part: Vec<&str> = pieces.drain(at..end).collect();
                        let to = from.min(pieces.len());
                        pieces.splice(to..to, part);
                    }
                }
            }
            let text = pieces.concat();
            if plain(&text) {
                let document = Document::parse(&text).unwrap();
                let root = document.root_element();
                prop_assert_eq!(theirs(&text), Some((count(root, "link"), count(root, "joint"))), "{}", text);
            }
        }
    }
}
