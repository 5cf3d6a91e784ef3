//! No text makes the reader panic, and every truncation of a file is detected.

use crate::common::{TestFolder, hinge, line, link, problem, robot};
use flexarm_settings::{Finding, Severity};
use flexarm_urdf::{ReadOptions, UrdfError, check_urdf_text, parse_urdf, read_urdf};
use proptest::prelude::*;

fn sound() -> String {
    let finger =
        hinge("k", "arm", "finger").replace("</joint>", "<mimic joint='j'/><limit effort='1' velocity='1'/></joint>");
    let visual =
        "<visual><origin rpy='0 0 1'/><geometry><cylinder radius='0.1' length='0.3'/></geometry></visual></link>";
    let arm = link("arm").replace("</link>", visual);
    robot(&["<!-- é -->", &link("base"), &arm, &link("finger"), &hinge("j", "base", "arm"), &finger])
}

#[test]
fn every_truncation_is_an_error_with_a_place() {
    let text = sound();
    assert!(parse_urdf(&text, "r.urdf", &ReadOptions::default()).is_ok());
    let complete = text.trim_end().len();
    let folder = TestFolder::new();
    for end in (0..complete).filter(|&end| text.is_char_boundary(end)) {
        let Err(UrdfError::Invalid { issues, .. }) = parse_urdf(&text[..end], "r.urdf", &ReadOptions::default()) else {
            panic!("cut at {end}")
        };
        assert_eq!((issues.len(), &*issues[0].code), (1, "malformed-xml"), "cut at {end}");
        let lines = text[..end].trim_end().lines().count().max(1) as u32;
        assert_eq!(line(&issues[0]), lines, "cut at {end}: {}", issues[0]);
        assert!(issues[0].to_string().contains("found the end of the file, expected "), "{}", issues[0]);
    }
    // within a character
    let at = text.find('é').unwrap() + 1;
    let path = folder.write("cut.urdf", &text.as_bytes()[..at]);
    assert_eq!(read_urdf(path, &ReadOptions::default()).unwrap_err().issues()[0].code, "not-utf8");
}

#[test]
fn deep_nesting_is_no_danger() {
    let depth = 100_000;
    let deep = format!("<gazebo>{}{}</gazebo>", "<a>".repeat(depth), "</a>".repeat(depth));
    let text = robot(&[&link("base"), &deep]);
    assert!(parse_urdf(&text, "r.urdf", &ReadOptions::default()).is_ok());
    // The same within URDF: the recursive parsers of `urdf_rs` never see this.
    for tag in ["link", "visual", "geometry", "joint", "material"] {
        let (start, end) = (format!("<{tag} name='a'>").repeat(depth), format!("</{tag}>").repeat(depth));
        let _ = parse_urdf(&robot(&[&link("base"), &start, &end]), "r.urdf", &ReadOptions::default());
    }
}

/// Parsers compare every pair of attributes and of namespaces: 60 000 take minutes.
#[test]
fn crowds_of_attributes_are_refused_before_they_are_read() {
    let many = |what: &str| (0..60_000).map(|i| what.replace('#', &i.to_string())).collect::<String>();
    let attributes = format!("<link name='b'{}/>", many(" a#='0'"));
    let nested = format!("<gazebo>{}{}</gazebo>", many("<a xmlns:n#='#'>"), "</a>".repeat(60_000));
    for (crowd, what) in [(&attributes, "more than 500 attributes"), (&nested, "more than 500 declared name spaces")] {
        let start = std::time::Instant::now();
        let (line, fault) = problem(&robot(&[&link("a"), crowd]));
        assert!(line == 3 && fault.to_string().contains(what), "{line}: {fault}");
        // measured: 1 ms
        assert!(start.elapsed().as_secs() < 2, "{:?}", start.elapsed());
    }
}

/// Returns all findings; `urdf_rs` must not reject any text passed to it.
fn check(text: &str, options: &ReadOptions) -> Vec<Finding> {
    let findings = check_urdf_text(text, "r.urdf", options);
    assert!(findings.iter().all(|f| f.code != "not-read"), "{findings:?}");
    findings
}

/// Regression: the place of undeclared prefixes was counted from the first of several `<`.
#[test]
fn tags_that_begin_twice_or_with_a_space_do_not_panic() {
    for text in ["<<𒋐 a:b=1>", "<<<𒋐/ a:b=1 <c", "< 𒋐 a:b=1>", "<\n𒋐>a:b=1", "<<<<a:b"] {
        check(text, &ReadOptions::default());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_text_panics(text in "\\PC{0,300}") {
        check(&text, &ReadOptions::default());
    }

    #[test]
    fn no_change_of_a_sound_file_panics(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<char>()), 1..5),
    ) {
        let mut characters: Vec<char> = sound().chars().collect();
        for (at, c) in changes {
            let at = at.index(characters.len());
            characters[at] = c;
        }
        let text: String = characters.into_iter().collect();
        check(&text, &ReadOptions::default());
    }

    /// Elements in any order, cyclic, repeated, with any numbers: they are either reported or read.
    #[test]
    fn no_arrangement_of_elements_panics(parts in prop::collection::vec(
        (0usize..6, 0usize..4, 0usize..4, prop::sample::select(vec!["0 0 1", "0 0 0", "1e308 1e308 1e308", "nan 0 0", "", "1"])),
        0..12,
    ), estimate in any::<bool>()) {
        let parts: Vec<String> = parts.iter().map(|&(kind, a, b, vector)| match kind {
            0 => link(&format!("l{a}")),
            1 => format!("<link name='l{a}'><visual><geometry><box size='{vector}'/></geometry></visual></link>"),
            2 => hinge(&format!("j{a}"), &format!("l{a}"), &format!("l{b}")).replace("0 0 1", vector),
            3 => hinge(&format!("j{b}"), &format!("l{a}"), &format!("l{b}")).replace("</joint>", &format!("<mimic joint='j{a}'/></joint>")),
            4 => format!("<joint name='f{b}' type='fixed'><parent link='l{a}'/><child link='l{b}'/><origin xyz='{vector}' rpy='{vector}'/></joint>"),
            _ => link(&format!("l{a}")).replace("ixx=\"0.02\"", "ixx=\"1e308\" ").replace("value=\"2\"", "value=\"1e-308\""),
        }).collect();
        let text = format!("<robot name='r'>{}</robot>", parts.concat());
        let options = ReadOptions {
            inertia_from_mesh: estimate.then_some(flexarm_urdf::InertiaEstimate::TotalMass(1.0)),
            ..ReadOptions::default()
        };
        let findings = check(&text, &options);
        let errors = findings.iter().any(|f| f.severity == Severity::Error);
        prop_assert_eq!(errors, parse_urdf(&text, "r.urdf", &options).is_err());
    }
}
