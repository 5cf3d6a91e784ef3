//! Sections of MSH 4.1: the same numbers in the same order in text and binary.
//!
//! Start at [`entities`], [`nodes`] and [`elements`], one per section. Counts are checked against
//! the remaining bytes before anything is allocated. Not here: encoding of numbers
//! ([`super::reader`]), groups and regions ([`super::collector`]).

use nalgebra::Vector3;

use super::collector::Collector;
use super::reader::{Layout, Reader};
use super::shapes::MAX_NODES;
use crate::FeFileError;

/// Maximum number of physical groups of one entity.
const MAX_GROUPS: usize = 64;

/// Reads `$Entities`; only the physical groups of each are kept.
pub(super) fn entities(reader: &mut Reader, collector: &mut Collector) -> Result<(), FeFileError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = reader.size("number of entities")?;
    }
    for (dim, count) in (0_u8..).zip(counts) {
        // Points have a position, other entities a bounding box and a list of bounding entities.
        let reals = if dim == 0 { 3 } else { 6 };
        let count = reader.checked(count, "number of entities", [1, 1, reals])?;
        for _ in 0..count {
            let tag = reader.int("tag of an entity")?;
            for _ in 0..reals {
                reader.real("box of an entity")?;
            }
            let groups = tags(reader, "number of physical groups")?;
            if dim > 0 {
                tags(reader, "number of bounding entities")?;
            }
            if groups.len() > MAX_GROUPS {
                let (element, found) = (format!("entity {tag} of dimension {dim}"), format!("{} groups", groups.len()));
                let expected = format!("at most {MAX_GROUPS} physical groups");
                return Err(reader.src.error(reader.pos, element, found, expected));
            }
            if !groups.is_empty() {
                collector.entity(dim, tag, groups);
            }
        }
    }
    Ok(())
}

fn tags(reader: &mut Reader, what: &str) -> Result<Vec<i64>, FeFileError> {
    let count = reader.size(what)?;
    let count = reader.checked(count, what, [1, 0, 0])?;
    (0..count).map(|_| reader.int("tag").map(i64::abs)).collect()
}

/// Reads `$Nodes`: per entity the numbers of its nodes, then their positions.
pub(super) fn nodes(reader: &mut Reader, collector: &mut Collector) -> Result<(), FeFileError> {
    let block_count = header(reader)?;
    for _ in 0..block_count {
        let dim = reader.int("dimension of an entity")?;
        reader.int("tag of an entity")?;
        let parametric = reader.int("whether nodes have parameters")? != 0;
        let count = reader.size("number of nodes")?;
        let count = reader.checked(count, "number of nodes", [0, 1, 3])?;
        for _ in 0..count {
            collector.draft.node_ids.push(reader.size("node number")?);
        }
        for _ in 0..count {
            let at = reader.pos + usize::from(reader.layout == Layout::Ascii);
            let p = Vector3::new(reader.real("x of a node")?, reader.real("y of a node")?, reader.real("z of a node")?);
            collector.draft.nodes.push(p);
            collector.draft.node_offsets.push(at);
            let parameters = if parametric { dim.clamp(0, 3) } else { 0 };
            for _ in 0..parameters {
                reader.real("parameter of a node")?;
            }
        }
    }
    Ok(())
}

/// Reads `$Elements`: per entity and type the number and the nodes of each element.
pub(super) fn elements(reader: &mut Reader, collector: &mut Collector) -> Result<(), FeFileError> {
    let block_count = header(reader)?;
    let mut nodes = [0_u64; MAX_NODES];
    for _ in 0..block_count {
        let at = reader.pos + usize::from(reader.layout == Layout::Ascii);
        let dim = reader.int("dimension of an entity")?;
        let tag = reader.int("tag of an entity")?;
        let number = reader.int("element type")?;
        let shape = collector.shape(reader, at, number)?;
        if dim != i64::from(shape.dim) {
            let found = format!("a {} in an entity of dimension {dim}", shape.name);
            return Err(reader.src.error(at, "$Elements", found, format!("dimension {}", shape.dim)));
        }
        let count = reader.size("number of elements")?;
        let count = reader.checked(count, "number of elements", [0, 1 + shape.nodes, 0])?;
        let groups = collector.groups_of(shape.dim, tag);
        for _ in 0..count {
            let at = reader.pos + usize::from(reader.layout == Layout::Ascii);
            let id = reader.size("element number")?;
            for node in &mut nodes[..shape.nodes] {
                *node = reader.size("node of an element")?;
            }
            collector.element(&reader.src, &shape, id, at, &groups, &nodes[..shape.nodes])?;
        }
    }
    Ok(())
}

/// Reads the numbers of blocks and items, minimum and maximum number; returns only the first.
fn header(reader: &mut Reader) -> Result<usize, FeFileError> {
    let blocks = reader.size("number of entity blocks")?;
    for what in ["number in all", "smallest number", "largest number"] {
        reader.size(what)?;
    }
    reader.checked(blocks, "number of entity blocks", [3, 1, 0])
}
