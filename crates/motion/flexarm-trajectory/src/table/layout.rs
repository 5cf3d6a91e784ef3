//! Assignment of the columns of a table to the time and the joints.

use std::collections::BTreeSet;

use super::dialect::number;
use super::header::{Meaning, Measure, Unit, meaning, name_and_unit};
use super::lines::{Table, run_joint};
use super::located::{Located, at, at_field, nowhere};
use super::request::TableRequest;
use crate::column_map::ColumnMap;
use crate::problem::Problem;
use crate::warning::Warning;

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
    pub(super) notes: Vec<Warning>,
    /// Joints whose unit is not given anywhere.
    pub(super) assumed: Vec<String>,
}

impl Table<'_> {
    /// Layout of `run.csv`.
    pub(super) fn of_run(&self) -> Result<Layout, Located> {
        let place = |name: &str| self.names.iter().position(|own| own == name);
        let used = self.names.iter().enumerate().filter_map(|(place, name)| {
            let (joint, _) = run_joint(name)?;
            Some(Used { joint: joint.to_owned(), order: 0, place, scale: 1.0 })
        });
        let time = place("time").ok_or_else(|| self.no_time())?;
        let seconds = Unit { measure: Measure::Time, per_s: 0, scale: 1.0 };
        let notes = vec![Warning::PositionsOfRun];
        Ok(Layout { time, time_unit: Some(seconds), used: used.collect(), notes, assumed: Vec::new() })
    }

    fn no_time(&self) -> Located {
        at(self.header_line, Problem::NoTimeColumnFound { found: self.names.clone() })
    }

    /// Layout given by the user.
    pub(super) fn mapped(&self, map: &ColumnMap, request: &TableRequest<'_>) -> Result<Layout, Located> {
        let mut layout = Layout { time: 0, time_unit: None, used: Vec::new(), notes: Vec::new(), assumed: Vec::new() };
        let time = match &map.time {
            Some(column) => self.column(column)?,
            None => self.only_time()?,
        };
        (layout.time, layout.time_unit) = time;
        if let Some(wrong) = layout.time_unit.filter(|unit| unit.measure != Measure::Time) {
            let column = self.shown(layout.time);
            return Err(self.bad_unit(column, wrong, "a time"));
        }
        let mut taken = BTreeSet::from([layout.time]);
        for (joint, column) in &map.joints {
            let (place, unit) = self.column(column)?;
            if !taken.insert(place) {
                let problem = Problem::RepeatedColumn { name: self.shown(place), first: place + 1 };
                return Err(at_field(self.header_line, place, problem));
            }
            self.add(&mut layout, request, joint, place, unit)?;
        }
        Ok(layout)
    }

    /// Layout according to the header.
    pub(super) fn guessed(&self, request: &TableRequest<'_>) -> Result<Layout, Located> {
        let known = |name: &str| request.joints.is_none_or(|joints| joints.iter().any(|joint| joint.name == name));
        let (time, time_unit) = self.only_time()?;
        let mut layout = Layout { time, time_unit, used: Vec::new(), notes: Vec::new(), assumed: Vec::new() };
        let mut dropped = Vec::new();
        for (place, column) in self.names.iter().enumerate().filter(|(place, _)| *place != time) {
            if column.is_empty() {
                // A trailing separator leaves an empty last field; an unnamed column elsewhere may
                // be a row index.
                if place + 1 < self.names.len() {
                    dropped.push(format!("#{}", place + 1));
                }
                continue;
            }
            let (name, order, unit, unknown) = self.read_name(place, request);
            let is_numeric = || self.first_row().get(place).is_some_and(|field| number(field).is_some());
            match name {
                Some(joint) if known(&joint) && (request.joints.is_some() || is_numeric()) => {
                    if let Some(found) = unknown {
                        let accepted = "rad, deg, m, mm, and rates of them";
                        return Err(at_field(
                            self.header_line,
                            place,
                            Problem::UnknownUnit { key: "column", found, accepted },
                        ));
                    }
                    if layout.used.iter().any(|used| used.joint == joint && used.order == order) {
                        let first = layout.used.iter().find(|used| used.joint == joint && used.order == order);
                        let first = first.map_or(0, |used| used.place + 1);
                        return Err(at_field(self.header_line, place, Problem::RepeatedColumn { name: joint, first }));
                    }
                    self.add_order(&mut layout, request, &joint, place, unit, order)?;
                }
                _ => dropped.push(column.clone()),
            }
        }
        // Rates without positions cannot be used.
        let (used, rates): (Vec<Used>, Vec<Used>) = {
            let has = |joint: &str| layout.used.iter().any(|used| used.joint == joint && used.order == 0);
            layout.used.iter().cloned().partition(|used| has(&used.joint))
        };
        dropped.extend(rates.iter().map(|used| self.names[used.place].clone()));
        layout.used = used;
        if layout.used.is_empty() {
            let joints = request.joints.unwrap_or_default().iter().map(|joint| joint.name.to_owned()).collect();
            return Err(at(self.header_line, Problem::NoJointColumn { found: self.names.clone(), joints }));
        }
        if !dropped.is_empty() {
            layout.notes.push(Warning::DroppedColumns { columns: dropped });
        }
        Ok(layout)
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
        if is_known(column) {
            return (Some(column.clone()), 0, self.units[place], None);
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
    fn only_time(&self) -> Result<(usize, Option<Unit>), Located> {
        let mut found = Vec::new();
        for (place, column) in self.names.iter().enumerate() {
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
                let columns = found.iter().map(|(place, _)| self.names[*place].clone()).collect();
                Err(at(self.header_line, Problem::SeveralTimes { columns }))
            }
        }
    }

    /// The column that a text refers to: by number, full name, name without its unit, or name with
    /// another unit.
    fn column(&self, asked: &str) -> Result<(usize, Option<Unit>), Located> {
        let (bare, told, unknown) = name_and_unit(asked);
        let missing = || {
            let (asked, found) = (asked.to_owned(), self.names.clone());
            at(self.header_line, Problem::NoSuchColumn { asked, found })
        };
        if let Some(digits) = bare.strip_prefix('#') {
            let place: usize = digits.trim().parse().map_err(|_| missing())?;
            let place = place.checked_sub(1).filter(|place| *place < self.names.len()).ok_or_else(missing)?;
            return Ok((place, told.or_else(|| self.unit_of(place))));
        }
        if let Some(place) = self.names.iter().position(|name| name == asked) {
            return Ok((place, self.unit_of(place)));
        }
        if let (Some(found), false) = (unknown, self.names.iter().any(|name| name_and_unit(name).0 == bare)) {
            let accepted = "s, ms, us, ns, min, rad, deg, mrad, m, mm";
            return Err(nowhere(Problem::UnknownUnit { key: "columns", found, accepted }));
        }
        let matching = |name: &String| *name == bare || name_and_unit(name).0 == bare;
        let places: Vec<usize> = (0..self.names.len()).filter(|place| matching(&self.names[*place])).collect();
        match places[..] {
            [place] => Ok((place, told.or_else(|| self.unit_of(place)))),
            [] => Err(missing()),
            _ => {
                let columns = places.iter().map(|place| self.names[*place].clone()).collect();
                Err(at(self.header_line, Problem::AmbiguousColumn { asked: asked.to_owned(), columns }))
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

    fn bad_unit(&self, column: String, unit: Unit, expected: &'static str) -> Located {
        let found = match unit.measure {
            Measure::Time => "a time",
            Measure::Angle => "an angle",
            Measure::Length => "a length",
        };
        at(self.header_line, Problem::WrongMeasure { column, found, expected })
    }

    fn add(
        &self,
        layout: &mut Layout,
        request: &TableRequest<'_>,
        joint: &str,
        place: usize,
        unit: Option<Unit>,
    ) -> Result<(), Located> {
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
    ) -> Result<(), Located> {
        let known = request.joints.and_then(|joints| joints.iter().find(|known| known.name == joint));
        let is_metres = self.metres.iter().any(|name| name == joint);
        let is_prismatic = known.map(|known| known.is_prismatic).or(is_metres.then_some(true));
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
            if stated.is_some_and(|degrees| degrees != (unit.scale != 1.0)) {
                let (first, second) = if unit.scale == 1.0 { ("deg", "rad") } else { ("rad", "deg") };
                let (first, second) = (first.to_owned(), second.to_owned());
                return Err(at_field(
                    self.header_line,
                    place,
                    Problem::ContradictingUnits { key: "unit", first, second },
                ));
            }
        }
        let scale = match (unit, is_prismatic, self.degrees) {
            (Some(unit), ..) => unit.scale,
            (None, Some(true), _) | (None, _, Some(false)) => 1.0,
            (None, _, Some(true)) => std::f64::consts::PI / 180.0,
            (None, _, None) => {
                // A rate has the unit of its position, which is looked up once all columns are
                // known.
                let position = layout.used.iter().find(|used| used.joint == joint && used.order == 0);
                let scale = position.filter(|_| order > 0).map_or(1.0, |used| used.scale);
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
