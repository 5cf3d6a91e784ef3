//! Names of entities in a recording.

use rerun::EntityPath;

/// Builds an entity path from parts that may hold any character.
pub(crate) fn path<S: AsRef<str>>(parts: impl IntoIterator<Item = S>) -> EntityPath {
    EntityPath::from_iter(parts.into_iter().map(|part| part.as_ref().into()))
}

/// Returns the entity name of a link; names of a robot's own entities get a prefix.
pub(crate) fn link_part(name: &str) -> String {
    match name {
        "tcp" | "skeleton" | "error" | "color_scale" => format!("link_{name}"),
        _ => name.to_owned(),
    }
}
