//! The table of a run.

use flexarm::Summary;
use flexarm::runs::{DifferenceFigures, Files, LinkFigures, StepperFigures, TcpFigures};
use flexarm_cli::internals::{ALERT, HEADLINE, columns, summary};

fn example() -> Summary {
    let tcp = TcpFigures {
        peak_m: 1.4159e-3,
        t_peak_s: 0.6,
        rms_m: 1.1e-3,
        path_peak_m: [1e-3, 2e-4, 3e-4],
        settling_s: Some(0.25),
        dominant_hz: Some(15.72),
        ..TcpFigures::default()
    };
    Summary {
        robot: "arm".into(),
        trajectory: "swing".into(),
        links_model: "lumped".into(),
        end: "complete".into(),
        duration_s: 2.0,
        stepper: StepperFigures { name: "rk4".into(), h_s: 1e-3, steps: 2000, ..StepperFigures::default() },
        tcp: Some(tcp),
        links: vec![LinkFigures {
            name: "bar".into(),
            peak_contribution_m: 1.2e-3,
            engineering_strain: 4.5e-5,
            peak_rotation_rad: 7e-4,
        }],
        moves_s: vec![[0.0, 1.0]],
        error_curve: (0..200).map(|k| 1.4159e-3 * (0.05 * f64::from(k)).sin().abs()).collect(),
        files: Files { report: Some("out/report.html".into()), ..Files::default() },
        ..Summary::default()
    }
}

/// Text as written to a pipe.
fn plain(of: &Summary, width: usize) -> String {
    anstream::adapter::strip_str(&summary(of, width)).to_string()
}

#[test]
fn the_plain_table_is_aligned_and_has_a_plot() {
    let expected = "\
arm on swing, lumped links

TCP
  peak TCP error           1.4159 mm    at 0.600 s
  RMS TCP error            1.1000 mm
  peak along the path      1.0000 mm
  peak normal to the path  0.2000 mm    binormal 0.3000 mm
  path accuracy            0.0000 mm    maximum distance from the path while
                                        moving
  static sag at the start  0.0000 mm
  error at the end         0.0000 mm
  peak rotation            0.0000 mrad  RMS 0.0000 mrad
  overshoot after a move   0.0000 mm
  settling time             0.250 s     after the last move
  dominant frequency        15.72 Hz

links and drives
  link bar                 1.2000 mm    maximum TCP motion; strain 4.5e-5,
                                        bending angle 0.7000 mrad

run
  steps                      2000       rk4, 1 ms, 0.0 evaluations per step
  simulated                  2.00 s
  wall time                  0.00 s     0 times real time
  CPU time                    0.0 ms    per simulated second

TCP error over time, mm
  1.416 ┤⠀⠀⠀⠀⠀⠀⣀⡤⠖⠋⠉⠉⠉⠓⠲⢤⣀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⣀⡤⠖⠚⠉⠉⠉⠓⠲⢤⣀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⣀⡤⠖⠋⠉⠉⠉⠙⠲⢤⣀⠀⠀⠀⠀⠀⠀⠀⠀⠀
        │⠀⠀⠀⢀⣰⠚⠁⠀⠀⠀⠀⠀⠀⠀⠀⠀⠈⠳⣄⡀⠀⠀⠀⠀⠀⢀⡴⠚⠁⠀⠀⠀⠀⠀⠀⠀⠀⠀⠈⠳⣄⡀⠀⠀⠀⠀⠀⢀⡤⠞⠁⠀⠀⠀⠀⠀⠀⠀⠀⠀⠈⠳⣄⡀⠀⠀⠀⠀⠀⢀
        │⠀⢀⡴⠋⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠓⣆⡀⠀⢀⡴⠋⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠓⣆⠀⠀⢀⡴⠋⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠳⢤⠀⠀⢀⡴⠋
        │⠤⠏⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠳⠴⠋⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠈⠹⠴⠚⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠀⠈⠹⣴⠋⠀⠀
      0 └━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━━───────────────────────────────────
         0                            ━ moves                            2.00 s

files
  report   out/report.html
";
    assert_eq!(plain(&example(), 80), expected);
}

/// The TCP error and its contributors come first.
#[test]
fn the_first_line_says_what_bends() {
    let headline = "TCP error 6.01 mm = 5.02 static + 0.99 dynamic (maximum 2.85); links 1.41, gearboxes 4.61";
    let text = plain(&Summary { headline: headline.into(), ..example() }, 120);
    assert!(text.starts_with(&format!("{headline}\narm on swing")), "{text}");
}

/// A study of `runs` runs.
fn study_of(runs: usize) -> Summary {
    let run = |label: String| {
        let difference = DifferenceFigures { peak_m: 2.3456e-3, of_peak_error: Some(123.456), ..Default::default() };
        Summary { label: Some(label), difference: Some(difference), frequencies_hz: vec![15.72], ..example() }
    };
    let labels = (1..runs).map(|k| format!("links=modal,modes={k},stepper=generalized-alpha,step=5e-4,rho-inf=0.8"));
    Summary { with: labels.map(run).collect(), label: Some("as given".into()), ..example() }
}

#[test]
fn no_line_is_wider_than_the_terminal() {
    for summary in [example(), study_of(2), study_of(3), study_of(9)] {
        for width in [40, 60, 79, 80, 120] {
            let text = plain(&summary, width);
            let widest = text.lines().map(columns).max().unwrap_or(0);
            assert!(widest <= width, "{widest} of {width} columns:\n{text}");
            assert!(text.lines().all(|line| line == line.trim_end()), "blanks at the end of a line:\n{text}");
        }
    }
}

#[test]
fn numbers_of_a_study_stay_whole() {
    for runs in [2, 3, 9] {
        for width in [40, 60, 79, 80, 120, 200] {
            let text = plain(&study_of(runs), width);
            let count = |number: &str| text.split_whitespace().filter(|word| *word == number).count();
            assert_eq!(count("2.3456"), runs - 1, "{width} columns:\n{text}");
            assert_eq!(count("12345.600"), runs - 1, "{width} columns:\n{text}");
        }
    }
}

#[test]
fn the_peak_is_bold_and_a_stop_is_red() {
    let stopped = Summary { end: "diverged at t = 1 s".into(), ..example() };
    let text = summary(&stopped, 80);
    assert!(text.contains(&format!("{ALERT}  STOPPED EARLY")), "{text}");
    assert!(text.contains(&format!("{HEADLINE}  peak TCP error")), "{text}");
}

#[test]
fn nothing_to_plot_is_no_plot() {
    for error_curve in [vec![], vec![0.0; 50], vec![f64::NAN; 50]] {
        assert!(!plain(&Summary { error_curve, ..example() }, 80).contains("over time"));
    }
}
