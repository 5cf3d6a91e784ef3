//! Collects the elements of a Gmsh file by physical group.
//!
//! Start at [`Collector::element`] and [`Collector::finish`]. Groups of volumes become regions,
//! groups of lower dimension node sets, and groups of lines beams if the options name them.
//! Not here: the layout of the file ([`super::msh2`], [`super::msh4`]), checks of the mesh
//! ([`crate::mesh::draft`]).

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::reader::Reader;
use super::shapes::{Shape, advice, shape};
use crate::FeFileError;
use crate::mesh::draft::Draft;
use crate::mesh::ids::IdIndex;
use crate::mesh::read::ReadOptions;
use crate::mesh::source::Source;
use crate::number::shown;
use flexarm_fem::mesh::{ElementKind, Mesh, Region};
use flexarm_settings::listed;

/// Dimension and tag of a physical group; tag 0 means no group.
type GroupKey = (u8, i64);

/// Mesh data collected while the sections are read.
pub struct Collector {
    pub(super) draft: Draft,
    keep_lines: bool,
    names: HashMap<GroupKey, String>,
    entities: HashMap<(u8, i64), Vec<i64>>,
    /// Region of the draft for each group with elements.
    regions: HashMap<GroupKey, usize>,
    region_keys: Vec<GroupKey>,
    /// Nodes of each group.
    pub sets: BTreeMap<GroupKey, GroupNodes>,
    /// Total number of nodes of all sets, each counted when it was last tidied.
    kept: usize,
}

#[derive(Default)]
pub struct GroupNodes {
    pub ids: Vec<u64>,
    /// Number of them that are sorted and unique.
    tidied: usize,
    /// Offset of its first element.
    at: usize,
    /// Offset of a line with more than two nodes, if there is one.
    bent_line: Option<usize>,
}

/// A set is tidied when it has doubled since the last time and grown by more than this number.
const FEW: usize = 32;

/// Maximum number of nodes in all sets: constant part, and part per byte of the file. That is 160
/// groups of all nodes at 40 bytes per node.
const MAX_MEMBERS: (usize, usize) = (1 << 20, 4);

impl GroupNodes {
    /// Sorts and removes duplicates, since neighbouring elements share most of their nodes. Returns
    /// the number of new nodes.
    fn tidy(&mut self) -> usize {
        self.ids.sort_unstable();
        self.ids.dedup();
        self.ids.len() - std::mem::replace(&mut self.tidied, self.ids.len())
    }
}

impl Collector {
    /// Creates an empty collector.
    ///
    /// * `keep_lines`: whether line elements may be beams.
    pub fn new(keep_lines: bool) -> Self {
        Self {
            draft: Draft::default(),
            keep_lines,
            names: HashMap::new(),
            entities: HashMap::new(),
            regions: HashMap::new(),
            region_keys: Vec::new(),
            sets: BTreeMap::new(),
            kept: 0,
        }
    }

    /// Reads `$PhysicalNames`: dimension, tag and quoted name of each group.
    pub(super) fn physical_names(&mut self, reader: &mut Reader) -> Result<(), FeFileError> {
        let count = reader.size("number of physical names")?;
        let count = reader.checked(count, "number of physical names", [2, 0, 0])?;
        for _ in 0..count {
            let at = reader.pos + 1;
            let dim = reader.int("dimension of a physical group")?;
            let tag = reader.int("tag of a physical group")?;
            let quoted = reader.rest_of_line();
            let name = quoted.strip_prefix(b"\"").and_then(|name| name.strip_suffix(b"\""));
            let (Some(name), 0..=3) = (name, dim) else {
                let found = format!("dimension {dim}, name {}", shown(quoted));
                let expected = "a dimension 0 to 3 and a name in quotes";
                return Err(reader.src.error(at, "$PhysicalNames", found, expected));
            };
            self.names.insert((dim as u8, tag.abs()), String::from_utf8_lossy(name).into_owned());
        }
        Ok(())
    }

    /// Stores the physical groups of an entity.
    pub(super) fn entity(&mut self, dim: u8, tag: i64, groups: Vec<i64>) {
        self.entities.insert((dim, tag), groups);
    }

    /// Returns the physical groups of an entity.
    pub(super) fn groups_of(&self, dim: u8, tag: i64) -> Vec<i64> {
        self.entities.get(&(dim, tag)).cloned().unwrap_or_default()
    }

    /// Looks up an element type; rejects unsupported volumes.
    pub(super) fn shape(&self, reader: &Reader, at: usize, number: i64) -> Result<Shape, FeFileError> {
        let known = "4, 8, 6 nodes (tetrahedron, hexahedron, prism) or 10, 20, 15";
        match shape(number) {
            Some(found) if found.dim < 3 || found.solid.is_some() => Ok(found),
            Some(found) => {
                let found = format!("{} (Gmsh type {number})", found.name);
                Err(reader.src.error(at, "$Elements", found, known).help(advice(number)))
            }
            None => {
                let found = format!("Gmsh element type {number}");
                Err(reader.src.error(at, "$Elements", found, known).help(advice(number)))
            }
        }
    }

    /// Adds one element with its physical groups.
    pub fn element(
        &mut self,
        src: &Source,
        shape: &Shape,
        id: u64,
        at: usize,
        groups: &[i64],
        nodes: &[u64],
    ) -> Result<(), FeFileError> {
        // A volume belongs to one region.
        if let Some((kind, order)) = shape.solid {
            if let [first, second, ..] = groups {
                let both = [first, second].map(|tag| format!("{:?}", self.name((3, *tag)))).join(" and ");
                let found = format!("the physical volumes {both}");
                return Err(src
                    .error(at, format!("element {id}"), found, "one physical volume")
                    .help("leave each volume in one physical group"));
            }
            let key = (3, groups.first().copied().unwrap_or(0));
            self.keep(kind, key, id, at, order.iter().map(|k| nodes[*k as usize]));
            return Ok(());
        }
        // An element of lower dimension adds its nodes to the set of each of its groups.
        for tag in groups {
            let key = (shape.dim, *tag);
            let set = self.sets.entry(key).or_insert_with(|| GroupNodes { at, ..GroupNodes::default() });
            set.ids.extend_from_slice(nodes);
            if shape.dim == 1 && nodes.len() > 2 {
                set.bent_line.get_or_insert(at);
            }
            if set.ids.len() > 2 * set.tidied + FEW {
                self.kept += set.tidy();
                if self.kept > MAX_MEMBERS.0 + MAX_MEMBERS.1 * src.bytes.len() {
                    let element = format!("physical group {:?}", self.name(key));
                    let expected = format!("at most {} nodes per byte of the file in all groups", MAX_MEMBERS.1);
                    return Err(src.error(at, element, "too many nodes", expected));
                }
            }
            if self.keep_lines && shape.dim == 1 && nodes.len() == 2 {
                self.keep(ElementKind::Beam2, key, id, at, nodes.iter().copied());
            }
        }
        Ok(())
    }

    /// Adds an element to the region of a group.
    fn keep(&mut self, kind: ElementKind, key: GroupKey, id: u64, at: usize, nodes: impl Iterator<Item = u64>) {
        let region = *self.regions.entry(key).or_insert_with(|| {
            self.region_keys.push(key);
            self.region_keys.len() - 1
        });
        let block = self.draft.block(kind, region);
        block.ids.push(id);
        block.offsets.push(at);
        block.nodes.extend(nodes);
    }

    fn name(&self, key: GroupKey) -> String {
        self.names.get(&key).cloned().unwrap_or_else(|| format!("physical_{}_{}", key.0, key.1))
    }

    /// Names regions and sets, turns the lines of beam groups into beams, and checks everything.
    pub(super) fn finish(mut self, src: &Source, options: &ReadOptions) -> Result<(Mesh, Vec<String>), FeFileError> {
        let has_volume_groups = self.region_keys.iter().any(|(dim, tag)| *dim == 3 && *tag != 0);
        self.check_beams(src, options)?;
        let mut keep = Vec::with_capacity(self.region_keys.len());
        for key in &self.region_keys {
            let name = if *key == (3, 0) { "all".to_owned() } else { self.name(*key) };
            let beam = options.beams.iter().find(|(group, _)| key.0 == 1 && *group == name);
            keep.push(beam.is_some() || (key.0 == 3 && (key.1 != 0 || !has_volume_groups)));
            self.draft.regions.push(Region { name, material: None, beam: beam.map(|(_, beam)| beam.clone()) });
        }
        let loose = self.regions.get(&(3, 0)).map_or(0, |region| {
            let of_none = self.draft.blocks.iter().filter(|block| block.region == *region);
            of_none.map(|block| block.ids.len()).sum::<usize>()
        });
        if has_volume_groups && loose > 0 {
            let warning = format!("{loose} volume elements are in no physical volume and were left out");
            self.draft.warnings.push(warning);
        }
        self.draft.retain_regions(&keep);

        let index = self.draft.index_nodes(src)?;
        let sets = self.node_sets(src, &index)?;
        self.draft.finish(src, &index, sets, &options.units)
    }

    /// Checks that every beam group of the options is a physical curve of two-node lines.
    fn check_beams(&self, src: &Source, options: &ReadOptions) -> Result<(), FeFileError> {
        for (group, _) in &options.beams {
            let curves = || self.sets.iter().filter(|(key, _)| key.0 == 1);
            let Some((_, set)) = curves().find(|(key, _)| self.name(**key) == *group) else {
                let element = format!("beam group {group:?}");
                let expected = format!("a physical curve: {}", listed(curves().map(|(key, _)| self.name(*key))));
                return Err(src.error_in_file(element, "no such physical curve", expected));
            };
            if let Some(at) = set.bent_line {
                let element = format!("beam group {group:?}");
                let error = src.error(at, element, "a line of second order", "2-node lines");
                return Err(error.help("mesh beams with Mesh.ElementOrder=1"));
            }
        }
        Ok(())
    }

    /// Node sets by name; if groups of several dimensions share a name, the highest dimension keeps
    /// it.
    fn node_sets(&mut self, src: &Source, index: &IdIndex) -> Result<Vec<(String, Vec<u32>)>, FeFileError> {
        // Remove the remaining duplicates: neighbouring elements share most of their nodes.
        for set in self.sets.values_mut() {
            set.tidy();
        }
        let mut sets: BTreeMap<String, (u8, Vec<u32>)> = BTreeMap::new();
        let taken: BTreeSet<String> = self.sets.keys().map(|key| self.name(*key)).collect();
        for (key, set) in self.sets.iter().rev() {
            let mut name = self.name(*key);
            if sets.get(&name).is_some_and(|(dim, _)| *dim != key.0) {
                let plain = name.clone();
                name.push_str(["_point", "_curve", "_surface"][usize::from(key.0.min(2))]);
                while taken.contains(&name) {
                    name.push('_');
                }
                self.draft.warnings.push(format!("the name {plain:?} is used twice; its smaller group is {name:?}"));
            }
            let nodes = set.ids.iter().map(|id| {
                index.get(*id).ok_or_else(|| {
                    let found = format!("node {id}");
                    src.error(set.at, format!("physical group {name:?}"), found, "a node of the file")
                })
            });
            let nodes = nodes.collect::<Result<Vec<u32>, _>>()?;
            sets.entry(name).or_insert((key.0, vec![])).1.extend(nodes);
        }
        // A named group without elements becomes an empty set, which causes a warning.
        for (key, name) in self.names.iter().filter(|(key, _)| key.0 < 3) {
            sets.entry(name.clone()).or_insert((key.0, vec![]));
        }
        Ok(sets.into_iter().map(|(name, (_, nodes))| (name, nodes)).collect())
    }
}
