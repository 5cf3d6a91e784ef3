//! Sections of MSH 2: counts are text, the rest is text or binary.
//!
//! Start at [`nodes`] and [`elements`]. Not here: MSH 4 (`msh4.rs`), node order (`shapes.rs`).

use nalgebra::Vector3;

use super::collector::Collector;
use super::reader::{Layout, Reader};
use super::shapes::MAX_NODES;
use crate::FeFileError;

/// Reads `$Nodes`: number and position of each node.
pub(super) fn nodes(reader: &mut Reader, collector: &mut Collector) -> Result<(), FeFileError> {
    let count = text_count(reader, "number of nodes")?;
    let count = reader.checked(count, "number of nodes", [1, 0, 3])?;
    for _ in 0..count {
        let at = reader.pos;
        let id = reader.id("node number")?;
        let p = Vector3::new(reader.real("x of a node")?, reader.real("y of a node")?, reader.real("z of a node")?);
        collector.draft.add_node(id, p, at + usize::from(reader.layout == Layout::Ascii));
    }
    Ok(())
}

/// Reads `$Elements`: one per line in text, runs of one type in binary.
pub(super) fn elements(reader: &mut Reader, collector: &mut Collector) -> Result<(), FeFileError> {
    let count = text_count(reader, "number of elements")?;
    let ascii = reader.layout == Layout::Ascii;
    let count = reader.checked(count, "number of elements", [if ascii { 4 } else { 2 }, 0, 0])?;
    let mut done = 0;
    let mut nodes = [0_u64; MAX_NODES];
    while done < count {
        let at = reader.pos;
        let first_id = if ascii { reader.id("element number")? } else { 0 };
        let number = reader.int("element type")?;
        let shape = collector.shape(reader, at, number)?;
        let run = if ascii { 1 } else { reader.id("number of elements of one type")? };
        let tag_count = reader.id("number of tags")?;
        let tag_count = reader.checked(tag_count, "number of tags", [1, 0, 0])?;
        let each = usize::from(!ascii) + tag_count.saturating_add(shape.nodes);
        let run = reader.checked(run, "number of elements of one type", [each, 0, 0])?;
        for _ in 0..run {
            let at = if ascii { at + 1 } else { reader.pos };
            let id = if ascii { first_id } else { reader.id("element number")? };
            // The first tag is the physical group, 0 for none; then geometry and partitions.
            let mut group = 0;
            for k in 0..tag_count {
                let tag = reader.int("tag")?;
                group = if k == 0 { tag.abs() } else { group };
            }
            for node in &mut nodes[..shape.nodes] {
                *node = reader.id("node of an element")?;
            }
            let groups: &[i64] = if group == 0 { &[] } else { &[group] };
            collector.element(&reader.src, &shape, id, at, groups, &nodes[..shape.nodes])?;
        }
        done += run;
    }
    Ok(())
}

/// Reads a count on its own line, which is text in binary files as well.
fn text_count(reader: &mut Reader, what: &str) -> Result<u64, FeFileError> {
    let layout = std::mem::replace(&mut reader.layout, Layout::Ascii);
    let count = reader.size(what);
    if layout != Layout::Ascii {
        reader.rest_of_line();
    }
    reader.layout = layout;
    count
}
