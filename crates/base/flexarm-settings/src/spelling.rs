//! Names in messages: suggestions for misspelt ones, and lists of limited length.

/// Maximum length of a name for which a suggestion is made (characters).
const LONGEST_WORD: usize = 200;

/// Returns the candidate closest to `name`, if it is close enough for a typing error.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let length = name.chars().count();
    // Longer names were not typed.
    if length > LONGEST_WORD {
        return None;
    }
    // At least one character is right.
    let allowed = (length / 3).clamp(1, 4).min(length.saturating_sub(1));
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        if candidate.chars().count().abs_diff(length) > allowed {
            continue;
        }
        let distance = strsim::levenshtein(&name.to_lowercase(), &candidate.to_lowercase());
        if distance <= allowed && best.is_none_or(|(d, _)| distance < d) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate.to_owned())
}

/// Lists the names that exist, for a message about one that does not, and the one that was probably
/// meant: `["joint_1", "joint_2"]; did you mean "joint_1"?`.
pub fn known_names<S: AsRef<str> + std::fmt::Debug>(found: &str, known: &[S]) -> String {
    match closest(found, known.iter().map(AsRef::as_ref)) {
        Some(meant) => format!("{known:?}; did you mean {meant:?}?"),
        None => format!("{known:?}"),
    }
}

/// Joins at most eight of `items` for a message: `a, b and 3 more`.
pub fn listed<T: std::fmt::Display>(items: impl IntoIterator<Item = T>) -> String {
    const MAX: usize = 8;
    let mut items = items.into_iter();
    let shown: Vec<String> = items.by_ref().take(MAX).map(|item| item.to_string()).collect();
    match (shown.is_empty(), items.count()) {
        (true, _) => "none".into(),
        (false, 0) => shown.join(", "),
        (false, more) => format!("{} and {more} more", shown.join(", ")),
    }
}
