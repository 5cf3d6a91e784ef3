//! The report page of real runs: it loads no external files, agrees with the runs, and is
//! reproducible.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use flexarm_log::Trace;
use flexarm_run::{
    DifferenceFigures, DriveModel, Keep, LinkModel, Modelling, Motion, Outputs, ReportRun, Robot, RunOptions,
    RunRequest, Summary, html, markdown,
};

type Run = (Summary, Trace);

fn run(robot: &str, trajectory: &str, options: &RunOptions, outputs: Option<&Outputs>) -> Run {
    run_as(robot, trajectory, &Modelling::default(), options, outputs)
}

fn run_as(
    robot: &str,
    trajectory: &str,
    modelling: &Modelling,
    options: &RunOptions,
    outputs: Option<&Outputs>,
) -> Run {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let robot = Robot::load(root.join("robots").join(robot)).unwrap();
    let model = robot.rigid_model().unwrap();
    let motion = Motion::load_for(&root.join("trajectories").join(trajectory), &model).unwrap();
    let arm = robot.model(modelling).unwrap();
    let run = arm.simulate_with(&motion, options, RunRequest { outputs, ..RunRequest::keeping(Keep::Curves) }).unwrap();
    (run.summary, run.trace)
}

/// The shipped arm on its cycle, simulated once for all tests.
fn arm() -> &'static Run {
    static RUN: OnceLock<Run> = OnceLock::new();
    RUN.get_or_init(|| run("kr210", "pick_and_place.toml", &RunOptions::default(), None))
}

fn page_of((summary, trace): &Run) -> String {
    html(&[ReportRun { label: "run", summary, trace }])
}

/// The page without the paragraph of timings.
fn timeless(page: &str) -> String {
    let (before, rest) = page.split_once("<p id=\"timings\"").unwrap();
    before.to_owned() + rest.split_once("</p>").unwrap().1
}

fn data_of(page: &str) -> serde_json::Value {
    let (_, rest) = page.split_once("<script type=\"application/json\" id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("flexarm-report-{}-{name}", std::process::id())))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_page_refers_to_nothing_outside() {
    let page = page_of(arm());
    for scheme in ["http:", "https:", "file:", "ftp:", "//cdn", "@import", "url(", "import("] {
        assert!(!page.contains(scheme), "{scheme} at {:?}", page.find(scheme).map(|at| &page[at - 40..at + 40]));
    }
    for attribute in [" src=", " href=", " srcset=", " action="] {
        for (at, _) in page.match_indices(attribute) {
            let value = page[at + attribute.len()..].trim_start_matches('"');
            assert!(value.starts_with("data:") || value.starts_with('#'), "{}", &page[at..at + 60]);
        }
    }
    for tag in ["<link", "<iframe", "<object", "<embed", "<base"] {
        assert!(!page.contains(tag), "{tag}");
    }
}

#[test]
fn the_page_of_the_shipped_arm_is_small_and_complete() {
    let (summary, trace) = arm();
    let page = page_of(arm());
    links_lead_somewhere(&page);
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    assert!(page.contains("ISO 9283-style, not a conformity test"));
    assert!(page.contains(&format!("{:.3}", 1e3 * summary.tcp.as_ref().unwrap().peak_m)), "the peak is a tile");
    if cfg!(feature = "png") {
        assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 2);
    } else {
        assert!(page.contains("without the feature png"));
    }
    let data = data_of(&page);
    let plots = data["runs"][0]["plots"].as_array().unwrap();
    let ids: Vec<&str> = plots.iter().map(|plot| plot["id"].as_str().unwrap()).collect();
    for id in ["tcp_error", "path_time", "path_length", "spectrum", "contributions", "element_force", "torques"] {
        assert!(ids.contains(&id), "{id} of {ids:?}");
    }
    // Truth: the maximum error of the run, to the five digits of the page.
    let size = &plots[0]["views"][0]["tables"][0]["curves"][0];
    let largest = size["y"].as_array().unwrap().iter().map(|y| y.as_f64().unwrap()).fold(0.0, f64::max);
    assert!((largest / (1e3 * summary.tcp.as_ref().unwrap().peak_m) - 1.0).abs() < 1e-4);
    let events = data["runs"][0]["events"].as_array().unwrap();
    assert_eq!(events.len(), trace.result.events.len());
    for plot in plots {
        for table in plot["views"].as_array().unwrap().iter().flat_map(|v| v["tables"].as_array().unwrap()) {
            let x = table["x"].as_array().unwrap();
            assert!(x.len() <= 3100, "{} points in {}", x.len(), plot["id"]);
            assert!(x.windows(2).all(|pair| pair[0].as_f64() <= pair[1].as_f64()), "{} ascends", plot["id"]);
            assert!(table["curves"].as_array().unwrap().iter().all(|c| c["y"].as_array().unwrap().len() == x.len()));
        }
    }
}

/// Truth: the colour table of recordings and figures.
#[test]
fn x_y_and_z_have_one_colour_each_in_plots_pictures_and_figures() {
    use flexarm_draw::palette::{Ground, axis, hex, series};
    let page = page_of(arm());
    let (style, _) = page.split_once("</style>").unwrap();
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        for ground in [Ground::Paper, Ground::Dark] {
            assert!(style.contains(&format!(" --{name}: {};", hex(axis(k, ground)))), "{name}");
        }
        assert!(style.contains(&format!(" --paper-{name}: {};", hex(axis(k, Ground::Paper)))), "print");
    }
    assert!(style.contains(&format!(" --c13: {};", hex(series(13, Ground::Paper)))));
    for plot in data_of(&page)["runs"][0]["plots"].as_array().unwrap() {
        for curve in plot["views"].as_array().unwrap().iter().flat_map(|view| {
            view["tables"].as_array().unwrap().iter().flat_map(|table| table["curves"].as_array().unwrap())
        }) {
            let (name, kind) = (curve["name"].as_str().unwrap(), curve["kind"].as_str().unwrap());
            assert_eq!(["x", "y", "z"].contains(&name), ["x", "y", "z"].contains(&kind), "{} {name}", plot["id"]);
            assert!(!["x", "y", "z"].contains(&kind) || name == kind, "{} {name}", plot["id"]);
        }
    }
    if cfg!(feature = "png") {
        assert_eq!(page.matches("<svg class=\"triad\"").count(), 2, "the axes of both pictures");
        assert!(page.contains("stroke:var(--z);fill:var(--z)") && page.contains("linear-gradient"));
    }
}

/// Truth: the identity of net and gross work, and the energy that an arm of a tonne takes up and
/// returns.
#[test]
fn work_of_the_drives_is_called_net_and_stands_beside_what_they_put_in_and_took_out() {
    let (summary, _) = arm();
    let e = &summary.energy;
    assert!((e.drives_positive_j - e.drives_negative_j - e.drives_j).abs() < 1e-9 * e.drives_positive_j);
    assert!(e.drives_positive_j > 100.0 && e.drives_positive_j > 10.0 * e.drives_j.abs(), "{e:?}");
    let page = page_of(arm());
    for words in ["net work of the drives", "work put in by the drives", "taken out by the drives"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(markdown(summary).contains("positive "));
}

#[test]
fn the_same_run_gives_the_same_page_but_for_its_timings() {
    let options = RunOptions::default();
    let pages = [(); 2].map(|()| page_of(&run("test/one_beam", "beam_swing.toml", &options, None)));
    assert!(timeless(&pages[0]) == timeless(&pages[1]));
    // Different timings change only that paragraph.
    let (summary, trace) = arm();
    let slower =
        Summary { wall_s: 12.345, cpu_s: 3.0, real_time_factor: 0.5, cpu_s_per_simulated_s: 2.0, ..summary.clone() };
    let [page, slow] = [summary, &slower].map(|s| html(&[ReportRun { label: "run", summary: s, trace }]));
    assert!(page != slow && timeless(&page) == timeless(&slow));
}

#[test]
fn names_cannot_break_the_page() {
    const EVIL: &str = "</script><script>alert(1)</script><b a='x' b=\"y\">&amp; <!-- \\ \u{2028}";
    let harmless = run("test/one_beam", "beam_swing.toml", &RunOptions::default(), None);
    let (mut summary, mut trace) = harmless.clone();
    summary.robot = EVIL.into();
    summary.warnings.push(EVIL.into());
    summary.end = EVIL.into();
    summary.links[0].name = EVIL.into();
    trace.header.contributors[0] = EVIL.into();
    trace.header.metadata.push((EVIL.into(), vec![(EVIL.into(), EVIL.into())]));
    trace.result.events[0].text = EVIL.into();
    for count in [1, 2] {
        let page = html(&vec![ReportRun { label: EVIL, summary: &summary, trace: &trace }; count]);
        let plain = html(&vec![ReportRun { label: "x", summary: &harmless.0, trace: &harmless.1 }; count]);
        for piece in ["</script>", "<script>", "<!--", "<b "] {
            assert_eq!(page.matches(piece).count(), plain.matches(piece).count(), "{piece}");
        }
        let data = data_of(&page);
        assert_eq!(data["runs"][0]["events"][0]["text"], EVIL, "what is said is said");
        assert_eq!(data["runs"][0]["label"], EVIL);
    }
}

#[test]
fn a_run_without_a_twin_leaves_out_what_needs_one() {
    let options = RunOptions { with_twin: false, ..RunOptions::default() };
    let run = run("test/one_beam", "beam_swing.toml", &options, None);
    let page = page_of(&run);
    links_lead_somewhere(&page);
    for absent in ["ISO 9283", "Peak TCP error", "data:image/png", "\"tcp_error\"", "\"contributions\""] {
        assert!(!page.contains(absent), "{absent}");
    }
    for present in ["\"torques\"", "\"element_moment\"", "\"energy\"", "First natural frequency"] {
        assert!(page.contains(present), "{present}");
    }
}

#[test]
fn several_runs_lie_over_each_other() {
    let modelling = Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() };
    let rigid = run_as("kr210", "pick_and_place.toml", &modelling, &RunOptions::default(), None);
    let fine = run("kr210", "pick_and_place.toml", &RunOptions { step_s: 2e-3, ..RunOptions::default() }, None);
    let runs = [("as it is", arm()), ("coarse <step>", &fine), ("rigid", &rigid)];
    let runs = runs.map(|(label, (summary, trace))| ReportRun { label, summary, trace });
    let page = html(&runs);
    let data = data_of(&page);
    assert_eq!(data["runs"].as_array().unwrap().len(), 3);
    let overlays = data["overlays"].as_array().unwrap();
    let ids: Vec<&str> = overlays.iter().map(|plot| plot["id"].as_str().unwrap()).collect();
    assert_eq!(ids, ["all_error", "all_path", "all_spectrum"]);
    for plot in &overlays[..2] {
        let tables = plot["views"][0]["tables"].as_array().unwrap();
        let labels: Vec<&str> = tables.iter().map(|t| t["curves"][0]["name"].as_str().unwrap()).collect();
        assert_eq!(labels, ["as it is", "coarse <step>", "rigid"]);
    }
    assert!(page.contains("Figures side by side") && page.contains("coarse &lt;step&gt;"));
    if cfg!(feature = "png") {
        assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 4, "two pictures of each run that bends");
    }
    assert!(page.contains("rigid: nothing is flexible"));
    // Per cent stand with lengths, angles and frequencies alone.
    let row =
        |name: &str| page.split_once(&format!("<th>{name}</th>")).unwrap().1.split_once("</tr>").unwrap().0.to_owned();
    assert!(row("peak TCP error").contains(" %)"));
    for name in ["time of the peak", "settling time", "work of the drives, net", "work put in by the drives"] {
        assert!(!row(name).contains(" %)"), "{name}");
    }
    links_lead_somewhere(&page);

    // The rigid run has no spectrum; those of the others are shown although it is the first.
    let runs =
        [("rigid", &rigid), ("as it is", arm())].map(|(label, (summary, trace))| ReportRun { label, summary, trace });
    let data = data_of(&html(&runs));
    let last = data["overlays"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(last["id"], "all_spectrum");
    assert_eq!(last["views"][0]["tables"][0]["curves"][0]["name"], "as it is");
}

fn links_lead_somewhere(page: &str) {
    let targets: Vec<&str> = page.split("href=\"#").skip(1).map(|rest| rest.split_once('"').unwrap().0).collect();
    assert!(targets.contains(&"plots") && targets.contains(&"inputs"), "{targets:?}");
    for target in targets {
        assert_eq!(page.matches(&format!("id=\"{target}\"")).count(), 1, "{target}");
    }
}

/// Truth: [`DifferenceFigures`] of the summary.
#[test]
fn a_study_says_how_far_its_runs_are_apart() {
    let (summary, trace) = arm();
    let apart = DifferenceFigures { peak_m: 1.2345e-3, of_peak_error: Some(0.4321), ..DifferenceFigures::default() };
    let other = Summary { difference: Some(apart), ..summary.clone() };
    let page = html(&[("a", summary), ("b", &other)].map(|(label, summary)| ReportRun { label, summary, trace }));
    assert!(page.contains("<td class=\"number\">1.2345</td>") && page.contains("<td class=\"number\">43.21</td>"));
}

#[test]
fn an_arm_on_its_twin_has_no_scale_and_no_peak() {
    let modelling = Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() };
    let rigid = run_as("test/one_beam", "beam_swing.toml", &modelling, &RunOptions::default(), None);
    let page = page_of(&rigid);
    assert!(!page.contains("magnified") && !page.contains("data:image/png") && page.contains("nothing is flexible"));
    let data = data_of(&page);
    let events = data["runs"][0]["events"].as_array().unwrap();
    assert!(events.iter().all(|event| event["kind"] != "peak"), "{events:?}");
}

#[test]
fn the_page_names_the_payload_and_follows_dark_screens_and_paper() {
    let page = page_of(arm());
    assert!(page.contains("<span>payload 150 kg</span>"));
    for part in ["name=\"viewport\"", "prefers-color-scheme: dark", "@media print", "print-color-adjust: exact"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn the_band_of_settling_and_the_models_are_named() {
    let page = page_of(&run(
        "test/one_beam",
        "beam_swing.toml",
        &RunOptions { settling_band_m: 2.5e-4, ..RunOptions::default() },
        None,
    ));
    assert!(page.contains("TCP stays within 0.25 mm of its final value"));
    assert!(page.contains("<dt>settling_band_m</dt><dd>0.00025</dd>"));
    assert!(page.contains("<dt>drives</dt><dd>as the robot file says</dd>"));
    let (_, inputs) = page.split_once("id=\"inputs\"").unwrap();
    let (inputs, _) = inputs.split_once("<script").unwrap();
    assert!(!inputs.contains("/../"), "paths are straight");
}

#[test]
fn no_runs_and_runs_without_a_sample_still_make_a_page() {
    assert!(html(&[]).contains("<title>"));
    let page = html(&[ReportRun { label: "", summary: &Summary::default(), trace: &Trace::default() }]);
    assert!(page.contains("</html>"));
}

#[test]
fn the_summary_can_be_read_back() {
    let (summary, _) = arm();
    let json = serde_json::to_string(summary).unwrap();
    let read: Summary = serde_json::from_str(&json).unwrap();
    assert_eq!(Summary { error_curve: summary.error_curve.clone(), ..read.clone() }, *summary);
    assert_eq!(serde_json::to_string(&read).unwrap(), json);
    // A file of an older version lacks keys.
    let mut old: serde_json::Value = serde_json::from_str(&json).unwrap();
    for key in ["moves_s", "files", "tcp"] {
        old.as_object_mut().unwrap().remove(key);
    }
    let read: Summary = serde_json::from_value(old).unwrap();
    assert_eq!((read.tcp, read.robot), (None, summary.robot.clone()));
}

#[test]
fn the_files_of_a_run_are_written_and_not_overwritten() {
    let folder = Folder::new("files");
    let outputs = Outputs { recordings: BTreeSet::new(), figures: true, ..Outputs::everything(&folder.0) };
    let (summary, _) = run("test/one_beam", "beam_swing.toml", &RunOptions::default(), Some(&outputs));
    let text = |name: &str| std::fs::read_to_string(folder.0.join(name)).unwrap();
    assert!(summary.files.report.as_ref().unwrap().ends_with("report.html"));
    assert!(summary.files.report_md.as_ref().unwrap().ends_with("report.md"));
    assert_eq!(text("report.md"), markdown(&summary));
    assert!(text("report.html").contains("one_beam on beam_swing"));
    let read: Summary = serde_json::from_str(&text("summary.json")).unwrap();
    assert_eq!(read.files, summary.files);

    let figures = folder.0.join("figures");
    assert_eq!(summary.files.figures, Some(figures.display().to_string()));
    let names: Vec<String> =
        std::fs::read_dir(&figures).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(names.contains(&"arm_side.png".to_owned()), cfg!(feature = "png"));
    let svgs = names.iter().filter(|name| name.ends_with(".svg"));
    for svg in svgs.clone() {
        assert!(text(&format!("figures/{svg}")).contains("width=\"88mm\""), "{svg}");
        let csv = text(&format!("figures/{}", svg.replace(".svg", ".csv")));
        assert!(csv.lines().count() > 10 && csv.lines().next().unwrap().contains('_'), "{svg}: {csv}");
    }
    assert!(svgs.count() >= 10);
    assert!(text("figures/tcp_error.csv").starts_with("time_s,size_mm,x_mm,y_mm,z_mm\n"));

    // Any existing one of them stops the next run before it writes.
    for name in ["report.html", "report.md", "summary.json", "figures"] {
        let other = Folder::new(name);
        std::fs::create_dir_all(&other.0).unwrap();
        std::fs::write(other.0.join(name), "mine").unwrap();
        let outputs = Outputs { folder: other.0.clone(), ..outputs.clone() };
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let robot = Robot::load(root.join("robots/test/one_beam")).unwrap();
        let motion =
            Motion::load_for(&root.join("trajectories/beam_swing.toml"), &robot.rigid_model().unwrap()).unwrap();
        let arm = robot.model(&Modelling::default()).unwrap();
        let request = RunRequest { outputs: Some(&outputs), ..RunRequest::default() };
        let error = arm.simulate_with(&motion, &RunOptions::default(), request).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        assert_eq!(std::fs::read_to_string(other.0.join(name)).unwrap(), "mine");
    }
}
