//! Choices that have a name in files, on the command line and in Python.

/// Values that users choose by a word.
pub trait Words: Copy + PartialEq + 'static {
    /// The words with their values and a description of each.
    const WORDS: &'static [(&'static str, Self, &'static str)];

    /// Returns the value of a word; `None` for other words.
    fn from_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(known, ..)| *known == word).map(|(_, value, _)| *value)
    }

    /// Returns the word of this value; `None` for a value that cannot be asked for.
    fn word(self) -> Option<&'static str> {
        Self::WORDS.iter().find(|(_, value, _)| *value == self).map(|(word, ..)| *word)
    }

    /// Returns all words, for messages.
    fn known() -> Vec<&'static str> {
        Self::WORDS.iter().map(|(word, ..)| *word).collect()
    }
}
