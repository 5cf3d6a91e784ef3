//! Viewer layouts for a recording: files written beside it and opened with it.
//!
//! Both show the TCP error, its causes, and the drives; Foxglove also shows the arm. Curves have
//! the same colours as elsewhere ([`flexarm_draw::palette`]).

use serde_json::{Value, json};

use super::frames::is_magnified;
use crate::RunHeader;
use flexarm_draw::palette::{self, Ground, Rgb, hex};
use flexarm_settings::written::markup;

/// A plot: title and curves.
struct Plot {
    title: &'static str,
    curves: Vec<Curve>,
}

/// A number in a message: topic, path in the notations of Foxglove and PlotJuggler, name, colour.
struct Curve {
    topic: String,
    foxglove: String,
    plotjuggler: String,
    name: String,
    color: Rgb,
}

const GROUND: Ground = Ground::Dark;

/// Plots with all their curves, without those that a run lacks.
fn plots(header: &RunHeader) -> Vec<Plot> {
    let mut plots = Vec::new();
    let joint = |topic: &str, k: usize, name: &str, part: &str, color: Rgb| Curve {
        topic: topic.to_owned(),
        foxglove: format!(".{part}[{k}]"),
        plotjuggler: format!("/{name}/{part}"),
        name: name.to_owned(),
        color,
    };
    // TCP error.
    if header.has_rigid {
        let world = ["x", "y", "z"].into_iter().enumerate();
        let mut curves: Vec<Curve> =
            world.map(|(k, name)| joint("/tcp/error", k, name, "position", palette::axis(k, GROUND))).collect();
        curves.push(joint("/tcp/error", 6, "norm", "position", palette::total(GROUND)));
        plots.push(Plot { title: "TCP error, world axes [m]", curves });
        let along = ["tangential", "normal", "binormal"].into_iter().enumerate();
        let curves = along.map(|(k, name)| joint("/tcp/error_path", k, name, "position", palette::series(k, GROUND)));
        plots.push(Plot { title: "TCP error along and across the path [m]", curves: curves.collect() });
    }
    // Elastic elements.
    if !header.elements.is_empty() {
        let parts = ["x", "y", "z", "rx", "ry", "rz"];
        let names = header.elements.iter().flat_map(|name| parts.map(|part| format!("{name}/{part}")));
        let color = |k: usize| palette::component(header.color_number(&header.elements[k / 6]), k % 6, GROUND);
        let curves = names.enumerate().map(|(k, name)| joint("/elastic/joint_states", k, &name, "position", color(k)));
        plots.push(Plot { title: "Deflections [m, rad]", curves: curves.collect() });
    }
    // Joints.
    for (title, part) in [("Joint efforts [N m, N]", "effort"), ("Joint positions [rad, m]", "position")] {
        let color = |k: usize| palette::series(header.color_number(&header.joints[k]), GROUND);
        let joints = header.joints.iter().enumerate();
        let curves = joints.map(|(k, name)| joint("/joint_states", k, name, part, color(k))).collect();
        plots.push(Plot { title, curves });
    }
    plots.retain(|plot| !plot.curves.is_empty());
    plots
}

/// Returns a layout for [Foxglove](https://foxglove.dev): the arm with the rigid twin on the left,
/// plots on the right, events below.
pub fn foxglove_layout(header: &RunHeader) -> String {
    let plots = plots(header);
    let mut panels = serde_json::Map::new();
    panels.insert("3D!arm".into(), scene(header));
    panels.insert("RosOut!events".into(), json!({ "searchTerms": [], "minLogLevel": 1, "topicToRender": "/events" }));
    for (k, plot) in plots.iter().enumerate() {
        let paths = plot.curves.iter().map(|curve| {
            json!({
                "value": format!("{}{}", curve.topic, curve.foxglove), "label": curve.name, "color": hex(curve.color),
                "enabled": true, "timestampMethod": "receiveTime",
            })
        });
        let plot = json!({
            "title": plot.title, "paths": paths.collect::<Vec<_>>(), "xAxisVal": "timestamp", "isSynced": true,
            "showXAxisLabels": true, "showYAxisLabels": true, "showLegend": true, "legendDisplay": "floating",
            "showPlotValuesInLegend": false, "sidebarDimension": 240,
        });
        panels.insert(format!("Plot!plot{k}"), plot);
    }
    // Stack the plots vertically with equal heights.
    let names = (0..plots.len()).map(|k| json!(format!("Plot!plot{k}")));
    let column = names.rev().fold((Value::Null, 0), |(below, count): (Value, usize), name| match count {
        0 => (name, 1),
        _ => {
            let share = 100.0 / (count as f64 + 1.0);
            (json!({ "direction": "column", "first": name, "second": below, "splitPercentage": share }), count + 1)
        }
    });
    let left = json!({ "direction": "column", "first": "3D!arm", "second": "RosOut!events", "splitPercentage": 78 });
    let layout = match column {
        (_, 0) => left,
        (column, _) => json!({ "direction": "row", "first": left, "second": column, "splitPercentage": 58 }),
    };
    let all = json!({
        "configById": panels, "globalVariables": {}, "userNodes": {}, "playbackConfig": { "speed": 1 },
        "layout": layout,
    });
    serde_json::to_string_pretty(&all).expect("names and numbers are JSON") + "\n"
}

/// The 3D panel: the magnified arm and the rigid twin, or the arm as it is.
fn scene(header: &RunHeader) -> Value {
    let magnified = is_magnified(header);
    let [low, high] = header.volume.unwrap_or([[-1.5, -1.5, 0.0], [1.5, 1.5, 2.0]]);
    let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
    let size = (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt();
    json!({
        "followMode": "follow-none", "followTf": "world",
        "scene": { "meshUpAxis": "z_up", "transforms": { "showLabel": false, "axisScale": 0 } },
        "cameraState": {
            "perspective": true, "distance": 1.4 * size, "phi": 68, "thetaOffset": 24, "fovy": 45, "near": 0.01,
            "far": 5000, "target": middle, "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
        },
        "transforms": {},
        "topics": {
            "/markers": { "visible": true, "namespaces": {
                "flexible": { "visible": !magnified }, "rigid": { "visible": true }, "magnified": { "visible": magnified },
            } },
            "/markers/path": { "visible": true }, "/markers/error": { "visible": magnified },
            "/robot_description": { "visible": false },
        },
        "layers": { "grid": {
            "layerId": "foxglove.Grid", "instanceId": "grid", "label": "Grid", "visible": true, "frameLocked": true,
            "size": 10, "divisions": 10, "lineWidth": 1, "color": "#63707f", "position": [0, 0, 0], "rotation": [0, 0, 0],
            "order": 1,
        } },
        "publish": {}, "imageMode": {},
    })
}

/// Returns a layout for [PlotJuggler](https://plotjuggler.io): the plots, two per tab.
pub fn plotjuggler_layout(header: &RunHeader) -> String {
    let plots = plots(header);
    let mut tabs = String::new();
    for pair in plots.chunks(2) {
        let area = |plot: &Plot| {
            let curves = plot.curves.iter().map(|curve| {
                let name = markup(&format!("{}{}", curve.topic, curve.plotjuggler));
                format!("       <curve name=\"{name}\" color=\"{}\"/>\n", hex(curve.color))
            });
            format!(
                "     <DockArea name=\"{}\">\n      <plot mode=\"TimeSeries\" style=\"Lines\" flip_x=\"false\" flip_y=\"false\">\n\
                 {}      </plot>\n     </DockArea>\n",
                markup(plot.title),
                curves.collect::<String>()
            )
        };
        let (areas, count): (String, usize) = (pair.iter().map(area).collect(), pair.len());
        let sizes = vec![format!("{}", 1.0 / count as f64); count].join(";");
        tabs += &format!(
            "  <Tab tab_name=\"{}\" containers=\"1\">\n   <Container>\n    <DockSplitter orientation=\"-\" sizes=\"{sizes}\" \
             count=\"{count}\">\n{areas}    </DockSplitter>\n   </Container>\n  </Tab>\n",
            markup(pair[0].title)
        );
    }
    format!(
        "<?xml version='1.0' encoding='UTF-8'?>\n<root>\n <tabbed_widget name=\"Main Window\" parent=\"main_window\">\n{tabs}  \
         <currentTabIndex index=\"0\"/>\n </tabbed_widget>\n <use_relative_time_offset enabled=\"1\"/>\n \
         <Plugins/>\n <customMathEquations/>\n <snippets/>\n</root>\n"
    )
}
