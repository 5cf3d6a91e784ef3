//! Tables from other programs: the same motion in every dialect, and errors for ambiguous tables.

use std::f64::consts::PI;

use flexarm_trajectory::{ColumnMap, KnownJoint, TableRequest, Trajectory, TrajectoryError, text_of_bytes};

const JOINTS: [KnownJoint<'static>; 3] = [
    KnownJoint { name: "joint_1", is_prismatic: false },
    KnownJoint { name: "joint_2", is_prismatic: false },
    KnownJoint { name: "rail", is_prismatic: true },
];

fn request(columns: Option<&ColumnMap>) -> TableRequest<'_> {
    TableRequest { columns, joints: Some(&JOINTS) }
}

/// Rows (t in s, joint_1 in deg, joint_2 in deg) of the motion in all tables.
fn rows() -> Vec<[f64; 3]> {
    (0..11)
        .map(|k| f64::from(k) * 0.05)
        .map(|t| [t, 30.0 * (2.0 * t).sin(), -12.5 * t * t])
        .map(|row| row.map(|x| (1e6 * x).round() / 1e6))
        .collect()
}

/// The same motion in the library's own CSV format.
fn truth() -> Trajectory {
    let mut text = "# unit: deg\ntime,joint_1,joint_2\n".to_owned();
    for [t, a, b] in rows() {
        text += &format!("{t},{a},{b}\n");
    }
    Trajectory::parse_csv(&text, "truth.csv").unwrap()
}

/// Largest difference from the truth (rad).
fn difference(motion: &Trajectory) -> f64 {
    let motion = motion.with_joint_order(&["joint_1", "joint_2"]).unwrap();
    let truth = truth();
    assert!((motion.duration() - truth.duration()).abs() < 1e-12, "{}", motion.duration());
    let mut worst = 0.0f64;
    for i in 0..=500 {
        let t = truth.duration() * f64::from(i) / 500.0;
        let (mut q, mut p, mut x, mut y) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
        motion.sample(t, &mut q, &mut x, &mut y);
        truth.sample(t, &mut p, &mut x, &mut y);
        worst = worst.max((q[0] - p[0]).abs()).max((q[1] - p[1]).abs());
    }
    worst
}

fn table(header: &str, row: impl Fn([f64; 3]) -> String) -> String {
    let mut text = header.to_owned();
    rows().into_iter().for_each(|values| text += &(row(values) + "\n"));
    text
}

fn comma(x: f64) -> String {
    x.to_string().replace('.', ",")
}

#[test]
fn one_motion_in_every_dialect_is_the_motion_of_our_own_csv() {
    let rad = |x: f64| x * PI / 180.0;
    let cases: Vec<(&str, String, &str)> = vec![
        (
            "semicolons, decimal commas",
            table("Time[s];joint_1[deg];joint_2[deg]\n", |[t, a, b]| format!("{};{};{}", comma(t), comma(a), comma(b))),
            "table, semicolons, decimal commas",
        ),
        ("tabs", table("t [s]\tjoint_1 (deg)\tjoint_2 (deg)\n", |[t, a, b]| format!("{t}\t{a}\t{b}")), "table, tabs"),
        (
            "spaces",
            table("time_s joint_1_rad   joint_2_rad\n", |[t, a, b]| format!("  {t:.6}   {:?}  {:?} ", rad(a), rad(b))),
            "table, spaces",
        ),
        (
            "bom, crlf, quotes",
            "\u{feff}\"Time [ms]\",\"joint_1 [deg]\",\"joint_2 [deg]\"\r\n".to_owned()
                + &table("", |[t, a, b]| format!("\"{}\",\"{a}\",\"{b}\"\r", (1000.0 * t).round())),
            "table, commas",
        ),
        (
            "quoted decimal commas",
            table("Time[s],joint_1[deg],joint_2[deg]\n", |[t, a, b]| {
                format!("\"{}\",\"{}\",\"{}\"", comma(t), comma(a), comma(b))
            }),
            "table, commas, decimal commas",
        ),
        (
            "a line of units",
            table("Time;joint_1;joint_2\ns;deg;deg\n", |[t, a, b]| format!("{t};{a};{b}")),
            "table, semicolons",
        ),
        (
            "header in a comment, as numpy writes it",
            table("# made by numpy.savetxt\n# time joint_1[deg] joint_2[deg]\n", |[t, a, b]| {
                format!("{t:e} {a:e} {b:e}")
            }),
            "table, spaces",
        ),
        (
            "paths of topics",
            table("__time,/joint_states/joint_1/position,/joint_states/joint_2/position\n", |[t, a, b]| {
                format!("{},{:?},{:?}", 1_700_000_000.0 + t, rad(a), rad(b))
            }),
            "table, commas",
        ),
        (
            "ns since 1970",
            table("timestamp;joint_1[deg];joint_2[deg]\n", |[t, a, b]| {
                format!("{};{a};{b}", 1_700_000_000_123_456_789_i64 + (1e9 * t).round() as i64)
            }),
            "table, semicolons",
        ),
        (
            "columns that are not of the motion",
            table("No;t[s];joint_2[deg];state;joint_1[deg];F_x[N]\n", |[t, a, b]| format!("7;{t};{b};moving;{a};-")),
            "table, semicolons",
        ),
        (
            "dates and times of day",
            table("Date;joint_1[deg];joint_2[deg]\n", |[t, a, b]| {
                format!("2024-03-01 23:59:59.{:03};{a};{b}", (1000.0 * t).round())
            })
            .replace("Date", "Timestamp"),
            "table, semicolons",
        ),
        (
            "unit in a comment",
            table("# unit: deg\nt;joint_1;joint_2\n", |[t, a, b]| format!("{t};{a};{b}")),
            "table, semicolons",
        ),
    ];
    for (what, text, format) in cases {
        let (motion, info) =
            Trajectory::parse_table(&text, what, &request(None)).unwrap_or_else(|e| panic!("{what}: {e}"));
        let worst = difference(&motion);
        println!("{what}: {worst:.1e} rad");
        assert!(worst < 1e-9, "{what}: {worst:e}");
        assert_eq!((info.format.as_str(), info.rows), (format, 11), "{what}");
    }
}

#[test]
fn our_own_format_is_read_as_ever() {
    let text = "# unit: deg\ntime,joint_1,joint_1.vel\n0,0,0\n1,30,0\n";
    let (motion, info) = Trajectory::parse_table(text, "own", &request(None)).unwrap();
    assert_eq!(motion, Trajectory::parse_csv(text, "own").unwrap());
    assert_eq!(info.format, "CSV samples");
    let (motion, _) = Trajectory::parse_table("time,joint_1,axis\n0,0,0\n1,1,1\n", "own", &request(None)).unwrap();
    assert_eq!((motion.joints(), dropped(&motion)), (&["joint_1".to_owned()][..], vec!["axis".to_owned()]));
}

#[test]
fn the_user_names_columns_units_and_numbers() {
    let text = table("Zeit;A1;A2;A3\n", |[t, a, b]| format!("{};{};{};99999", 1000.0 * t, a, b * PI / 180.0));
    for map in ["t=Zeit[ms],joint_1=A1[deg],joint_2=A2[rad]", "time = #1[ms], joint_2=#3, joint_1=#2[deg]"] {
        let map: ColumnMap = map.parse().unwrap();
        let (motion, _) = Trajectory::parse_table(&text, "map", &request(Some(&map))).unwrap();
        assert!(difference(&motion) < 1e-9);
    }
    // Without a header, by number.
    let text = table("", |[t, a, b]| format!("{t} {a} {b}"));
    let map: ColumnMap = "t=#1[s],joint_1=#2[deg],joint_2=#3[deg]".parse().unwrap();
    assert!(difference(&Trajectory::parse_table(&text, "map", &request(Some(&map))).unwrap().0) < 1e-9);
    // The full name has priority over the name without unit.
    let text = table("t[s],A[deg],A[rad],x\n", |[t, a, b]| format!("{t},{a},{},{b}", a * PI / 180.0));
    let map: ColumnMap = "joint_1=A[rad],joint_2=x[deg]".parse().unwrap();
    assert!(difference(&Trajectory::parse_table(&text, "map", &request(Some(&map))).unwrap().0) < 1e-9);
    assert!("joint_1".parse::<ColumnMap>().is_err() && "".parse::<ColumnMap>().is_err());
}

#[test]
fn velocities_are_used_in_their_unit_and_lengths_in_theirs() {
    let text = "t[s];joint_1[deg];joint_1.vel[deg/s];rail[mm];rail_velocity [m/s]\n0;0;0;0;0\n1;90;180;500;1\n2;180;0;1000;0\n";
    let (motion, _) = Trajectory::parse_table(text, "rates", &request(None)).unwrap();
    let (mut q, mut v, mut a) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    motion.sample(1.0, &mut q, &mut v, &mut a);
    let close = |x: f64, y: f64| (x - y).abs() < 1e-12;
    assert!(close(q[0], PI / 2.0) && close(v[0], PI) && close(q[1], 0.5) && close(v[1], 1.0), "{q:?} {v:?}");
}

#[test]
fn the_table_of_a_run_is_its_motion() {
    let text = "time,flexible_x_m,flexible_y_m,flexible_z_m,joint_1_position_rad,joint_1_effort,rail_position_m,rail_effort,kinetic_energy_j,potential_energy_j,elastic_energy_j\n\
                0,1,1,1,0.0,5,0.1,5,1,1,1\n0.5,1,1,1,0.3,5,0.2,5,1,1,1\n1.0,1,1,1,0.4,5,0.2,5,1,1,1\n";
    let (motion, info) = Trajectory::parse_table(text, "run.csv", &request(None)).unwrap();
    assert_eq!(
        (motion.joints(), motion.duration(), info.rows),
        (&["joint_1".to_owned(), "rail".to_owned()][..], 1.0, 3)
    );
    assert!(info.format.starts_with("table of a run"));
    // A run that was killed may end in the middle of a line.
    let cut = &text[..text.len() - 20];
    let (motion, info) = Trajectory::parse_table(cut, "run.csv", &request(None)).unwrap();
    assert_eq!((motion.duration(), info.rows), (0.5, 2));
    assert!(motion.warnings().iter().any(|w| w.to_string().starts_with("run.csv:4: the last row is not whole")));
}

#[test]
fn what_is_assumed_or_left_out_is_told() {
    let told = |text: &str| -> String {
        let (motion, _) = Trajectory::parse_table(text, "t", &request(None)).unwrap();
        motion.warnings().iter().map(|w| w.to_string() + "\n").collect()
    };
    let text = told("t;joint_1;wear\n0;0;1\n1;0.5;1\n");
    assert!(text.contains("does not state the unit of \"joint_1\": taken as rad"), "{text}");
    assert!(text.contains("does not state the unit of its column \"t\": taken as s"), "{text}");
    assert!(text.contains("left out: \"wear\""), "{text}");
    assert!(
        told("stamp_ns;joint_1[rad]\n1700000000000000000;0\n1700000001000000000;0.5\n")
            .lines()
            .all(|l| !l.contains("taken as"))
    );
    assert!(told("timestamp;joint_1[rad]\n1700000000000;0\n1700000001000;0.5\n").contains("taken as ms since 1970"));
    assert!(told("Robot 7\nt[s];joint_1[rad]\n0;0\n1;0.5\n").contains("t:1: 1 line is above the header and not used"));
    assert!(told("t[s];joint_1[rad]\n0;0\n0;0\n1;0.5\n").contains("t:3: 1 row repeats the one before"));
}

#[test]
fn what_a_table_leaves_open_is_refused_with_its_place() {
    let cases = [
        ("t;joint_1\n0;0\n1;90\n", "f:1:3: joint \"joint_1\" reaches 90.0000 in a table that does not state its unit"),
        (
            "time,joint_1,joint_2\n0,00,1,5,2,5\n0,01,1,6,2,6\n",
            "f:2: the row has 6 fields, the header 3: twice as many, as if numbers had decimal commas",
        ),
        ("Time[s],joint_1[deg]\n0,00,1,5\n", "f:2: the row has 4 fields, the header 2: twice as many"),
        ("t[s];joint_1[deg]\n0,5;1\n1.5;2\n", "f:3:1: numbers have decimal points (f:3:1) and decimal commas (f:2:1)"),
        ("t[s];joint_1[deg]\n0;1.234,5\n1;2\n", "f:2:3: joint_1[deg]: \"1.234,5\" is not a number"),
        ("t[s];joint_1[deg]\n0;\n1;2\n", "f:2:3: joint_1[deg]: \"\" is not a number"),
        ("a;joint_1[deg]\n0;1\n1;2\n", "f:1: no column of the header \"a\", \"joint_1[deg]\" is a time"),
        (
            "t;time;joint_1[deg]\n0;0;1\n1;1;2\n",
            "f:1: the columns \"t\", \"time\" are all times; name the one that counts: columns t=<column>",
        ),
        (
            "t[s];x;y\n0;1;1\n1;2;2\n",
            "f:1: none of the names \"t[s]\", \"x\", \"y\" is a joint of the robot, which has \"joint_1\", \"joint_2\", \"rail\"",
        ),
        ("0 1 2\n1 2 3\n", "f:1: the table has 3 columns of numbers and no header"),
        ("t[s];joint_1[%]\n0;1\n1;2\n", "f:1:6: \"joint_1[%]\" is not a joint"),
        (
            "t[s];rail[deg]\n0;1\n1;2\n",
            "f:1: the column \"rail[deg]\" has the unit of an angle; expected a length: the joint is prismatic",
        ),
        (
            "t[s];joint_1[mm]\n0;1\n1;2\n",
            "f:1: the column \"joint_1[mm]\" has the unit of a length; expected an angle: the joint turns",
        ),
        ("# unit: rad\nt[s];joint_1[deg]\n0;1\n1;2\n", "f:2:6: `unit` is stated twice, as \"rad\" and as \"deg\""),
        ("t[s];joint_1[deg]\n0;1\n0;2\n", "f:3:1: time 0 s does not follow 0 s"),
        ("t[s];joint_1[deg];joint_1 (rad)\n0;1;1\n1;2;2\n", "f:1:19: the column is called \"joint_1\", as column 2 is"),
        ("t[s];joint_1[deg]\n0;1\n1\n2;3\n", "f:3: the row has 1 fields, the header 2"),
        ("", "f: the file is empty"),
    ];
    for (text, expected) in cases {
        let found =
            Trajectory::parse_table(text, "f", &request(None)).map(|(m, _)| m.duration()).unwrap_err().to_string();
        assert!(found.starts_with(expected), "{text}\nfound    {found}\nexpected {expected}");
    }
    let mapped = |map: &str| {
        let map: ColumnMap = map.parse().unwrap();
        Trajectory::parse_table("t[s];A1;A1 (deg)\n0;1;2\n1;2;3\n", "f", &request(Some(&map))).unwrap_err().to_string()
    };
    assert!(
        mapped("t=T,joint_1=A1").contains("there is no column \"T\"; the header has \"t[s]\", \"A1\", \"A1 (deg)\"")
    );
    assert!(
        mapped("t=t,joint_1=A1[furlong]").contains("unit \"furlong\" of `columns` is not known"),
        "{}",
        mapped("t=t,joint_1=A1[furlong]")
    );
    assert!(mapped("t=t,joint_1=A1[rad]").contains("could be each of the columns \"A1\", \"A1 (deg)\""));
    assert!(mapped("t=#9,joint_1=A1").contains("there is no column \"#9\""));
    assert!(
        mapped("t=A1[deg],joint_1=#2").contains("could be each of")
            || mapped("t=A1[deg],joint_1=#2").contains("expected a time")
    );
}

#[test]
fn a_table_in_utf_16_as_spreadsheets_write_it_is_text() {
    let text = "t[s]\tjoint_1[°]\n0\t1\n1\t2\n";
    for (mark, bytes) in [([0xFF, 0xFE], u16::to_le_bytes as fn(u16) -> [u8; 2]), ([0xFE, 0xFF], u16::to_be_bytes)] {
        let mut file = mark.to_vec();
        text.encode_utf16().for_each(|word| file.extend(bytes(word)));
        let read = text_of_bytes(file, "u").unwrap();
        assert_eq!(read, text);
        let (motion, _) = Trajectory::parse_table(&read, "u", &request(None)).unwrap();
        assert_eq!(motion.duration(), 1.0);
    }
    assert!(matches!(text_of_bytes(vec![b'a', 0xFF], "u"), Err(TrajectoryError::File(_))));
}

/// Truth: the same table in UTF-8.
#[test]
fn a_table_in_the_letters_of_old_windows_is_text() {
    let text = "# Prüfstand – Lauf 1 (€)\nZeit[s];A1 [°]\n0,0;0,0\n1,0;90,0\n2,0;0,0\n";
    let byte = |letter: char| match letter {
        '–' => 0x96,
        '€' => 0x80,
        letter => u8::try_from(u32::from(letter)).unwrap(),
    };
    let old: Vec<u8> = text.chars().map(byte).collect();
    assert_eq!(text_of_bytes(old, "t").unwrap(), text);
    // Neither undefined bytes nor UTF-8 with an incomplete character are accepted.
    let damaged = [&b"A1 [\xc2\xb0], \xb0\n"[..], b"A1, \x81\n", b"A1, \xb0\x00\n"];
    for bytes in damaged {
        assert!(text_of_bytes(bytes.to_vec(), "t").unwrap_err().to_string().contains("not UTF-8"), "{bytes:?}");
    }
    let request = TableRequest::default();
    let (motion, _) = Trajectory::parse_table(text, "t", &request).unwrap();
    let (mut q, mut v, mut a) = ([0.0], [0.0], [0.0]);
    motion.sample(1.0, &mut q, &mut v, &mut a);
    assert!((q[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
}

#[test]
fn every_bad_line_of_a_table_is_named() {
    let text = "t[s];a[rad]\n0;0\n1;x\n2;0\n3;y;4\n4;0\n";
    let message = Trajectory::parse_table(text, "t", &TableRequest::default()).unwrap_err().to_string();
    assert!(message.starts_with("t:3:3: ") && message.ends_with(" (t:5 is wrong, too)"), "{message}");
    let text = "t[s];a[rad]\n0;0\n1;1\n1;2\n2;0\n1;1\n";
    let message = Trajectory::parse_table(text, "t", &TableRequest::default()).unwrap_err().to_string();
    assert!(message.starts_with("t:4:1: ") && message.ends_with(" (t:6 is wrong, too)"), "{message}");
}

#[test]
fn joints_of_parts_that_begin_later_are_held_before_and_after() {
    let part = |name: &str| Trajectory::parse_csv(&format!("time,{name},{name}.vel\n0,1,0\n1,2,0\n"), "p").unwrap();
    let both = Trajectory::side_by_side(&[(0.0, part("a")), (0.5, part("b"))]).unwrap();
    assert_eq!(both.duration(), 1.5);
    let (mut q, mut v, mut acc) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for (t, expected) in [(0.25, [None, Some(1.0)]), (1.0, [Some(2.0), Some(1.5)]), (1.4, [Some(2.0), None])] {
        both.sample(t, &mut q, &mut v, &mut acc);
        for k in 0..2 {
            assert!(expected[k].is_none_or(|x: f64| (q[k] - x).abs() < 1e-12), "{t} {q:?}");
        }
    }
    assert!(Trajectory::side_by_side(&[(0.0, part("a")), (0.0, part("a"))]).is_err());
    assert!(Trajectory::side_by_side(&[(-1.0, part("a"))]).is_err());
    assert!(Trajectory::side_by_side(&[]).is_err());
}

/// Reads a table of any joints.
fn read(text: &str) -> Result<Trajectory, TrajectoryError> {
    Trajectory::parse_table(text, "t", &TableRequest { columns: None, joints: None }).map(|(motion, _)| motion)
}

/// Positions and velocities.
fn state(motion: &Trajectory, t: f64) -> [Vec<f64>; 2] {
    let n = motion.joints().len();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    motion.sample(t, &mut q, &mut v, &mut vec![0.0; n]);
    [q, v]
}

fn dropped(motion: &Trajectory) -> Vec<String> {
    motion.dropped_columns().to_vec()
}

/// Truth: differences of Python's `datetime`.
#[test]
fn times_of_day_and_dates_are_those_of_the_calendar() {
    for (first, last, truth) in [
        ("2024/02/29 23:59:59", "2024-03-01T12:00:00.004Z", 43_201.004),
        ("1970-01-01 00:00:00", "1970-04-01 00:00:00", 90.0 * 86_400.0),
        ("1999-12-31 00:00:00", "2000-03-01 00:00:00", 61.0 * 86_400.0),
        ("2100-02-28 00:00:00", "2100-03-01 00:00:00", 86_400.0),
        ("12:00:00,5+01:00", "12:00:01,75+01:00", 1.25),
    ] {
        let motion = read(&format!("Timestamp;joint_1[rad]\n{first};0\n{last};1\n"));
        assert_eq!(motion.unwrap().duration(), truth, "{last}");
    }
    for wrong in ["25:00:00", "12:00", "2024-13-01 00:00:00", "12", "a:b:c", "1:2:3:4"] {
        assert!(read(&format!("Timestamp;joint_1[rad]\n11:59:00;0\n{wrong};1\n")).is_err(), "{wrong}");
    }
}

#[test]
fn fields_are_split_with_quotes_and_runs_of_spaces_as_one_gap() {
    let quoted = "\"t[s]\", joint_1[rad] ,\"a,b\",,\"say \"\"x\"\"\",\n\"0\",0,1,,1,\n1,2,1,,1,\n";
    let (motion, _) = Trajectory::parse_table(quoted, "t", &request(None)).unwrap();
    assert_eq!(
        (motion.joints(), dropped(&motion)),
        (&["joint_1".to_owned()][..], vec!["a,b".into(), "#4".into(), "say \"x\"".into()])
    );
    assert_eq!(state(&motion, 1.0)[0], [2.0]);
    let motion = read("t[s] a[rad] b[rad]\n  0.0   2.0\t3 \n1.0 2.0 3.0\n").unwrap();
    assert_eq!(state(&motion, 0.0)[0], [2.0, 3.0]);
    let motion = read("t[s];a[rad]\n0;1,5\n1;2\n").unwrap();
    assert_eq!(state(&motion, 0.0)[0], [1.5]);
}

#[test]
fn times_of_nineteen_digits_keep_their_differences() {
    let lasts = |unit: &str, first: &str, last: &str| {
        read(&format!("t[{unit}];a[rad]\n{first};0\n{last};1\n")).unwrap().duration()
    };
    assert_eq!(lasts("ns", "1700000000123456789", "1700000000143456789"), 20_000_000.0 * 1e-9);
    assert_eq!(lasts("s", "-0,25", "0"), 0.25);
    assert_eq!(lasts("s", "0", "1e3"), 1e3);
}

#[test]
fn units_are_found_in_brackets_behind_slashes_and_underscores() {
    let deg = PI / 180.0;
    for (column, name, scale) in [
        ("A1[deg]", "A1", deg),
        ("joint_1 (rad)", "joint_1", 1.0),
        ("q1_deg", "q1", deg),
        ("rail [mm]", "rail", 1e-3),
        ("A1 [°]", "A1", deg),
        ("q[0][deg]", "q[0]", deg),
        // No unit.
        ("joint_1", "joint_1", 1.0),
        ("q[0]", "q[0]", 1.0),
    ] {
        let motion = read(&format!("t[s];{column}\n0;1\n1;0\n")).unwrap();
        assert_eq!((motion.joints(), state(&motion, 0.0)[0][0]), (&[name.to_owned()][..], scale), "{column}");
        let is_assumed = motion.warnings().iter().any(|warning| warning.code == "table-unit");
        assert_eq!(is_assumed, column == name, "{column}");
    }
    for (column, scale) in [("Time[ms]", 1e-3), ("t / s", 1.0), ("Zeit in ms", 1e-3)] {
        let motion = read(&format!("{column};a[rad]\n0;0\n1;1\n")).unwrap();
        assert_eq!((motion.duration(), motion.joints().len()), (scale, 1), "{column}");
    }
    for (position, rate, name) in [("vel_A1[deg]", "vel_A1[deg/s]", "vel_A1"), ("w1_deg", "w1_deg_s", "w1")] {
        let motion = read(&format!("t[s];{position};{rate}\n0;0;1\n1;1;1\n")).unwrap();
        assert_eq!((motion.joints(), state(&motion, 0.0)[1][0]), (&[name.to_owned()][..], deg), "{rate}");
    }
    let message = read("t[s];A1[%]\n0;0\n1;1\n").unwrap_err().to_string();
    assert!(message.contains("\"%\""), "{message}");
}

#[test]
fn rates_and_paths_of_topics_lead_to_their_joint() {
    let text = "Timestamp;/joint_states/joint_1/position;/joint_states/joint_1/velocity;/joint_states/joint_1/effort;\
                A1;A1.vel;A2[deg];A2[deg/s]\n0;0;0.5;9;0;0.25;0;90\n1;0.5;0.5;9;0.25;0.25;90;90\n";
    let motion = read(text).unwrap();
    assert_eq!(
        (motion.joints(), dropped(&motion)),
        (&["joint_1", "A1", "A2"].map(String::from)[..], vec!["/joint_states/joint_1/effort".into()])
    );
    assert_eq!(state(&motion, 0.0)[1], [0.5, 0.25, PI / 2.0]);
}

/// Each separator, with and without units: the same names, the same answer.
#[test]
fn a_misspelt_joint_is_an_error_whatever_the_separator_and_a_gripper_is_left_out() {
    let table = |separator: &str, names: &[&str]| {
        let rows =
            [names.join(separator), vec!["0"; names.len()].join(separator), vec!["1"; names.len()].join(separator)];
        Trajectory::parse_table(&rows.join("\n"), "f", &request(None)).map(|(motion, _)| motion)
    };
    for separator in [",", ";", "\t", " "] {
        for (time, unit) in [("time", ""), ("t[s]", "[rad]")] {
            let named = |joint: &str| format!("{joint}{unit}");
            let error = table(separator, &[time, &named("joint_1"), &named("jiont_2")]).unwrap_err().to_string();
            let place = format!("f:1:{}: ", time.len() + named("joint_1").len() + 3);
            assert!(error.starts_with(&place) && error.contains("did you mean \"joint_2\"?"), "{error}");
            assert!(error.contains(&format!("columns joint_2=jiont_2{unit}")), "{error}");
            let error = table(separator, &[time, &named("joint_1"), &named("Joint_1.vel")]).unwrap_err().to_string();
            assert!(error.contains("did you mean \"joint_1\"?"), "{error}");
            let motion = table(separator, &[time, &named("joint_1"), &named("joint_2"), &named("gripper")]).unwrap();
            assert_eq!(dropped(&motion), [named("gripper")]);
            // All joints that this name could mean have their columns.
            let motion = table(separator, &[time, &named("joint_1"), &named("joint_2"), &named("joint_3")]).unwrap();
            assert_eq!(dropped(&motion), [named("joint_3")]);
        }
    }
}

#[test]
fn a_rate_before_its_position_has_the_unit_of_the_position() {
    let motion = read("t[s];a.vel;a[deg]\n0;90;0\n1;90;90\n").unwrap();
    assert_eq!(state(&motion, 0.0)[1], [PI / 2.0]);
}
