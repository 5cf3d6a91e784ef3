//! CalculiX and Abaqus decks, `.inp`: nodes, elements, sets, materials and sections.
//!
//! Cards are read once, in order, into a [`Deck`]; sets, sections and surfaces are resolved at the
//! end ([`finish`](deck)). Loads, ties and steps are ignored, with a warning that names them.

mod deck;
mod finish;
mod lines;
mod properties;
mod sets;
pub(crate) mod types;

use super::read::{MeshFile, ReadOptions};
use super::source::Source;
use crate::FeFileError;
use deck::Deck;

/// Reads a whole file.
pub(super) fn parse(src: &Source, options: &ReadOptions) -> Result<MeshFile, FeFileError> {
    let mut deck = Deck::new(*src, options.units);
    deck.read()?;
    let element_types = deck.element_types();
    let (mesh, warnings) = deck.finish(options)?;
    Ok(MeshFile { mesh, format: "CalculiX/Abaqus deck", warnings, element_types })
}
