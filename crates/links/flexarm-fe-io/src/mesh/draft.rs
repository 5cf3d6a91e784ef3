//! Data collected by a reader, and the checks that turn it into a [`Mesh`].
//!
//! Start at [`Draft::finish`]. A draft has the numbers and units of the file, a mesh indices and
//! SI. Not here: formats ([`super::gmsh`], [`super::inp`]), quality of elements (`flexarm_fem`).

use std::collections::{BTreeMap, HashMap};

use nalgebra::Vector3;

use super::ids::IdIndex;
use super::source::Source;
use crate::FeFileError;
use flexarm_fem::mesh::{ElementBlock, ElementKind, Mesh, Region, corner_count, turn_reversed};
use flexarm_fem::units::UnitSystem;
use flexarm_settings::listed;

/// Nodes, elements and regions in the numbers and units of the file. Offsets are for messages.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) node_ids: Vec<u64>,
    pub(super) nodes: Vec<Vector3<f64>>,
    pub(super) node_offsets: Vec<usize>,
    pub(super) blocks: Vec<DraftBlock>,
    pub(super) regions: Vec<Region>,
    pub(super) warnings: Vec<String>,
    block_of: HashMap<(ElementKind, usize), usize>,
}

/// Elements of one kind in one region, with the node numbers of the file.
pub(super) struct DraftBlock {
    pub(super) kind: ElementKind,
    pub(super) region: usize,
    pub(super) ids: Vec<u64>,
    pub(super) offsets: Vec<usize>,
    pub(super) nodes: Vec<u64>,
}

impl Draft {
    pub(super) fn add_node(&mut self, id: u64, p: Vector3<f64>, offset: usize) {
        self.node_ids.push(id);
        self.nodes.push(p);
        self.node_offsets.push(offset);
    }

    /// Returns the block for elements of a kind in a region, creating it if needed.
    pub(super) fn block(&mut self, kind: ElementKind, region: usize) -> &mut DraftBlock {
        let blocks = &mut self.blocks;
        let k = *self.block_of.entry((kind, region)).or_insert_with(|| {
            blocks.push(DraftBlock { kind, region, ids: vec![], offsets: vec![], nodes: vec![] });
            blocks.len() - 1
        });
        &mut blocks[k]
    }

    /// Keeps the regions for which `keep` is true, with their elements. Returns the number of
    /// removed elements.
    pub(super) fn retain_regions(&mut self, keep: &[bool]) -> usize {
        let before: usize = self.blocks.iter().map(|block| block.ids.len()).sum();
        let new_index: Vec<usize> = keep
            .iter()
            .scan(0, |next, keep| {
                *next += usize::from(*keep);
                Some(next.wrapping_sub(1))
            })
            .collect();
        self.blocks.retain(|block| keep[block.region]);
        self.blocks.iter_mut().for_each(|block| block.region = new_index[block.region]);
        let mut flags = keep.iter();
        self.regions.retain(|_| flags.next().copied().unwrap_or(true));
        self.block_of.clear();
        before - self.blocks.iter().map(|block| block.ids.len()).sum::<usize>()
    }

    /// Checks the nodes: unique numbers, finite positions, not too many.
    pub(super) fn index_nodes(&self, src: &Source) -> Result<IdIndex, FeFileError> {
        if self.nodes.len() >= u32::MAX as usize {
            let found = format!("{} nodes", self.nodes.len());
            return Err(src.error_in_file("mesh", found, "fewer than 4294967295 nodes"));
        }
        if let Some(k) = self.nodes.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            let (element, found) = (format!("node {}", self.node_ids[k]), format!("{:?}", self.nodes[k].as_slice()));
            return Err(src.error(self.node_offsets[k], element, found, "finite coordinates"));
        }
        IdIndex::new(&self.node_ids).map_err(|(_, again)| {
            let element = format!("node {}", self.node_ids[again]);
            let offset = self.node_offsets[again];
            src.error(offset, element, "a second node with this number", "every node once")
        })
    }

    /// Checks the elements and sets, and makes the mesh in SI.
    pub(super) fn finish(
        self,
        src: &Source,
        index: &IdIndex,
        sets: Vec<(String, Vec<u32>)>,
        units: &UnitSystem,
    ) -> Result<(Mesh, Vec<String>), FeFileError> {
        // Elements: node numbers to indices.
        let mut warnings = self.warnings;
        let mut blocks = Vec::with_capacity(self.blocks.len());
        for block in self.blocks.iter().filter(|block| !block.ids.is_empty()) {
            blocks.push(resolve(src, index, block)?);
        }
        if blocks.is_empty() {
            let error = src.error_in_file("mesh", "no volume elements", "at least one");
            return Err(error.help("was only the surface meshed, or are the volumes in no physical group?"));
        }
        refuse_twins(src, &self.blocks, &blocks)?;

        // Sets, sorted and without duplicates.
        let mut node_sets = BTreeMap::new();
        for (name, mut nodes) in sets {
            nodes.sort_unstable();
            nodes.dedup();
            if nodes.is_empty() {
                warnings.push(format!("node set {name:?} is empty and was left out"));
                continue;
            }
            node_sets.insert(name, nodes);
        }
        // The mesh in SI; elements that are inside out are turned.
        let nodes = self.nodes.into_iter().map(|p| p * units.length).collect();
        let mut mesh = Mesh { nodes, node_ids: self.node_ids, blocks, regions: self.regions, node_sets };
        warnings.extend(turn_reversed(&mut mesh));
        let used = mesh.used_nodes();
        if used.contains(&false) {
            let unused = used.iter().zip(&mesh.node_ids).filter(|(used, _)| !**used).map(|(_, id)| id);
            let count = used.iter().filter(|used| !**used).count();
            warnings.push(format!("{count} nodes belong to no element (numbers {})", listed(unused)));
        }
        Ok((mesh, warnings))
    }
}

/// Converts node numbers to indices; rejects missing and repeated nodes.
fn resolve(src: &Source, index: &IdIndex, block: &DraftBlock) -> Result<ElementBlock, FeFileError> {
    let n = block.kind.nodes();
    let mut connectivity = Vec::with_capacity(block.nodes.len());
    for (k, nodes) in block.nodes.chunks_exact(n).enumerate() {
        let fault = |found: String, expected: &str| {
            let element = format!("{} element {}", block.kind.name(), block.ids[k]);
            src.error(block.offsets[k], element, found, expected)
        };
        for id in nodes {
            let Some(node) = index.get(*id) else {
                return Err(fault(format!("node {id}"), "a node of the file"));
            };
            connectivity.push(node);
        }
        let mut sorted = [u64::MAX; 20];
        sorted[..n].copy_from_slice(nodes);
        sorted[..n].sort_unstable();
        if let Some(pair) = sorted[..n].windows(2).find(|pair| pair[0] == pair[1]) {
            let found = format!("node {} twice", pair[0]);
            return Err(fault(found, "different nodes").help("a collapsed element: mesh it anew"));
        }
    }
    Ok(ElementBlock { kind: block.kind, region: block.region, ids: block.ids.clone(), connectivity })
}

/// Rejects two elements with the same corners.
fn refuse_twins(src: &Source, drafts: &[DraftBlock], blocks: &[ElementBlock]) -> Result<(), FeFileError> {
    // (sorted corners, place) of every element; duplicates are adjacent after sorting.
    let mut keys: Vec<([u32; 8], (u32, u32))> = Vec::with_capacity(blocks.iter().map(ElementBlock::len).sum());
    for (b, block) in (0..).zip(blocks) {
        let corners = corner_count(block.kind);
        for (k, nodes) in (0..).zip(block.elements()) {
            let mut key = [u32::MAX; 8];
            key[..corners].copy_from_slice(&nodes[..corners]);
            key[..corners].sort_unstable();
            keys.push((key, (b, k)));
        }
    }
    keys.sort_unstable();
    let Some(pair) = keys.windows(2).find(|pair| pair[0].0 == pair[1].0) else { return Ok(()) };

    let filled: Vec<&DraftBlock> = drafts.iter().filter(|block| !block.ids.is_empty()).collect();
    let [(first, id, offset), (second, twin, again)] = [pair[0].1, pair[1].1].map(|(b, k)| {
        let block = filled[b as usize];
        (block.region, block.ids[k as usize], block.offsets[k as usize])
    });
    let help = if first == second {
        "was a volume meshed or written twice?"
    } else {
        "it is in two regions: leave it in one physical volume or element set"
    };
    let element = format!("elements {} and {}", id.min(twin), id.max(twin));
    Err(src.error(offset.max(again), element, "the same corner nodes", "every element once").help(help))
}
