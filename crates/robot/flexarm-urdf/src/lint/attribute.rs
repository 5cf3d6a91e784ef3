//! Kinds of values of attributes, and consequences of missing ones.

/// Kind of value of an attribute.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Text,
    /// Non-empty text.
    Name,
    /// The given number of finite numbers.
    Numbers(usize),
    /// A number that may be infinite.
    Bound,
}

impl Kind {
    /// Returns the numbers in a value, or `None` if the value is not of this kind.
    pub(super) fn numbers(self, value: &str) -> Option<Vec<f64>> {
        let number = |word: &str| word.parse::<f64>().ok().filter(|x| x.is_finite());
        match self {
            Self::Text | Self::Name => Some(Vec::new()),
            Self::Numbers(n) => {
                value.split_whitespace().map(number).collect::<Option<Vec<f64>>>().filter(|v| v.len() == n)
            }
            Self::Bound => value.trim().parse().ok().filter(|x: &f64| !x.is_nan()).map(|x| vec![x]),
        }
    }

    pub(super) fn expected(self) -> &'static str {
        match self {
            Self::Text | Self::Name => "a name",
            Self::Numbers(1) => "a finite number",
            Self::Numbers(4) => "four numbers from 0 to 1",
            Self::Numbers(_) => "three finite numbers",
            Self::Bound => "a number",
        }
    }

    /// Returns the replacement of a missing or wrong value.
    pub(super) fn zero(self) -> &'static str {
        match self {
            Self::Text | Self::Name => "",
            Self::Numbers(n) => &"0 0 0 0"[..2 * n - 1],
            Self::Bound => "0",
        }
    }
}

/// Consequence of a missing attribute.
#[derive(Clone, Copy)]
pub(super) enum Missing {
    Fault,
    LeftOut,
    As(&'static str),
}

pub(super) type Attribute = (&'static str, Kind, Missing);
