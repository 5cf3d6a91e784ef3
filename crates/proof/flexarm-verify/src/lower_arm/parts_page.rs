//! The page of the case: errors that lumped parts cannot avoid.

use flexarm_draw::{CurveLook, Panel, PlotCurve};

use super::parts::{COUNTS, CUTS, ChainError, LimitOfParts, MODES, MOST};
use super::{AXES, CHAINS};
use crate::page::{Bound, Case, Figure, Table, error, fixed, percent, signed, word};

/// Limit of the sag of chains as their parts become short, and the share of the sag that it misses.
pub(super) fn limit_of_parts(case: &mut Case, found: &LimitOfParts) {
    case.heading("What parts cannot see");
    case.table(chain_table(&found.chains));
    case.table(stretch_table(found));
    case.text(format!(
        "The seat A faces sideways (-y), so near it the casting is not a chain of slices from A to B: four kilograms lie behind the plane through A, and more beside the seat. All of it hangs on the wall of the seat and turns it, but a \
         chain hangs the first part on A itself, and what is beside the seat on a share of its wall, however short its parts. Along z this weight hardly bends the arm, so what it does to the seat is much of all there is. What is left across, {} %, is spread over the hollow body: energy up to a section is the work of its \
         force on its mean motion only while sections move rigidly, and thin-walled ones do not. The frequencies end where the sag does. In a bar the error goes to zero.",
        percent(found.missed_across_the_body(), 1)
    ));
    case.claim(
        format!("casting, weight along z, {MOST} parts: what parts in a row cannot see, an effect of the shape"),
        "the mesh",
        found.missed_along(),
        Bound::AtLeast(0.03),
    );
    case.claim(
        format!(
            "casting, weight along z, {MOST} parts: what they miss of all that lies beyond {} of the way from A",
            CUTS[0]
        ),
        "the mesh",
        found.missed_away_from_the_seat(),
        Bound::AtMost(8e-3),
    );
    case.figure(weight_figure(&found.chains));
}

fn chain_table(chains: &[ChainError]) -> Table {
    let caption = format!(
        "Weight as above, shift of B: error of chains of any number of parts, made from the mesh here, in closed form ({} to {} parts: the numbers of the table above). Then what the weight of the first part alone, from its end at A to the \
         first joint, moves B by in the mesh, over the shift by all of the weight; in a chain it is nothing, for that part is held. Frequencies, with A held, over those of the mesh, less one.",
        COUNTS[0], CHAINS[2]
    );
    let mut table = Table::new(caption, &["parts", "mass of the first part [kg]"]);
    table.columns.extend(AXES.map(String::from));
    table.columns.extend(AXES.map(|axis| format!("first part alone, {axis}")));
    table.columns.extend((1..=MODES).map(|k| format!("f_{k}")));
    for chain in chains {
        let mut row = vec![fixed(chain.parts as f64, 0), fixed(chain.first_mass_kg, 2)];
        row.extend(chain.missed.iter().chain(&chain.by_first_part).map(|e| error(*e)));
        row.extend(chain.hz_errors.iter().map(|e| signed(*e)));
        table.rows.push(row);
    }
    table
}

fn stretch_table(found: &LimitOfParts) -> Table {
    let caption = format!(
        "Where {MOST} parts miss it: difference of the shift by the weight of a stretch of the casting, chain against mesh, over the shift by all of the weight. From joint to joint, by the place of the part's first joint on the way from A to B."
    );
    let mut table = Table::new(caption, &["stretch", "mass [kg]", "x", "y", "z"]);
    for stretch in &found.stretches {
        let cells = [word(&stretch.name), fixed(stretch.mass_kg, 2)].into_iter();
        table.rows.push(cells.chain(stretch.missed.map(error)).collect());
    }
    table
}

fn weight_figure(chains: &[ChainError]) -> Figure {
    let curve = |what: &str, axis: usize, y: Vec<f64>| PlotCurve {
        name: format!("{what} {}", AXES[axis]),
        look: CurveLook::Marked,
        x: chains.iter().map(|chain| chain.parts as f64).collect(),
        y,
    };
    let missed = |k: usize| chains.iter().map(|chain| chain.missed[k]).collect();
    let by_first_part = |k: usize| chains.iter().map(|chain| chain.by_first_part[k]).collect();
    let mut curves: Vec<PlotCurve> = (0..3).map(|k| curve("weight along", k, missed(k))).collect();
    curves.extend((0..3).map(|k| curve("first part alone, along", k, by_first_part(k))));
    Figure {
        name: "lower-arm-weight".into(),
        caption: "Casting under its own weight: error of the shift of B over the number of parts, and what the weight of the first part has in it".into(),
        x_label: "parts".into(),
        logarithmic_x: true,
        panels: vec![Panel { label: "relative error".into(), logarithmic: true, legend: true, curves }],
    }
}
