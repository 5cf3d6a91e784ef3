//! Named sets of nodes or elements, including nested sets.
//!
//! Start at [`Sets::add_line`], which keeps numbers and names as they are, and [`Sets::resolve`],
//! which computes the members by index. Not here: nodes of element sets and surfaces
//! ([`super::finish`]).

use std::collections::HashMap;

use super::lines::{Line, fields, squeezed, unquoted};
use crate::FeFileError;
use crate::mesh::ids::IdIndex;
use crate::mesh::source::Source;
use crate::number::{shown, unsigned};
use flexarm_settings::listed;

/// Limit for the growth of sets by nesting and generation, proportional to the size of the file, so
/// that a small file cannot cause endless work.
pub(super) struct Budget {
    left: usize,
}

impl Budget {
    pub(super) fn new(src: &Source) -> Self {
        // Enough for 500 sets of all nodes at 30 bytes per node.
        Self { left: src.bytes.len().saturating_mul(16).saturating_add(1 << 20) }
    }

    /// Counts members of a set or surface at an offset.
    pub(super) fn spend(&mut self, src: &Source, at: usize, name: &str, members: usize) -> Result<(), FeFileError> {
        match self.left.checked_sub(members) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => {
                let expected = "at most 16 members per byte of the file in all sets together";
                Err(src.error(at, format!("set {name:?}"), "too many members", expected))
            }
        }
    }
}

/// Scope of a name: sets of a part and of the assembly may have the same name.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Scope {
    /// A flat deck, a part or an instance.
    Part,
    /// The assembly, and the model after it.
    Assembly,
}

/// All sets of nodes, or all sets of elements.
pub(super) struct Sets {
    /// `node` or `element`.
    what: &'static str,
    pub(super) list: Vec<Set>,
    by_name: HashMap<(Scope, String), usize>,
}

pub(super) struct Set {
    /// Name as in the file.
    pub(super) name: String,
    pub(super) scope: Scope,
    pub(super) at: usize,
    pub(super) ids: Vec<u64>,
    ranges: Vec<[u64; 3]>,
    /// Nested sets of the same kind.
    inner: Vec<usize>,
    /// Element sets whose nodes are members.
    pub(super) of_elements: Vec<usize>,
}

impl Sets {
    pub(super) fn new(what: &'static str) -> Self {
        Self { what, list: Vec::new(), by_name: HashMap::new() }
    }

    /// Returns the set with a name, creating it if needed.
    pub(super) fn open(&mut self, name: &str, scope: Scope, at: usize) -> usize {
        *self.by_name.entry((scope, squeezed(name))).or_insert_with(|| {
            let name = name.to_owned();
            self.list.push(Set { name, scope, at, ids: vec![], ranges: vec![], inner: vec![], of_elements: vec![] });
            self.list.len() - 1
        })
    }

    /// Finds a set by name, ignoring case, with or without the instance before a point.
    pub(super) fn find(&self, src: &Source, name: &str, scope: Scope, at: usize) -> Result<usize, FeFileError> {
        let lookup = |name: &str| {
            let key = squeezed(unquoted(name));
            let inside = self.by_name.get(&(scope, key.clone()));
            inside.or_else(|| self.by_name.get(&(Scope::Part, key))).copied()
        };
        let known = lookup(name).or_else(|| lookup(name.rsplit_once('.')?.1));
        known.ok_or_else(|| {
            let known = listed(self.list.iter().map(|set| &set.name));
            let element = format!("{} set {name:?}", self.what);
            src.error(at, element, "no such set so far", format!("one of: {known}"))
        })
    }

    /// Reads one data line of `*NSET` or `*ELSET`.
    ///
    /// * `take_ids`: whether plain numbers are taken; names and numbers with an instance always
    ///   are.
    pub(super) fn add_line(
        &mut self,
        src: &Source,
        set: usize,
        (at, line): Line,
        generate: bool,
        take_ids: bool,
    ) -> Result<(), FeFileError> {
        if generate {
            let values: Option<Vec<u64>> = fields(line).map(unsigned).collect();
            let range = match values.as_deref() {
                Some([first, last]) => [*first, *last, 1],
                Some([first, last, step]) if *step > 0 => [*first, *last, *step],
                _ => {
                    let element = format!("{} set {:?}, GENERATE", self.what, self.list[set].name);
                    return Err(src.error(at, element, shown(line), "first, last, step"));
                }
            };
            self.list[set].ranges.extend(take_ids.then_some(range));
            return Ok(());
        }
        for field in fields(line).filter(|field| !field.is_empty()) {
            // `Part-1-1.17` is node 17 of the only instance.
            let last = field.rsplit(|byte| *byte == b'.').next().unwrap_or(field);
            match (unsigned(field), unsigned(last)) {
                (Some(id), _) => {
                    self.list[set].ids.extend(take_ids.then_some(id));
                    continue;
                }
                (None, Some(id)) => {
                    self.list[set].ids.push(id);
                    continue;
                }
                (None, None) => {}
            }
            let inner = self.find(src, &String::from_utf8_lossy(field), self.list[set].scope, at)?;
            self.list[set].inner.push(inner);
        }
        Ok(())
    }

    /// Computes the member indices of every set, sorted.
    ///
    /// * `own`: further direct members of each set; may be shorter than the list.
    pub(super) fn resolve(
        &self,
        src: &Source,
        index: &IdIndex,
        own: Vec<Vec<u32>>,
        budget: &mut Budget,
    ) -> Result<Vec<Vec<u32>>, FeFileError> {
        // Direct members of each set.
        let mut direct = own;
        direct.resize(self.list.len(), Vec::new());
        for (set, members) in self.list.iter().zip(&mut direct) {
            for id in &set.ids {
                members.push(index.get(*id).ok_or_else(|| {
                    let element = format!("{} set {:?}", self.what, set.name);
                    let found = format!("{} {id}", self.what);
                    src.error(set.at, element, found, format!("a {} of the file", self.what))
                })?);
            }
            for [first, last, step] in &set.ranges {
                let before = members.len();
                index.extend_from_range(*first, *last, *step, members);
                budget.spend(src, set.at, &set.name, members.len() - before)?;
                tidy(members, before);
            }
            members.sort_unstable();
            members.dedup();
        }

        // Members of nested sets: one traversal per set with an explicit stack, so that cycles and
        // deep nesting are harmless.
        let mut all = direct.clone();
        let mut reached_from = vec![usize::MAX; self.list.len()];
        for (k, set) in self.list.iter().enumerate().filter(|(_, set)| !set.inner.is_empty()) {
            let mut open = vec![k];
            reached_from[k] = k;
            while let Some(inside) = open.pop() {
                budget.spend(src, set.at, &set.name, direct[inside].len() + 1)?;
                if inside != k {
                    all[k].extend_from_slice(&direct[inside]);
                }
                for next in &self.list[inside].inner {
                    if std::mem::replace(&mut reached_from[*next], k) != k {
                        open.push(*next);
                    }
                }
            }
            all[k].sort_unstable();
            all[k].dedup();
        }
        Ok(all)
    }
}

/// Sorts and removes duplicates when a list has doubled, so that it cannot grow without bound.
fn tidy(members: &mut Vec<u32>, before: usize) {
    if before > 1024 && members.len() > 2 * before {
        members.sort_unstable();
        members.dedup();
    }
}
