//! Builds a mesh from the cards: resolves sets and sorts elements into regions.
//!
//! Start at [`Deck::finish`]. A region is a section, or without sections the set of an element
//! card. Not here: reading the cards ([`super::deck`]), checks and units ([`crate::mesh::draft`]).

use std::collections::{BTreeMap, BTreeSet};

use super::deck::{Deck, Surface};
use super::lines::squeezed;
use super::properties::SectionCard;
use super::sets::{Budget, Scope};
use super::types::Class;
use crate::FeFileError;
use crate::mesh::ids::IdIndex;
use crate::mesh::read::ReadOptions;
use crate::number::unsigned;
use flexarm_fem::beam::BeamTheory;
use flexarm_fem::mesh::{ElementKind, Mesh, Region, face_nodes};
use flexarm_settings::listed;

const NONE: u32 = u32::MAX;

/// Node set with its name.
type NamedNodeSet = (String, Vec<u32>);

impl Deck<'_> {
    /// Builds the mesh and checks it.
    pub(super) fn finish(mut self, options: &ReadOptions) -> Result<(Mesh, Vec<String>), FeFileError> {
        let src = self.lines.src;
        let nodes = self.draft.index_nodes(&src)?;
        let elements = self.index_elements()?;
        let mut budget = Budget::new(&src);
        let elsets = self.elsets.resolve(&src, &elements, Vec::new(), &mut budget)?;
        let sets = self.node_sets(&nodes, &elements, &elsets, &mut budget)?;

        let region_of = self.regions(&elsets)?;
        self.beams_of_options(options, &region_of)?;
        for (k, region) in region_of.iter().enumerate() {
            let kind = match self.class(k) {
                Class::Solid(kind) => kind,
                Class::Beam(_) => ElementKind::Beam2,
                Class::Skin(_) => continue,
            };
            let start = self.elements.starts[k];
            let block = self.draft.block(kind, *region as usize);
            block.ids.push(self.elements.ids[k]);
            block.offsets.push(self.elements.offsets[k]);
            block.nodes.extend_from_slice(&self.elements.nodes[start..start + kind.nodes()]);
        }
        self.draft.finish(&src, &nodes, sets, &options.units)
    }

    fn class(&self, element: usize) -> Class {
        self.elements.groups[self.elements.cards[element] as usize].class
    }

    fn index_elements(&self) -> Result<IdIndex, FeFileError> {
        let (src, elements) = (self.lines.src, &self.elements);
        if elements.ids.len() >= NONE as usize {
            let found = format!("{} elements", elements.ids.len());
            return Err(src.error(0, "mesh", found, "fewer than 4294967295 elements"));
        }
        IdIndex::new(&elements.ids).map_err(|(_, again)| {
            let element = format!("element {}", elements.ids[again]);
            let found = "a second element with this number";
            src.error(elements.offsets[again], element, found, "every element once")
        })
    }

    /// Index of the region of every element: that of its section, or of its set if it has no
    /// section.
    fn regions(&mut self, elsets: &[Vec<u32>]) -> Result<Vec<u32>, FeFileError> {
        let src = self.lines.src;
        let mut region_of = vec![NONE; self.elements.ids.len()];
        for section in &self.sections {
            let set = self.elsets.find(&src, &section.elset, section.scope, section.at)?;
            let material = section
                .find(&src, &self.materials, &self.material_by_name)?
                .material(&src, &mut self.draft.warnings)?;
            let theory = self.assign_section(section, &elsets[set], &mut region_of)?;
            if elsets[set].is_empty() {
                self.draft.warnings.push(format!("section {:?} has no elements", section.elset));
                continue;
            }
            let beam = theory.and_then(|theory| section.beam_properties(theory));
            self.draft.regions.push(Region { name: self.elsets.list[set].name.clone(), material, beam });
        }

        self.assign_cards(&mut region_of);
        Ok(region_of)
    }

    /// Assigns the elements of a section to the next region; returns the theory of its beams.
    fn assign_section(
        &self,
        section: &SectionCard,
        elements: &[u32],
        region_of: &mut [u32],
    ) -> Result<Option<BeamTheory>, FeFileError> {
        let mut theory: Option<BeamTheory> = None;
        for element in elements.iter().map(|element| *element as usize) {
            let fault = |found: String, expected: &str| {
                let what = format!("element {} of section {:?}", self.elements.ids[element], section.elset);
                Err(self.lines.src.error(section.at, what, found, expected))
            };
            // An element has one section, and the section fits its type.
            if region_of[element] != NONE {
                let other = &self.draft.regions[region_of[element] as usize].name;
                return fault(format!("a second section; the first is {other:?}"), "one section");
            }
            let card = &self.elements.groups[self.elements.cards[element] as usize];
            match (card.class, section.beam.is_some()) {
                (Class::Solid(_), false) => {}
                (Class::Beam(of_card), true) if theory.is_none_or(|known| known == of_card) => theory = Some(of_card),
                (Class::Beam(_), true) => return fault("both B31 and B33".into(), "one of them per section"),
                _ => {
                    let found = format!("{} with {}", card.type_name, section.title);
                    return fault(found, "solids with *SOLID SECTION, beams with *BEAM SECTION");
                }
            }
            region_of[element] = self.draft.regions.len() as u32;
        }
        Ok(theory)
    }

    /// Assigns elements without a section to regions by the sets of their element cards.
    fn assign_cards(&mut self, region_of: &mut [u32]) {
        let mut by_name = BTreeMap::new();
        for (element, region) in region_of.iter_mut().enumerate().filter(|(_, region)| **region == NONE) {
            let card = &self.elements.groups[self.elements.cards[element] as usize];
            if matches!(card.class, Class::Skin(_)) {
                continue;
            }
            let name = card.elset.as_deref().unwrap_or("all");
            *region = *by_name.entry(squeezed(name)).or_insert_with(|| {
                self.draft.regions.push(Region { name: name.to_owned(), material: None, beam: None });
                self.draft.regions.len() as u32 - 1
            });
        }
        if !by_name.is_empty() {
            let regions =
                listed(self.draft.regions.iter().skip(self.draft.regions.len() - by_name.len()).map(|r| &r.name));
            self.draft.warnings.push(format!("elements without a section, hence without a material: {regions}"));
        }
    }

    /// Applies beam sections given by the caller.
    fn beams_of_options(&mut self, options: &ReadOptions, region_of: &[u32]) -> Result<(), FeFileError> {
        let mut with_beams = BTreeSet::new();
        for (element, region) in region_of.iter().enumerate() {
            if matches!(self.class(element), Class::Beam(_)) {
                with_beams.insert(*region as usize);
            }
        }
        for (name, beam) in &options.beams {
            let wanted = squeezed(name);
            let mut regions = with_beams.iter().filter(|k| squeezed(&self.draft.regions[**k].name) == wanted);
            let Some(region) = regions.next().copied() else {
                let known = listed(with_beams.iter().map(|k| &self.draft.regions[*k].name));
                let element = format!("beam group {name:?}");
                let expected = format!("a set of beam elements: {known}");
                return Err(self.lines.src.error_in_file(element, "no such set", expected));
            };
            self.draft.regions[region].beam = Some(beam.clone());
        }
        Ok(())
    }

    /// Node sets, nodes of surfaces, and nodes of element sets of skins, with unique names.
    fn node_sets(
        &self,
        nodes: &IdIndex,
        elements: &IdIndex,
        elsets: &[Vec<u32>],
        budget: &mut Budget,
    ) -> Result<Vec<NamedNodeSet>, FeFileError> {
        let src = self.lines.src;
        let mut own = Vec::with_capacity(self.nsets.list.len());
        for set in &self.nsets.list {
            let mut members = Vec::new();
            for elset in &set.of_elements {
                budget.spend(&src, set.at, &set.name, elsets[*elset].len())?;
                self.nodes_of(nodes, &elsets[*elset], &mut members)?;
            }
            own.push(members);
        }
        let resolved = self.nsets.resolve(&src, nodes, own, budget)?;

        let mut named = Vec::new();
        let mut taken = BTreeSet::new();
        // Sets of the assembly keep their names; those of the part are renamed if they clash.
        for scope in [Scope::Assembly, Scope::Part] {
            let of_scope = self.nsets.list.iter().zip(&resolved).filter(|(set, _)| set.scope == scope);
            for (set, members) in of_scope {
                let clash = !taken.insert(squeezed(&set.name));
                let name = if clash { format!("part.{}", set.name) } else { set.name.clone() };
                named.push((name, members.clone()));
            }
        }
        for surface in &self.surfaces {
            let members = self.surface_nodes(surface, nodes, elements, elsets, &resolved, budget)?;
            let clash = !taken.insert(squeezed(&surface.name));
            named.push((format!("{}{}", surface.name, if clash { "_surface" } else { "" }), members));
        }
        for (set, members) in self.elsets.list.iter().zip(elsets) {
            let is_skin = |element: &u32| matches!(self.class(*element as usize), Class::Skin(_));
            if !members.is_empty() && members.iter().all(is_skin) && taken.insert(squeezed(&set.name)) {
                let mut of_skin = Vec::new();
                self.nodes_of(nodes, members, &mut of_skin)?;
                named.push((set.name.clone(), of_skin));
            }
        }
        Ok(named)
    }

    /// Appends the nodes of elements.
    fn nodes_of(&self, nodes: &IdIndex, elements: &[u32], out: &mut Vec<u32>) -> Result<(), FeFileError> {
        for element in elements {
            let count = self.class(*element as usize).nodes();
            self.some_nodes(nodes, *element as usize, 0..count, out)?;
        }
        out.sort_unstable();
        out.dedup();
        Ok(())
    }

    /// Appends the nodes of one element at the given local places.
    fn some_nodes(
        &self,
        nodes: &IdIndex,
        element: usize,
        places: impl IntoIterator<Item = usize>,
        out: &mut Vec<u32>,
    ) -> Result<(), FeFileError> {
        let start = self.elements.starts[element];
        for place in places {
            let id = self.elements.nodes[start + place];
            out.push(nodes.get(id).ok_or_else(|| {
                let what = format!("element {}", self.elements.ids[element]);
                let at = self.elements.offsets[element];
                self.lines.src.error(at, what, format!("node {id}"), "a node of the file")
            })?);
        }
        Ok(())
    }

    /// Nodes of a surface: those of its node sets and nodes, or of the faces of its elements.
    fn surface_nodes(
        &self,
        surface: &Surface,
        nodes: &IdIndex,
        elements: &IdIndex,
        elsets: &[Vec<u32>],
        nsets: &[Vec<u32>],
        budget: &mut Budget,
    ) -> Result<Vec<u32>, FeFileError> {
        let src = self.lines.src;
        let mut out = Vec::new();
        for (at, member, face) in &surface.items {
            let what = || format!("surface {:?}", surface.name);
            let number = unsigned(member.as_bytes());
            let missing = || src.error(*at, what(), member.as_str(), "a number or set of the file");
            // An item is a number or the name of a set.
            if surface.of_nodes {
                match number {
                    Some(id) => out.push(nodes.get(id).ok_or_else(missing)?),
                    None => {
                        let members = &nsets[self.nsets.find(&src, member, surface.scope, *at)?];
                        budget.spend(&src, *at, &surface.name, members.len())?;
                        out.extend_from_slice(members);
                    }
                }
                continue;
            }
            let single;
            let members: &[u32] = match number {
                Some(id) => {
                    single = [elements.get(id).ok_or_else(missing)?];
                    &single
                }
                None => &elsets[self.elsets.find(&src, member, surface.scope, *at)?],
            };
            // The same face of each element.
            budget.spend(&src, *at, &surface.name, 8 * members.len())?;
            for element in members {
                let found = |text: &str| src.error(*at, what(), text, "a face S1 to S6 of a solid");
                let Class::Solid(kind) = self.class(*element as usize) else {
                    return Err(found("a face of an element that is not a solid"));
                };
                let faces = face_nodes(kind);
                let places = face.and_then(|face| faces.get(usize::from(face)));
                let places = places.ok_or_else(|| found("no face, or one that the element has not"))?;
                self.some_nodes(nodes, *element as usize, places.iter().map(|place| usize::from(*place)), &mut out)?;
            }
        }
        Ok(out)
    }
}
