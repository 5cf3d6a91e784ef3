//! Patterns of names, and the parameters of macros.

use flexarm_urdf::internals::{fits, parameters};

/// Truth: Python's `fnmatch`.
#[test]
fn patterns_fit_names_as_in_a_shell() {
    for (pattern, name, expected) in [
        ("*.xacro", "arm.xacro", true),
        ("*.xacro", "arm.urdf", false),
        ("a?m*", "arm_1", true),
        ("[ab]*", "beta", true),
        ("[!ab]*", "beta", false),
        ("link[0-3]", "link2", true),
        ("link[0-3]", "link7", false),
        ("*a*b", "xaxxb", true),
        ("[", "[", true),
    ] {
        assert_eq!(fits(pattern, name), expected, "{pattern} {name}");
    }
}

#[test]
fn parameters_have_defaults_forwarding_and_blocks() {
    let of = |text: &str| -> Vec<(String, bool, Option<String>)> {
        parameters(text).into_iter().map(|p| (p.name, p.forwarded, p.default)).collect()
    };
    let plain = |name: &str| (name.to_owned(), false, None);
    let with = |name: &str, forwarded, default: &str| (name.to_owned(), forwarded, Some(default.to_owned()));
    assert_eq!(of("a  *b **c "), [plain("a"), plain("*b"), plain("**c")]);
    assert_eq!(of("a:=1 b := 'x y' c=2"), [with("a", false, "1"), with("b", false, "'x y'"), with("c", false, "2")]);
    assert_eq!(of("a:=${b + 1} c:=$(arg d)"), [with("a", false, "${b + 1}"), with("c", false, "$(arg d)")]);
    assert_eq!(of("a:=^ b:=^|3"), [("a".to_owned(), true, None), with("b", true, "3")]);
    assert_eq!(of("a:=${x}${y} b"), [with("a", false, "${x}${y}"), plain("b")]);
}
