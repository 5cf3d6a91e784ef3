//! A measured arm on a telescopic column, whose own weight is the load: figures stored by
//! `tools/crosscheck/measured_arm.py`, without the data.

use flexarm_draw::{CurveLook, Panel, PlotCurve};
use serde_json::Value;

use crate::bench::{Bench, Stored};
use crate::page::{Bound, Case, Cell, Figure, Table, digits, fixed, percent, plain, word};
use crate::{Error, Pace};

/// Stored figures.
const STORED: &str = "measured_arm.json";
/// Bounds of the distance on poses that were not used: springs, and springs with play (mm).
const HELD_OUT_MM: [f64; 2] = [2.0, 1.35];
/// Bound of the displacement under given springs against an independent model (mm).
const METHOD_MM: f64 = 0.05;
/// Bound of the law of a guide against the measured tilts about x.
const TILT: f64 = 0.05;
/// Standard deviation of a measured position in space (mm).
const INSTRUMENT_MM: f64 = 1.3;

/// Runs the case.
pub(crate) fn case(bench: &Bench, _pace: &mut Pace<'_>) -> Result<Case, Error> {
    let stored = bench.stored(STORED)?;
    let mut case =
        Case::new("measured-arm", "8. A measured arm on a telescopic column", "positions by a total station, tilts");
    case.text(format!(
        "A six-axis arm with a tool on a column of two telescopic tubes, 1.98 to 3.87 m high, with a prism on the tool and a total station ({}). The arm's own weight is the \
         load. {} The figures are stored by `tools/crosscheck/measured_arm.py`, which reads a copy of the data; none of the data is in the project \
         ([measured_arm.md](../measured_arm.md)).",
        text(&stored, "source")?,
        text(&stored, "licence")?
    ));
    method(&mut case, &stored)?;
    places(&mut case, &stored)?;
    tilts(&mut case, &stored)?;
    Ok(case)
}

fn text(stored: &Stored, key: &str) -> Result<String, Error> {
    Ok(stored.at(key)?.as_str().unwrap_or("?").to_owned())
}

fn list<'a>(stored: &'a Stored, key: &str) -> Result<&'a [Value], Error> {
    Ok(stored.at(key)?.as_array().map_or(&[][..], Vec::as_slice))
}

/// The displacement under given springs, without any fit.
fn method(case: &mut Case, stored: &Stored) -> Result<(), Error> {
    case.heading("The method, without a fit");
    let truth = "independent model in numpy";
    for (key, with) in [("springs_mm", "springs"), ("play_mm", "springs and play")] {
        let claim = format!("displacement of the prism under its weight, {with} [m]");
        case.stored_claim(
            claim,
            truth,
            1e-3 * stored.number(&format!("method/{key}"))?,
            Bound::AtMost(1e-3 * METHOD_MM),
        );
    }
    Ok(())
}

/// Measured positions of the prism on poses that were used for the fit and on others.
fn places(case: &mut Case, stored: &Stored) -> Result<(), Error> {
    case.heading("Positions of the tool");
    case.text(format!(
        "Every second pose of one floor is used for the fit; the others, and two other floors, are not. The instrument's standard deviation is {} mm in space. On other floors only \
         the six numbers of the station's pose are new. The fits start from round numbers; with the published URDF, joint frames and zeros are fitted as well.",
        plain(INSTRUMENT_MM)
    ));
    let caption =
        "Root mean square of the distance from the measured position, and largest distance of the held-out poses [mm].";
    let heads = ["model", "URDF", "numbers fitted", "fitted poses", "held out", "largest", "outdoors", "on a pallet"];
    let mut table = Table::new(caption, &heads);
    table.rows.push(row("rigid", stored.at("rigid")?, "6"));
    let frames = stored.at("rigid_frames")?;
    table.rows.push(row("rigid, joint frames fitted", frames, &count(frames)));
    for (k, model) in list(stored, "models")?.iter().enumerate() {
        let play = model["play"].as_bool() == Some(true);
        let name = match model["about"].as_str() {
            Some("y") => "springs, play about y",
            Some("xy") => "springs, play about x and y",
            _ => "springs",
        };
        table.rows.push(row(name, model, &count(model)));
        // Each model is compared with the rigid robot of the same URDF, with the same frames.
        let rigid = if model["urdf"] == "published" { "rigid_frames" } else { "rigid" };
        let rigid_mm = stored.number(&format!("{rigid}/held_out/rms_mm"))?;
        let held = stored.number(&format!("models/{k}/held_out/rms_mm"))?;
        let claim = format!(
            "held-out positions over those of the rigid robot: {name}, {} URDF",
            model["urdf"].as_str().unwrap_or("?")
        );
        let bound = HELD_OUT_MM[usize::from(play)] / rigid_mm;
        case.stored_claim(claim, "total station", held / rigid_mm, Bound::AtMost(bound));
    }
    case.table(table);
    case.figure(distances(stored)?);
    Ok(())
}

fn count(model: &Value) -> String {
    model["free_numbers"].as_u64().map_or("?".to_owned(), |n| n.to_string())
}

fn row(name: &str, model: &Value, numbers: &str) -> Vec<Cell> {
    let mm = |set: &str, key: &str| model[set][key].as_f64().map_or(word("-"), |x| fixed(x, 2));
    vec![
        word(name),
        word(model["urdf"].as_str().unwrap_or("calibrated")),
        word(numbers),
        mm("train", "rms_mm"),
        mm("held_out", "rms_mm"),
        mm("held_out", "max_mm"),
        mm("outdoor", "rms_mm"),
        mm("pallet", "rms_mm"),
    ]
}

/// Distances of the held-out poses in ascending order.
fn distances(stored: &Stored) -> Result<Figure, Error> {
    let rows = list(stored, "scatter")?;
    let sorted = |column: usize| {
        let mut mm: Vec<f64> = rows.iter().filter_map(|row| row[column].as_f64()).collect();
        mm.sort_by(f64::total_cmp);
        mm
    };
    let curve = |name: &str, column: usize| {
        let y = sorted(column);
        let x = (0..y.len()).map(|k| 100.0 * (k as f64 + 0.5) / y.len() as f64).collect();
        PlotCurve { name: name.into(), look: CurveLook::Plain, x, y }
    };
    Ok(Figure {
        name: "measured-arm-distances".into(),
        caption: "held-out poses: distance from the measured position, in ascending order".into(),
        x_label: "share of the poses [%]".into(),
        logarithmic_x: false,
        panels: vec![Panel {
            label: "distance [mm]".into(),
            logarithmic: false,
            legend: true,
            curves: vec![curve("springs", 0), curve("springs and play", 1)],
        }],
    })
}

/// Tilt of the column over the moment of the weight, measured by two accelerometers.
fn tilts(case: &mut Case, stored: &Stored) -> Result<(), Error> {
    case.heading("Tilt of the column");
    let caption = "Tilt of the column's tip against its foot over the moment of the weight [urad/(N m)]: accelerometers, and the law of a telescopic guide with both overlaps.";
    let mut table = Table::new(caption, &["height [m]", "axis", "measured", "law", "R2", "law - measured [%]"]);
    let mut worst = 0.0f64;
    for tilt in list(stored, "tilts")? {
        let number = |key: &str| tilt[key].as_f64().unwrap_or(f64::NAN);
        let axis = tilt["axis"].as_str().unwrap_or("?");
        let [measured, law] = ["measured_urad_per_nm", "law_urad_per_nm"].map(number);
        let apart = law / measured - 1.0;
        if axis == "x" {
            worst = worst.max(apart.abs());
        }
        table.rows.push(vec![
            fixed(number("height_m"), 2),
            word(axis),
            digits(measured, 3),
            digits(law, 3),
            fixed(number("r2"), 3),
            word(percent(apart, 1)),
        ]);
    }
    case.table(table);
    case.stored_claim("law of the tilt about x at five heights", "accelerometers", worst, Bound::AtMost(TILT));
    Ok(())
}
