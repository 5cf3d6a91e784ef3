//! Reads the cards of a deck in order.
//!
//! Start at [`Deck::read`], which calls [`Deck::card`] for each keyword. Numbers and names remain
//! as in the file, except that materials and sections are converted to SI. Not here: meaning of
//! sets and sections for the mesh ([`super::finish`]), their data lines ([`super::sets`],
//! [`super::properties`]).

use std::collections::{BTreeSet, HashMap};

use nalgebra::Vector3;

use super::lines::{Card, Lines, fields, id, numbers, squeezed};
use super::properties::{MaterialCard, SectionCard};
use super::sets::{Scope, Sets};
use super::types::{Class, advice, class};
use crate::FeFileError;
use crate::mesh::draft::Draft;
use crate::mesh::source::Source;
use crate::number::{real, shown};
use flexarm_fem::units::UnitSystem;

/// Contents of the cards.
pub(super) struct Deck<'a> {
    pub(super) lines: Lines<'a>,
    pub(super) units: UnitSystem,
    pub(super) draft: Draft,
    pub(super) elements: Elements,
    pub(super) nsets: Sets,
    pub(super) elsets: Sets,
    pub(super) surfaces: Vec<Surface>,
    pub(super) materials: Vec<MaterialCard>,
    /// Index of each material by its name in upper case.
    pub(super) material_by_name: HashMap<String, usize>,
    pub(super) sections: Vec<SectionCard>,
    /// Ignored cards with their count.
    ignored: Vec<(String, usize)>,
    /// Element types that already have a remark.
    remarks: BTreeSet<String>,
    scope: Scope,
    instances: usize,
    assembly_nodes: bool,
}

/// All elements in file order.
#[derive(Default)]
pub(super) struct Elements {
    pub(super) ids: Vec<u64>,
    pub(super) offsets: Vec<usize>,
    /// Index of the element card.
    pub(super) cards: Vec<u32>,
    /// Start of the nodes of each element.
    pub(super) starts: Vec<usize>,
    pub(super) nodes: Vec<u64>,
    pub(super) groups: Vec<ElementCard>,
}

/// One `*ELEMENT` card.
pub(super) struct ElementCard {
    pub(super) type_name: String,
    pub(super) class: Class,
    pub(super) elset: Option<String>,
}

/// One `*SURFACE` card.
pub(super) struct Surface {
    pub(super) name: String,
    pub(super) scope: Scope,
    /// Whether it consists of node sets and nodes rather than faces of elements.
    pub(super) of_nodes: bool,
    /// Offset, name of a set or number, and face from 0.
    pub(super) items: Vec<(usize, String, Option<u8>)>,
}

impl<'a> Deck<'a> {
    pub(super) fn new(src: Source<'a>, units: UnitSystem) -> Self {
        Self {
            lines: Lines::new(src),
            units,
            draft: Draft::default(),
            elements: Elements::default(),
            nsets: Sets::new("node"),
            elsets: Sets::new("element"),
            surfaces: Vec::new(),
            materials: Vec::new(),
            material_by_name: HashMap::new(),
            sections: Vec::new(),
            ignored: Vec::new(),
            remarks: BTreeSet::new(),
            scope: Scope::Part,
            instances: 0,
            assembly_nodes: false,
        }
    }

    /// Reads all cards up to the first step.
    pub(super) fn read(&mut self) -> Result<(), FeFileError> {
        // Steps have loads and results, which do not concern the mesh.
        let mut in_steps = false;
        while let Some(card) = self.lines.card() {
            in_steps |= card.name == "STEP";
            if in_steps {
                self.ignore(&card);
            } else {
                self.card(&card)?;
            }
        }
        /// Cards that connect, constrain or add parts of the structure.
        const STRUCTURAL: [&str; 9] =
            ["TIE", "EQUATION", "MPC", "COUPLING", "KINEMATIC", "DISTRIBUTING", "MASS", "ROTARY INERTIA", "SPRING"];
        let is_structural = |title: &str| STRUCTURAL.iter().any(|known| title.trim_start_matches('*') == *known);
        let structural: Vec<String> =
            self.ignored.iter().filter(|(title, _)| is_structural(title)).map(|(title, _)| title.clone()).collect();
        if !structural.is_empty() {
            let warning = format!(
                "the deck changes the structure with cards that are not read: {}; what they join or add is missing in \
                 the model",
                structural.join(", ")
            );
            self.draft.warnings.push(warning);
        }
        // One warning for all other cards.
        if !self.ignored.is_empty() {
            let cards = self.ignored.iter().map(|(title, count)| match count {
                1 => title.clone(),
                _ => format!("{title} ({count} times)"),
            });
            let warning = format!("ignored cards: {}", cards.collect::<Vec<_>>().join(", "));
            self.draft.warnings.push(warning);
        }
        Ok(())
    }

    /// Reads one card with its data lines; unknown ones are noted and skipped.
    fn card(&mut self, card: &Card) -> Result<(), FeFileError> {
        let src = self.lines.src;
        match card.name.as_str() {
            // Mesh.
            "NODE" => self.nodes(card),
            "ELEMENT" => self.element_card(card),
            "NSET" | "ELSET" => self.set(card),
            "SURFACE" => self.surface(card),
            // Materials, each followed by its properties, and sections.
            "MATERIAL" => {
                let new = MaterialCard::new(&src, card)?;
                if self.material_by_name.insert(squeezed(&new.name), self.materials.len()).is_some() {
                    let found = format!("a second material {:?}", new.name);
                    return Err(src.error(card.at, "*MATERIAL", found, "different names"));
                }
                self.materials.push(new);
                Ok(())
            }
            "ELASTIC" | "DENSITY" => {
                let Some(material) = self.materials.last_mut() else {
                    return Err(src.error(card.at, card.title.as_str(), "no *MATERIAL", "one before it"));
                };
                if card.name == "DENSITY" {
                    return material.density(&mut self.lines, card, &self.units);
                }
                material.elastic(&mut self.lines, card, &self.units, &mut self.draft.warnings)
            }
            "SOLIDSECTION" => {
                self.sections.push(SectionCard::solid(&src, card, self.scope)?);
                Ok(())
            }
            "BEAMSECTION" => {
                let warnings = &mut self.draft.warnings;
                self.sections.push(SectionCard::beam(&mut self.lines, card, self.scope, &self.units, warnings)?);
                Ok(())
            }
            // Structure of the deck.
            "INCLUDE" => {
                let found = format!("*INCLUDE of {:?}", card.get("INPUT").unwrap_or(""));
                Err(card
                    .refuse(&src, found, "the whole deck in one file")
                    .help("put the text of that file in its place"))
            }
            "INSTANCE" => self.instance(card),
            "ASSEMBLY" | "ENDINSTANCE" => {
                self.scope = Scope::Assembly;
                Ok(())
            }
            "HEADING" | "PART" | "ENDPART" | "ENDASSEMBLY" | "PREPRINT" => Ok(()),
            _ => {
                self.ignore(card);
                Ok(())
            }
        }
    }

    fn ignore(&mut self, card: &Card) {
        // Number of names in a message.
        const MAX: usize = 100;
        match self.ignored.iter().position(|(title, _)| *title == card.title) {
            Some(k) => self.ignored[k].1 += 1,
            None if self.ignored.len() < MAX => self.ignored.push((card.title.clone(), 1)),
            None => {}
        }
    }

    /// One instance that is not moved is equivalent to a flat deck.
    fn instance(&mut self, card: &Card) -> Result<(), FeFileError> {
        let src = self.lines.src;
        self.instances += 1;
        let help = "export the part alone, or merge the instances into one part and put it in place there";
        if self.instances > 1 {
            return Err(card.refuse(&src, "a second *INSTANCE", "one instance of one part").help(help));
        }
        let shift = self.lines.data().map(|line| numbers(&src, card, line)).transpose()?.unwrap_or_default();
        let turn = self.lines.data().map(|line| numbers(&src, card, line)).transpose()?.unwrap_or_default();
        if shift.iter().any(|x| *x != 0.0) || turn.get(6).is_some_and(|angle| *angle != 0.0) {
            return Err(card.refuse(&src, "an instance that is moved or turned", "one in place").help(help));
        }
        self.scope = Scope::Part;
        Ok(())
    }

    /// Reads `*NODE`: number, x, y, z.
    fn nodes(&mut self, card: &Card) -> Result<(), FeFileError> {
        let src = self.lines.src;
        // Nodes of the assembly belong to no part: they carry couplings and loads, no elements.
        if self.scope == Scope::Assembly {
            self.draft.warnings.push("reference points of the assembly were left out".to_owned());
            self.assembly_nodes = true;
            return Ok(());
        }
        if card.has("INPUT") || card.get("SYSTEM").is_some_and(|system| !system.eq_ignore_ascii_case("R")) {
            return Err(card.refuse(&src, "INPUT= or SYSTEM=", "rectangular coordinates in this file"));
        }
        let set = card.get("NSET").map(|name| self.nsets.open(name, self.scope, card.at));
        let first = self.draft.node_ids.len();
        while let Some((at, line)) = self.lines.data() {
            let mut words = fields(line);
            let id = id(&src, at, "*NODE", words.next().unwrap_or(b""))?;
            // A coordinate that is missing or empty is zero.
            let mut p = Vector3::zeros();
            for (x, word) in p.iter_mut().zip(words) {
                *x = match word {
                    b"" => 0.0,
                    _ => std::str::from_utf8(word)
                        .ok()
                        .and_then(real)
                        .ok_or_else(|| src.error(at, format!("node {id}"), shown(word), "a coordinate"))?,
                };
            }
            self.draft.add_node(id, p, at);
        }
        if let Some(set) = set {
            self.nsets.list[set].ids.extend_from_slice(&self.draft.node_ids[first..]);
        }
        Ok(())
    }

    /// Types of all elements, in upper case.
    pub(super) fn element_types(&self) -> BTreeSet<String> {
        self.elements.groups.iter().map(|group| group.type_name.clone()).collect()
    }

    /// Reads `*ELEMENT`: number and nodes, over one or more lines.
    fn element_card(&mut self, card: &Card) -> Result<(), FeFileError> {
        // Type and set of the card.
        let src = self.lines.src;
        let type_name = squeezed(card.need(&src, "TYPE")?);
        let Some((class, remark)) = class(&type_name) else {
            let expected = "C3D4, C3D10, C3D8, C3D20, C3D6, C3D15, B31 or B33";
            return Err(card.refuse(&src, format!("TYPE={type_name}"), expected).help(advice(&type_name)));
        };
        if let Some(remark) = remark {
            let warning = format!("{type_name}: {remark}");
            if self.remarks.insert(type_name.clone()) {
                self.draft.warnings.push(warning);
            }
        }
        if card.has("INPUT") {
            return Err(card.refuse(&src, "INPUT=", "the elements in this file"));
        }
        let elset = card.get("ELSET").filter(|name| !name.is_empty()).map(str::to_owned);
        let set = elset.as_deref().map(|name| self.elsets.open(name, self.scope, card.at));
        let elements = &mut self.elements;
        elements.groups.push(ElementCard { type_name, class, elset });
        let group = elements.groups.len() as u32 - 1;
        let type_name = &elements.groups[group as usize].type_name;

        // Elements; one with many nodes continues in further lines.
        let first = elements.ids.len();
        let each = class.nodes();
        while let Some((at, line)) = self.lines.data() {
            let mut words = fields(line);
            let element = id(&src, at, "*ELEMENT", words.next().unwrap_or(b""))?;
            let start = elements.nodes.len();
            let mut line = (at, words.next());
            while let Some(word) = line.1 {
                elements.nodes.push(id(&src, line.0, "node of an element", word)?);
                line.1 = words.next();
                if line.1.is_none() && elements.nodes.len() - start < each {
                    let Some((at, more)) = self.lines.data() else { break };
                    words = fields(more);
                    line = (at, words.next());
                }
            }
            let count = elements.nodes.len() - start;
            if count != each {
                let (what, found) = (format!("{type_name} element {element}"), format!("{count} nodes"));
                return Err(src.error(line.0, what, found, format!("{each} nodes")));
            }
            elements.ids.push(element);
            elements.offsets.push(at);
            elements.cards.push(group);
            elements.starts.push(start);
        }
        if let Some(set) = set {
            self.elsets.list[set].ids.extend_from_slice(&elements.ids[first..]);
        }
        Ok(())
    }

    /// Reads `*NSET` and `*ELSET`.
    fn set(&mut self, card: &Card) -> Result<(), FeFileError> {
        let src = self.lines.src;
        let of_nodes = card.name == "NSET";
        let name = card.need(&src, &card.name)?;
        // In the assembly, plain numbers without an instance are its reference points.
        let take_ids = self.scope == Scope::Part || card.has("INSTANCE") || !self.assembly_nodes;
        let sets = if of_nodes { &mut self.nsets } else { &mut self.elsets };
        let set = sets.open(name, self.scope, card.at);
        while let Some(line) = self.lines.data() {
            sets.add_line(&src, set, line, card.has("GENERATE"), take_ids)?;
        }
        if let (true, Some(elset)) = (of_nodes, card.get("ELSET")) {
            let elset = self.elsets.find(&src, elset, self.scope, card.at)?;
            self.nsets.list[set].of_elements.push(elset);
        }
        Ok(())
    }

    /// Reads `*SURFACE`, of nodes or of element faces.
    fn surface(&mut self, card: &Card) -> Result<(), FeFileError> {
        let src = self.lines.src;
        let name = card.need(&src, "NAME")?.to_owned();
        let kind = squeezed(card.get("TYPE").unwrap_or("ELEMENT"));
        if !["NODE", "ELEMENT"].contains(&kind.as_str()) || card.has("COMBINE") {
            self.draft.warnings.push(format!("surface {name:?} is neither of nodes nor of element faces: left out"));
            return Ok(());
        }
        let mut items = Vec::new();
        while let Some((at, line)) = self.lines.data() {
            let mut words = fields(line);
            let member = String::from_utf8_lossy(words.next().unwrap_or(b"")).into_owned();
            let face = words.next().and_then(|word| match word {
                [b'S' | b's', digit @ b'1'..=b'6'] => Some(digit - b'1'),
                _ => None,
            });
            items.push((at, member, face));
        }
        self.surfaces.push(Surface { name, scope: self.scope, of_nodes: kind == "NODE", items });
        Ok(())
    }
}
