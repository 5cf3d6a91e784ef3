//! Assignment of the columns of a table to the time and the joints.
//!
//! A [`Layout`] has three sources: the table is that of a run ([`Table::of_run`]), the user names
//! the columns ([`Table::mapped`]), or the header does ([`Table::guessed`]). Each column in use
//! gets a factor to SI units. Columns are counted from 0 here and from 1 in messages. Not here:
//! meaning of single names (`header`), values (`rows`).

use std::collections::BTreeSet;

use flexarm_settings::{Finding, Setting};

use super::dialect::number;
use super::header::{Meaning, Measure, Unit, meaning, name_and_unit};
use super::lines::{Table, run_joint};
use super::request::TableRequest;
use crate::column_map::ColumnMap;
use crate::error::list;
use crate::findings::{self, contradicting_units, fault, first_names, repeated_column, unknown_unit};
use crate::joint_names::{misspelt, misspelt_text, none_known_text};
use crate::trajectory::StatedUnit;

/// A column in use.
#[derive(Clone, Debug)]
pub(super) struct Used {
    pub(super) joint: String,
    pub(super) order: usize,
    pub(super) place: usize,
    pub(super) scale: f64,
}

/// Assignment of columns to the time and the joints.
pub(super) struct Layout {
    pub(super) time: usize,
    pub(super) time_unit: Option<Unit>,
    pub(super) used: Vec<Used>,
    pub(super) notes: Vec<Finding>,
    /// Columns that are not of the motion.
    pub(super) dropped: Vec<String>,
    /// Joints whose unit is not given anywhere.
    pub(super) assumed: Vec<String>,
    /// Units that comments give to joints.
    pub(super) stated: Vec<StatedUnit>,
}

impl Layout {
    fn new(time: usize, time_unit: Option<Unit>) -> Self {
        let (used, notes, dropped) = (Vec::new(), Vec::new(), Vec::new());
        Self { time, time_unit, used, notes, dropped, assumed: Vec::new(), stated: Vec::new() }
    }

    pub(super) fn find(&self, joint: &str, order: usize) -> Option<&Used> {
        self.used.iter().find(|used| used.joint == joint && used.order == order)
    }
}

impl Table<'_> {
    /// Layout of `run.csv`.
    pub(super) fn of_run(&self) -> Result<Layout, Box<Finding>> {
        let place = |name: &str| self.names.iter().position(|own| own == name);
        let used = self.names.iter().enumerate().filter_map(|(place, name)| {
            let (joint, _) = run_joint(name)?;
            Some(Used { joint: joint.to_owned(), order: 0, place, scale: 1.0 })
        });
        let time = place("time").ok_or_else(|| self.no_time())?;
        let seconds = Unit { measure: Measure::Time, per_s: 0, scale: 1.0 };
        let message = "the positions are those of the flexible robot of a run: where its drives give way, they \
                       include what the gearboxes twist; the motion file of the run has the commanded ones";
        let notes = vec![Finding::warning("table-of-run", self.file.to_string(), message, "")];
        Ok(Layout { used: used.collect(), notes, ..Layout::new(time, Some(seconds)) })
    }

    fn no_time(&self) -> Box<Finding> {
        self.at(
            self.header_line,
            fault(
                "no-time-column",
                format!(
                    "no column of the header {} is a time (`time`, `t`, `Time[s]`, `timestamp`); rename one, or tell \
                     which it is: {} t=<column>",
                    list(&self.names),
                    Setting::Columns
                ),
            ),
        )
    }

    /// Layout given by the user.
    pub(super) fn mapped(&self, map: &ColumnMap, request: &TableRequest<'_>) -> Result<Layout, Box<Finding>> {
        let (time, time_unit) = match &map.time {
            Some(column) => self.column(column)?,
            None => self.only_time(request)?,
        };
        let mut layout = Layout::new(time, time_unit);
        if let Some(wrong) = layout.time_unit.filter(|unit| unit.measure != Measure::Time) {
            let column = self.shown(layout.time);
            return Err(self.bad_unit(column, wrong, "a time"));
        }
        let mut taken = BTreeSet::from([layout.time]);
        for (joint, column) in &map.joints {
            let (place, unit) = self.column(column)?;
            if !taken.insert(place) {
                let problem = repeated_column(&self.shown(place), place + 1);
                return Err(self.at_column(place, problem));
            }
            self.add(&mut layout, request, joint, place, unit)?;
        }
        Ok(layout)
    }

    /// Layout according to the header.
    pub(super) fn guessed(&self, request: &TableRequest<'_>) -> Result<Layout, Box<Finding>> {
        let known = |name: &str| request.joints.is_none_or(|joints| joints.iter().any(|joint| joint.name == name));
        let (time, time_unit) = self.only_time(request)?;
        let mut layout = Layout::new(time, time_unit);
        // Places of the columns that are left out, with the joint and the order that they name.
        let mut dropped: Vec<(usize, Option<(String, usize)>)> = Vec::new();
        let (first_row, is_own) = (self.first_row(), self.is_own(request));
        let others = (0..self.names.len()).filter(|place| *place != time);
        let mut columns: Vec<_> = others.map(|place| (place, self.read_name(place, request))).collect();
        // Positions first: a rate without a unit has that of its position.
        columns.sort_by_key(|(_, (_, order, ..))| *order);
        for (place, (name, order, unit, unknown)) in columns {
            let field = first_row.get(place);
            if self.names[place].is_empty() {
                // A trailing separator leaves an empty last field; an unnamed column elsewhere may
                // be a row index.
                if place + 1 < self.names.len() || field.is_some_and(|field| !field.is_empty()) {
                    dropped.push((place, None));
                }
                continue;
            }
            let is_numeric = || field.is_none_or(|field| request.joints.is_some() || number(field).is_some());
            match name {
                Some(joint) if known(&joint) && (is_own || is_numeric()) => {
                    if let Some(found) = unknown {
                        let accepted = "rad, deg, m, mm, and rates of them";
                        let problem = unknown_unit("column", &found, accepted);
                        return Err(self.at_column(place, problem));
                    }
                    if let Some(used) = layout.find(&joint, order) {
                        let problem = repeated_column(&joint, used.place + 1);
                        return Err(self.at_column(place, problem));
                    }
                    self.add_order(&mut layout, request, &joint, place, unit, order)?;
                }
                name => dropped.push((place, name.map(|joint| (joint, order)))),
            }
        }
        dropped.sort_by_key(|(place, _)| *place);
        self.check_names(&layout, &dropped, request)?;
        if !dropped.is_empty() {
            layout.dropped = dropped.iter().map(|(place, _)| self.shown(*place)).collect();
            let message = format!(
                "columns that are not of the motion are left out: {}; {} says which column is which joint",
                first_names(&layout.dropped),
                Setting::Columns
            );
            let header = self.file.line(self.header_line).to_string();
            let warning = Finding::warning("table-columns", header, message, "");
            layout.notes.push(warning.mended_by(&[Setting::Columns]));
        }
        Ok(layout)
    }

    /// Rejects misspelt names, rates without positions, and a table without any joint.
    fn check_names(
        &self,
        layout: &Layout,
        dropped: &[(usize, Option<(String, usize)>)],
        request: &TableRequest<'_>,
    ) -> Result<(), Box<Finding>> {
        let joints: Vec<&str> = request.joints.unwrap_or_default().iter().map(|joint| joint.name).collect();
        // Columns left out whose names are close to those of joints without a column.
        for (place, name) in dropped {
            let Some((name, order)) = name else { continue };
            let unnamed: Vec<&str> =
                joints.iter().copied().filter(|joint| layout.find(joint, *order).is_none()).collect();
            if let Some((found, meant)) = misspelt([name.as_str()], &unnamed) {
                let by_column =
                    format!(", say which column it is ({} {meant}={})", Setting::Columns, self.shown(*place));
                let problem = fault("misspelt-joint", misspelt_text(found, &meant, &by_column));
                return Err(self.at_column(*place, problem));
            }
        }
        if let Some(rate) = layout.used.iter().find(|used| layout.find(&used.joint, 0).is_none()) {
            let (column, joint, found) = (self.shown(rate.place), rate.joint.clone(), self.names.clone());
            let message = format!(
                "column {column:?} has no position column {joint:?} beside it; the header has {}; add it or correct \
                 the name",
                list(&found)
            );
            return Err(self.at_column(rate.place, fault("no-position-column", message)));
        }
        if !layout.used.is_empty() {
            return Ok(());
        }
        let by_column = format!(", or name the columns: {} <joint>=<column>", Setting::Columns);
        Err(self.at(self.header_line, fault("no-joint", none_known_text(&self.names, &joints, &by_column))))
    }

    /// Joint, order, unit and unknown unit of a column; the joint is `None` if the column is not
    /// one.
    fn read_name(
        &self,
        place: usize,
        request: &TableRequest<'_>,
    ) -> (Option<String>, usize, Option<Unit>, Option<String>) {
        let column = &self.names[place];
        let is_known = |name: &str| request.joints.is_some_and(|joints| joints.iter().any(|joint| joint.name == name));
        // A column with a rate beside it is the joint of this rate, whatever its name looks like.
        let has_rate = || self.names.iter().any(|name| name.strip_suffix(".vel") == Some(column));
        if is_known(column) || has_rate() {
            return (Some(column.clone()), 0, self.units[place], None);
        }
        let own_rate = [(".vel", 1), (".acc", 2)].into_iter().find_map(|(end, order)| {
            let joint = column.strip_suffix(end)?;
            self.names.iter().any(|name| name == joint).then(|| (joint.to_owned(), order))
        });
        if let Some((joint, order)) = own_rate {
            return (Some(joint), order, self.units[place], None);
        }
        let (name, unit, unknown) = name_and_unit(column);
        let unit = unit.or(self.units[place]);
        if is_known(&name) {
            return (Some(name), unit.map_or(0, |unit| unit.per_s), unit, None);
        }
        match meaning(&name, unit) {
            Meaning::Joint(joint, order) => (Some(joint), order, unit, unknown),
            _ => (None, 0, unit, None),
        }
    }

    fn first_row(&self) -> Vec<String> {
        self.lines.first().map(|(_, line)| self.separator.split(line)).unwrap_or_default()
    }

    /// The only time column.
    fn only_time(&self, request: &TableRequest<'_>) -> Result<(usize, Option<Unit>), Box<Finding>> {
        let mut found = Vec::new();
        let is_joint = |name: &str| request.joints.is_some_and(|joints| joints.iter().any(|joint| joint.name == name));
        for (place, column) in self.names.iter().enumerate().filter(|(_, column)| !is_joint(column)) {
            let (name, unit, _) = name_and_unit(column);
            let unit = unit.or(self.units[place]);
            if meaning(&name, unit) == Meaning::Time {
                found.push((place, unit));
            }
        }
        match found[..] {
            [one] => Ok(one),
            [] => Err(self.no_time()),
            _ => {
                let columns: Vec<String> = found.iter().map(|(place, _)| self.names[*place].clone()).collect();
                Err(self.at(
                    self.header_line,
                    fault(
                        "several-times",
                        format!(
                            "the columns {} are all times; name the one that counts: {} t=<column>,<joint>=<column>",
                            list(&columns),
                            Setting::Columns
                        ),
                    ),
                ))
            }
        }
    }

    /// The column that a text refers to: by number, full name, name without its unit, or name with
    /// another unit.
    fn column(&self, asked: &str) -> Result<(usize, Option<Unit>), Box<Finding>> {
        let (bare, stated, unknown) = name_and_unit(asked);
        let missing = || {
            let (asked, found) = (asked.to_owned(), self.names.clone());
            self.at(
                self.header_line,
                fault("no-such-column", format!("there is no column {asked:?}; the header has {}", list(&found))),
            )
        };
        // By number, by the whole name, then by a name without its unit, which must be unique.
        if let Some(digits) = bare.strip_prefix('#') {
            let place: usize = digits.trim().parse().map_err(|_| missing())?;
            let place = place.checked_sub(1).filter(|place| *place < self.names.len()).ok_or_else(missing)?;
            return Ok((place, stated.or_else(|| self.unit_of(place))));
        }
        if let Some(place) = self.names.iter().position(|name| name == asked) {
            return Ok((place, self.unit_of(place)));
        }
        if let (Some(found), false) = (unknown, self.names.iter().any(|name| name_and_unit(name).0 == bare)) {
            let accepted = "s, ms, us, ns, min, rad, deg, mrad, m, mm";
            return Err(findings::at(&self.file, unknown_unit("columns", &found, accepted)));
        }
        let matching = |name: &String| *name == bare || name_and_unit(name).0 == bare;
        let places: Vec<usize> = (0..self.names.len()).filter(|place| matching(&self.names[*place])).collect();
        match places[..] {
            [place] => Ok((place, stated.or_else(|| self.unit_of(place)))),
            [] => Err(missing()),
            _ => {
                let columns: Vec<String> = places.iter().map(|place| self.names[*place].clone()).collect();
                Err(self.at(
                    self.header_line,
                    fault(
                        "ambiguous-column",
                        format!(
                            "{asked:?} could be each of the columns {}; give the whole name, or its number as in #2",
                            list(&columns)
                        ),
                    ),
                ))
            }
        }
    }

    fn unit_of(&self, place: usize) -> Option<Unit> {
        name_and_unit(&self.names[place]).1.or(self.units[place])
    }

    pub(super) fn shown(&self, place: usize) -> String {
        let name = &self.names[place];
        if name.is_empty() { format!("#{}", place + 1) } else { name.clone() }
    }

    fn bad_unit(&self, column: String, unit: Unit, expected: &'static str) -> Box<Finding> {
        let found = match unit.measure {
            Measure::Time => "a time",
            Measure::Angle => "an angle",
            Measure::Length => "a length",
        };
        self.at(
            self.header_line,
            fault("wrong-measure", format!("the column {column:?} has the unit of {found}; expected {expected}")),
        )
    }

    fn add(
        &self,
        layout: &mut Layout,
        request: &TableRequest<'_>,
        joint: &str,
        place: usize,
        unit: Option<Unit>,
    ) -> Result<(), Box<Finding>> {
        // `joint_1.vel=...` refers to a rate.
        let (joint, order) = match meaning(joint, None) {
            Meaning::Joint(base, order) if order > 0 => (base, order),
            _ => (joint.to_owned(), 0),
        };
        self.add_order(layout, request, &joint, place, unit, order)
    }

    fn add_order(
        &self,
        layout: &mut Layout,
        request: &TableRequest<'_>,
        joint: &str,
        place: usize,
        unit: Option<Unit>,
        order: usize,
    ) -> Result<(), Box<Finding>> {
        let known = request.joints.and_then(|joints| joints.iter().find(|known| known.name == joint));
        let metres = self.metres.iter().find(|(_, name)| name == joint).map(|(line, _)| *line);
        let is_prismatic = known.map(|known| known.is_prismatic).or(metres.map(|_| true));
        if let Some(unit) = unit {
            let expected = match (is_prismatic, unit.measure) {
                (Some(true), Measure::Angle) => Some("a length: the joint is prismatic"),
                (Some(false), Measure::Length) => Some("an angle: the joint turns"),
                (_, Measure::Time) => Some("an angle or a length"),
                _ => None,
            };
            if let Some(expected) = expected {
                return Err(self.bad_unit(self.shown(place), unit, expected));
            }
            let stated = self.degrees.filter(|_| unit.measure == Measure::Angle);
            if stated.is_some_and(|(_, degrees)| degrees != (unit.scale != 1.0)) {
                let (first, second) = if unit.scale == 1.0 { ("deg", "rad") } else { ("rad", "deg") };
                let problem = contradicting_units(first, second);
                return Err(self.at_column(place, problem));
            }
        }
        let mut state = |is_length, line| {
            if order == 0 {
                layout.stated.push(StatedUnit { joint: joint.to_owned(), is_length, line });
            }
        };
        let scale = match (unit, metres, self.degrees) {
            (Some(unit), ..) => unit.scale,
            (None, Some(line), _) => {
                state(true, line);
                1.0
            }
            (None, None, Some((line, true))) => {
                state(false, line);
                std::f64::consts::PI / 180.0
            }
            (None, None, Some((_, false))) => 1.0,
            (None, None, None) if is_prismatic == Some(true) => 1.0,
            (None, None, None) => {
                // A rate has the unit of its position.
                let scale = layout.find(joint, 0).filter(|_| order > 0).map_or(1.0, |used| used.scale);
                if order == 0 {
                    layout.assumed.push(joint.to_owned());
                }
                scale
            }
        };
        layout.used.push(Used { joint: joint.to_owned(), order, place, scale });
        Ok(())
    }
}
