//! Names as every kind of output writes them.

use flexarm_settings::internals::{LONGEST_LINE, is_hidden};
use flexarm_settings::written::{csv_field, csv_fields, markdown, markdown_code, markup, message, one_line, visible};

const NAMES: [&str; 14] = [
    "joint_1",
    "=cmd|' /C calc'!A0",
    "+1",
    "-a",
    "@SUM(A1)",
    "\tx",
    "\rx",
    "'=x",
    "''@x",
    "'plain'",
    "a,b;c",
    "say \"x\"",
    "# no comment",
    " padded ",
];

#[test]
fn no_kind_of_output_holds_a_character_that_a_terminal_obeys() {
    let all: String = (0..=0x9fu32).chain([0x202e, 0x2028, 0x2066, 0xfeff]).filter_map(char::from_u32).collect();
    for (kind, text) in [
        ("terminal", visible(&all)),
        ("message", message(&all)),
        ("line", one_line(&all)),
        ("markup", markup(&all)),
        ("markdown", markdown(&all)),
    ] {
        let obeyed = text.chars().find(|c| is_hidden(*c) && !"\n\t".contains(*c));
        assert_eq!(obeyed, None, "{kind}");
    }
    assert_eq!(visible("\u{1b}[31mred\u{9b}1m\n"), "\\u{1b}[31mred\\u{9b}1m\n");
    assert!(!one_line("a\nerror: b").contains('\n'));
}

#[test]
fn a_long_quotation_is_cut_with_its_length_and_the_rest_of_the_message_stays() {
    for cell in ["x".repeat(1_000_000), "ab ".repeat(400_000)] {
        let said = message(&format!("motion.csv:2: found {cell:?}, expected a number; it is {cell}"));
        assert!(said.chars().count() < LONGEST_LINE + 100, "{}", said.len());
        let count = cell.chars().count();
        assert!(said.contains(&format!("...\" ({count} characters), expected a number")), "{said:.500}");
    }
    let short = "a \"quoted \\\" text\" and `one`, it's left as it is";
    assert_eq!(message(short), short);
}

#[test]
fn a_field_is_read_back_as_it_was_and_no_spreadsheet_calculates_it() {
    for name in NAMES {
        let field = csv_field(name);
        let shown = field.trim_matches('"');
        assert!(!shown.starts_with(['=', '+', '-', '@', '\t', '\r']), "{field}");
        let line = format!("time,{field},x");
        assert_eq!(csv_fields(&line, |c| c == ',', false), ["time", name, "x"]);
    }
    // Numbers written by other programs are not treated as text of this one.
    assert_eq!(csv_fields("-1.5,'+2,\"-3\"", |c| c == ',', false), ["-1.5", "'+2", "-3"]);
}

#[test]
fn markdown_shows_a_name_as_it_is() {
    assert_eq!(markdown("<script>alert(1)</script> &lt;"), "&lt;script>alert(1)&lt;/script> &amp;lt;");
    assert_eq!(markdown("a | b"), "a \\| b");
    assert_eq!(markdown("![x](http://y)"), "![x\\](http://y)");
    assert_eq!(markdown("# joint_1\n* next"), "\\# joint_1 \\* next");
    assert_eq!(markdown("_a_ -1.5 < 2, mass [kg]"), "\\_a\\_ -1.5 < 2, mass [kg]");
    assert_eq!(markdown_code("joint_1"), "`joint_1`");
    assert_eq!(markdown_code("a`<b>"), "a\\`&lt;b>");
}
