//! Words in messages: closest known word, and lists of limited length.

/// Known word closest to `word`, if at most a third of its letters differ.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let with_distance = known.into_iter().map(|one| (strsim::levenshtein(word, one), one));
    let (distance, found) = with_distance.min_by_key(|(distance, _)| *distance)?;
    (3 * distance <= found.chars().count().max(3)).then_some(found)
}

/// Joins at most eight of `items` for a message.
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
