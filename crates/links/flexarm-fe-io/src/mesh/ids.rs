//! Map from node or element numbers of a file to their indices: a table, or pairs for sparse
//! numbers.

/// Lookup of unique numbers; memory is proportional to their count.
pub enum IdIndex {
    /// Table over all numbers up to the largest; `NONE` for unused numbers.
    Table(Vec<u32>),
    /// Pairs sorted by number, for numbers with large gaps.
    Sorted(Vec<(u64, u32)>),
}

const NONE: u32 = u32::MAX;

impl IdIndex {
    /// Builds the lookup.
    ///
    /// # Errors
    /// Returns the two positions of a duplicate number.
    pub fn new(ids: &[u64]) -> Result<Self, (usize, usize)> {
        let largest = ids.iter().max().copied().unwrap_or(0);
        if largest < 8 * ids.len() as u64 + 1024 {
            let mut table = vec![NONE; largest as usize + 1];
            for (k, id) in ids.iter().enumerate() {
                let slot = &mut table[*id as usize];
                if *slot != NONE {
                    return Err((*slot as usize, k));
                }
                *slot = k as u32;
            }
            return Ok(Self::Table(table));
        }
        let mut sorted: Vec<(u64, u32)> = ids.iter().copied().zip(0..).collect();
        sorted.sort_unstable();
        match sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err((pair[0].1 as usize, pair[1].1 as usize)),
            None => Ok(Self::Sorted(sorted)),
        }
    }

    /// Returns the index of a number.
    pub fn get(&self, id: u64) -> Option<u32> {
        match self {
            Self::Table(table) => {
                let slot = table.get(usize::try_from(id).ok()?)?;
                (*slot != NONE).then_some(*slot)
            }
            Self::Sorted(sorted) => {
                let k = sorted.binary_search_by_key(&id, |(id, _)| *id).ok()?;
                Some(sorted[k].1)
            }
        }
    }

    /// Appends the indices of the existing numbers among `first, first + step, ... <= last`.
    pub fn extend_from_range(&self, first: u64, last: u64, step: u64, out: &mut Vec<u32>) {
        // Clipped to the existing numbers, which bounds the work for any range in the file.
        let high = match self {
            Self::Table(table) => table.len() as u64 - 1,
            Self::Sorted(sorted) => {
                let from = sorted.partition_point(|(id, _)| *id < first);
                let within = sorted[from..].iter().take_while(|(id, _)| *id <= last);
                out.extend(within.filter(|(id, _)| (id - first).is_multiple_of(step)).map(|(_, k)| *k));
                return;
            }
        };
        let wanted = (first..=last.min(high)).step_by(usize::try_from(step).unwrap_or(usize::MAX));
        out.extend(wanted.filter_map(|id| self.get(id)));
    }
}
