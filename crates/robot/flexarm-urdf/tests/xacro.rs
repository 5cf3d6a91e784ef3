//! Xacro against ROS's implementation, and against files without termination.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::common::{TestFolder, line};
use flexarm_settings::Finding;
use flexarm_urdf::{ReadOptions, UrdfError, check_urdf, expand_xacro, parse_urdf, read_urdf};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/xacro")
}

fn with_arguments(arguments: &[(&str, &str)]) -> ReadOptions {
    let arguments = arguments.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    ReadOptions { packages: vec![("test_parts".to_owned(), data())], arguments, ..ReadOptions::default() }
}

/// Elements with sorted attributes and text, without surrounding white space and namespaces.
fn outline(text: &str) -> String {
    fn walk(node: roxmltree::Node<'_, '_>, depth: usize, out: &mut String) {
        let prefix = node.tag_name().namespace().unwrap_or_default();
        let mut attributes: Vec<_> = node.attributes().map(|a| format!("{}={:?}", a.name(), a.value())).collect();
        attributes.sort();
        let _ =
            writeln!(out, "{:indent$}{prefix}{} {}", "", node.tag_name().name(), attributes.join(" "), indent = depth);
        for child in node.children() {
            if child.is_element() {
                walk(child, depth + 1, out);
            } else if let Some(text) = child.text().map(str::trim).filter(|t| !t.is_empty()) {
                let _ = writeln!(out, "{:indent$}{text:?}", "", indent = depth + 1);
            }
        }
    }
    let mut out = String::new();
    walk(roxmltree::Document::parse(text).unwrap().root_element(), 0, &mut out);
    out
}

/// Truth: results of ROS's xacro 2.1.1, written next to the files by `tools/xacro_expectations.py`.
#[track_caller]
fn assert_as_ros_does(name: &str) {
    let path = data().join(format!("{name}.xacro"));
    let expanded = expand_xacro(&path, &with_arguments(&[])).unwrap_or_else(|e| panic!("{e}"));
    let expected = std::fs::read_to_string(data().join(format!("{name}.expected.xml"))).unwrap();
    let (found, expected) = (outline(&expanded.replace(&data().display().to_string(), "PACKAGE")), outline(&expected));
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(found.lines().count(), expected.lines().count());
}

#[test]
fn expressions_have_the_values_and_digits_of_python() {
    assert_as_ros_does("expressions");
}

#[test]
fn properties_are_lazy_and_keep_to_their_scopes() {
    assert_as_ros_does("properties");
}

#[test]
fn macros_take_values_blocks_and_defaults() {
    assert_as_ros_does("macros");
}

#[test]
fn conditions_arguments_and_made_elements_are_ros_s() {
    assert_as_ros_does("conditions");
}

#[test]
fn includes_find_files_packages_and_namespaces() {
    assert_as_ros_does("includes");
}

#[test]
fn yaml_files_give_pyyaml_s_values() {
    assert_as_ros_does("yaml");
}

const HEAD: &str = "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>\n";

fn expand(body: &str) -> Result<String, UrdfError> {
    let folder = TestFolder::new();
    let path = folder.write("robot.xacro", format!("{HEAD}{body}</robot>"));
    expand_xacro(&path, &ReadOptions::default())
}

#[track_caller]
fn fault(body: &str) -> Finding {
    match expand(body) {
        Err(UrdfError::Invalid { issues, .. }) => issues.into_iter().next().unwrap(),
        Err(other) => panic!("{other}"),
        Ok(text) => panic!("expanded to {} letters", text.len()),
    }
}

#[test]
fn a_robot_is_read_from_a_xacro_file_with_its_arguments() {
    let body = "<xacro:arg name='length' default='1'/>\n<link name='base'/>\n<link name='rod'><inertial>\n\
        <mass value='2'/><origin xyz='0 0 ${$(arg length) / 2}'/><inertia ixx='0.1' iyy='0.1' izz='0.01' ixy='0' ixz='0' \
        iyz='0'/></inertial></link>\n<joint name='hinge' type='continuous'><parent link='base'/><child link='rod'/>\
        <axis xyz='0 1 0'/></joint>";
    let folder = TestFolder::new();
    let path = folder.write("robot.urdf.xacro", format!("{HEAD}{body}</robot>"));
    let com = |options: &ReadOptions| {
        read_urdf(&path, options).unwrap().mechanism.link("rod").unwrap().inertia.unwrap().com.z
    };
    assert_eq!(com(&ReadOptions::default()), 0.5);
    assert_eq!(com(&with_arguments(&[("length", "3")])), 1.5);
    // A URDF that contains xacro gives the same.
    let text = format!("{HEAD}{body}</robot>");
    assert_eq!(parse_urdf(&text, "robot.urdf", &ReadOptions::default()).unwrap().mechanism.joints.len(), 1);

    let findings = check_urdf(&path, &with_arguments(&[("lenght", "3")]));
    let unused = findings.iter().find(|f| f.code == "unused-argument").unwrap();
    assert!(unused.message.contains("\"lenght\"") && unused.help.contains("\"length\""), "{unused}");
}

#[test]
fn what_is_wrong_in_the_robot_is_told_with_the_line_of_the_macro() {
    let folder = TestFolder::new();
    folder.write(
        "rod.xacro",
        "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>\n<xacro:macro name='rod' params='name'>\n  <link name='${name}'>\n    \
         <inertial><mass value='-1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\n\
         </xacro:macro></robot>",
    );
    let path = folder
        .write("robot.xacro", format!("{HEAD}<xacro:include filename='rod.xacro'/>\n<xacro:rod name='a'/></robot>"));
    let findings = check_urdf(&path, &ReadOptions::default());
    let negative = findings.iter().find(|f| f.code == "negative-mass").unwrap();
    assert!(negative.location.ends_with("rod.xacro:4:5"), "{negative}");
}

#[test]
fn faults_name_the_place_the_calls_and_the_way_to_mend_them() {
    let error = fault("<link name='${lenght}'/>");
    assert_eq!((line(&error), error.message.as_str()), (2, "name=...: ${lenght}: the name \"lenght\" is not defined"));
    let error = fault("<xacro:property name='length' value='1'/><link name='${lenght}'/>");
    assert_eq!(error.help, "did you mean \"length\"?");

    let error =
        fault("<xacro:macro name='arm' params='side'>\n<link name='${1 / 0}'/></xacro:macro>\n<xacro:arm side='l'/>");
    assert_eq!(line(&error), 3);
    assert!(error.message.contains("division by zero"), "{error}");
    let call = error.message.lines().nth(1).unwrap();
    assert!(call.contains("in the macro \"arm\"") && call.ends_with(":4:1"), "{error}");

    for (body, said, help) in [
        ("<xacro:arms/>", "no macro \"arms\"", "define it"),
        ("<xacro:macro name='arm' params='side'/><xacro:arm sid='l'/>", "no parameter \"sid\"", "\"side\""),
        ("<xacro:macro name='arm' params='side'/><xacro:arm/>", "called without \"side\"", "attribute"),
        ("<xacro:macro name='arm' params='*b'/><xacro:arm/>", "needs a block", "inside"),
        ("<xacro:macro name='arm' params=''/><xacro:arm><b/></xacro:arm>", "no block <b>", "remove"),
        ("<v n='$(arg side)'/>", "argument \"side\" has no value", "arguments side="),
        ("<v n='$(find no_such_package)'/>", "package \"no_such_package\" was not found", "packages no_such_package="),
        ("<v n='$(fnd x)'/>", "$(fnd x) is not known", "$(find ...)"),
        ("<v n='$(env NO_SUCH_VARIABLE)'/>", "NO_SUCH_VARIABLE is not set", "optenv"),
        ("<xacro:include filename='missing.xacro'/>", "missing.xacro cannot be read", "path"),
        ("<xacro:if value='maybe'/>", "neither true nor false", "true, false"),
        ("<xacro:insert_block name='b'/>", "no block \"b\"", "*name"),
        ("<xacro:property name='a-b' value='1'/>", "cannot be the name", "letters"),
        (
            "<xacro:property name='a' value='${b}'/><xacro:property name='b' value='${a}'/><v n='${a}'/>",
            "defined by itself",
            "lazy_eval",
        ),
        ("<v n='${1 + }'/>", "ends too early", ""),
        ("<v n='${open'/>", "no closing", "$${"),
        ("<v n=\"${'a' + 1}\"/>", "not defined between str and int", "float()"),
        ("<v n=\"${xacro.load_yaml('none.yaml')}\"/>", "none.yaml cannot be read", ""),
        ("<v n=\"${xacro.fatal('not', 'so')}\"/>", "not so", ""),
    ] {
        let error = fault(body);
        assert!(error.message.contains(said) && error.help.contains(help), "{body}: {error}");
    }
}

#[test]
fn a_file_of_macros_says_which_one_to_call() {
    let text = format!("{HEAD}<xacro:macro name='arm_robot' params=''><link name='a'/></xacro:macro></robot>");
    let error = parse_urdf(&text, "arm_macro.xacro", &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("defines macros and calls none") && error.contains("<xacro:arm_robot"), "{error}");
}

/// Without limits each of these would take unlimited time, memory or stack.
#[test]
fn a_file_that_never_ends_is_stopped() {
    let doubling: String = (0..60)
        .map(|i| format!("<xacro:macro name='m{i}' params=''><xacro:m{0}/><xacro:m{0}/></xacro:macro>", i + 1))
        .collect();
    let lists: String = (0..60)
        .map(|i| format!("<xacro:property name='p{}' value='${{[p{i}, p{i}] + [p{i}, p{i}]}}'/>", i + 1))
        .collect();
    let chain: String = (0..20_000).map(|i| format!("<xacro:property name='q{i}' value='${{q{}}}'/>", i + 1)).collect();
    let brackets = format!("{}1{}", "(".repeat(1500), ")".repeat(1500));
    for (body, said) in [
        ("<xacro:macro name='m' params=''><xacro:m/></xacro:macro><xacro:m/>".to_owned(), "macros call each other"),
        ("<xacro:macro name='m' params='*b'><xacro:m><a><xacro:insert_block name='b'/></a></xacro:m></xacro:macro><xacro:m><a/></xacro:m>".to_owned(), ""),
        (format!("{doubling}<xacro:macro name='m60' params=''><link name='a'/></xacro:macro><xacro:m0/>"), "too much"),
        (format!("<xacro:property name='p0' value='${{[1]}}'/>{lists}<v n='${{p60}}'/>"), "too much"),
        (format!("{chain}<v n='${{q0}}'/>"), "too deeply"),
        ("<xacro:include filename='robot.xacro'/>".to_owned(), "include each other"),
        (format!("<v n='${{{brackets}}}'/>"), "nested more than"),
        (format!("<v n='${{{}1}}'/>", "-".repeat(1500)), "nested more than"),
        (format!("<v n='${{{}1}}'/>", "1+".repeat(50_000)), "words"),
        ("<v n='${9**9**9**9}'/>".to_owned(), "1e38"),
        ("<v n='${1 &lt;&lt; 100000000000}'/>".to_owned(), ""),
        ("<v n=\"${'ab' * 10**12}\"/>".to_owned(), "too much"),
        ("<v n='${[0] * 10**12}'/>".to_owned(), "too much"),
        ("<v n=\"${('x' * 10**6).replace('x', 'y' * 10**6)}\"/>".to_owned(), "too much"),
        ("<v n=\"${('y' * 10**6).join(['x'] * 10**5)}\"/>".to_owned(), "too much"),
        ("<xacro:property name='f' value='{0}'/><v n=\"${(f * 10**6).format('x' * 10**6)}\"/>".to_owned(), "too much"),
        ("<v n='${range(10**15)}'/>".to_owned(), "too much"),
        ("<v n='${[x for x in range(10**5) for y in range(10**5)]}'/>".to_owned(), "too much"),
        ("<v n='${1e308 * 10 ** 400}'/>".to_owned(), "1e38"),
    ] {
        let start = Instant::now();
        let error = fault(&body);
        assert!(error.message.contains(said), "{}: {error}", &body[..body.len().min(80)]);
        // measured: at most 1 s in a debug build
        assert!(start.elapsed().as_secs() < 20, "{}: {:?}", &body[..body.len().min(80)], start.elapsed());
    }
}

#[test]
fn yaml_that_grows_or_is_broken_is_refused() {
    let folder = TestFolder::new();
    let bomb: String =
        (1..40).map(|i| format!("a{i}: &a{i} [{}]\n", vec![format!("*a{}", i - 1); 9].join(","))).collect();
    folder.write("bomb.yaml", format!("a0: &a0 [x]\n{bomb}"));
    folder.write("deep.yaml", "[".repeat(100_000));
    folder.write("broken.yaml", "a: [1, 2\nb: }");
    folder.write("self.yaml", "a: &a [*a]");
    for (name, shown) in [("bomb", true), ("deep", false), ("broken", false), ("self", false)] {
        let use_of = if shown { "<v n='${y}'/>" } else { "<v n='${y.a}'/>" };
        let body =
            format!("{HEAD}<xacro:property name='y' value=\"${{xacro.load_yaml('{name}.yaml')}}\"/>{use_of}</robot>");
        let path = folder.write("robot.xacro", body);
        let error = expand_xacro(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("robot.xacro:2") && error.contains(name) || error.contains("too much"), "{error}");
    }
}

/// What an attribute with this text becomes.
fn attribute(text: &str) -> Result<String, UrdfError> {
    let expanded = expand(&format!("<v n=\"{}\"/>", text.replace('&', "&amp;").replace('"', "&quot;")))?;
    let document = roxmltree::Document::parse(&expanded).unwrap();
    let v = document.root_element().first_element_child().unwrap();
    Ok(v.attribute("n").unwrap().to_owned())
}

#[test]
fn a_text_is_cut_at_dollars_with_brackets() {
    let cut = |text: &str| attribute(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    assert_eq!(cut("a${1 + 1}c$(eval 1 + 2)"), "a2c3");
    assert_eq!(cut("$${x} 5$"), "${x} 5$");
    assert_eq!(cut("$$$(x)"), "$$(x)");
    let open = attribute("${open").unwrap_err().to_string();
    assert!(open.contains("no closing"), "{open}");
}

/// Truth: Python's repr, from `python3 -c "print(repr(...))"`.
#[test]
fn numbers_are_printed_as_python_prints_them() {
    let pairs = [
        ("0.1 + 0.2", "0.30000000000000004"),
        ("1.0", "1.0"),
        ("-0.0", "-0.0"),
        ("1e16", "1e+16"),
        ("123456789012345680.0", "1.2345678901234568e+17"),
        ("1e15", "1000000000000000.0"),
        ("0.0001", "0.0001"),
        ("0.00001", "1e-05"),
        ("1.5e-7", "1.5e-07"),
        ("1e-300", "1e-300"),
        ("1.0 / 3.0", "0.3333333333333333"),
        ("float('nan')", "nan"),
        ("-float('inf')", "-inf"),
        ("[\"it's\", 2.0, (None,)]", "[\"it's\", 2.0, (None,)]"),
    ];
    for (text, expected) in pairs {
        assert_eq!(attribute(&format!("${{{text}}}")).unwrap(), expected, "{text}");
    }
}

#[test]
fn text_is_a_number_where_python_takes_it_for_one() {
    let of = |text: &str| attribute(&format!("${{{text}}}")).ok();
    assert_eq!(of("int(' +12 ')").as_deref(), Some("12"));
    assert_eq!(of("int('1_000')").as_deref(), Some("1000"));
    assert_eq!(of("int('1.0')"), None);
    assert_eq!(of("int('-')"), None);
    assert_eq!(of("float('1e-3')").as_deref(), Some("0.001"));
    assert_eq!(of("float('.5')").as_deref(), Some("0.5"));
    assert_eq!(of("float('1.5.2')"), None);
    assert_eq!(of("float('e5')"), None);
    assert_eq!(of("float('-inf')").as_deref(), Some("-inf"));
}

/// Truth: PyYAML 6.0.3, `yaml.safe_load`.
#[test]
fn plain_scalars_are_what_pyyaml_makes_of_them() {
    let pairs = [
        ("12", "12"),
        ("-0.5", "-0.5"),
        ("1e3", "'1e3'"),
        ("1.0e3", "'1.0e3'"),
        ("1.0e+3", "1000.0"),
        ("1.", "1.0"),
        (".5", "0.5"),
        ("010", "8"),
        ("1:30", "90"),
        ("0x1F", "31"),
        ("yes", "True"),
        ("off", "False"),
        ("~", "None"),
        ("1_000", "1000"),
        ("-.inf", "-inf"),
        ("12 34", "'12 34'"),
        ("0.1.2", "'0.1.2'"),
    ];
    for (text, expected) in pairs {
        let folder = TestFolder::new();
        folder.write("values.yaml", format!("- {text}\n"));
        let path = folder.write("robot.xacro", format!("{HEAD}<v n=\"${{xacro.load_yaml('values.yaml')}}\"/></robot>"));
        let expanded = expand_xacro(&path, &ReadOptions::default()).unwrap();
        let document = roxmltree::Document::parse(&expanded).unwrap();
        let v = document.root_element().first_element_child().unwrap();
        assert_eq!(v.attribute("n").unwrap(), format!("[{expected}]"), "{text}");
    }
}

#[test]
fn a_robot_says_once_which_variables_and_yaml_files_its_values_are_from() {
    let folder = TestFolder::new();
    folder.write("values.yaml", "mass: 2.0\n");
    let body = "<link name='base'/><link name='$(env HOME)'/><link name='$(optenv HOME none)2'/>\
                <link name='$(optenv NO_SUCH_VARIABLE x)'/>\
                <link name=\"rod${xacro.load_yaml('values.yaml')['mass']}${xacro.load_yaml('values.yaml')['mass']}\"/>";
    let path = folder.write("robot.xacro", format!("{HEAD}{body}</robot>"));
    let findings = check_urdf(&path, &ReadOptions::default());
    let sources: Vec<&str> = findings.iter().filter(|f| f.code == "xacro-source").map(|f| &*f.message).collect();
    assert_eq!(sources.len(), 2, "{sources:?}");
    assert_eq!(sources[0], "the robot has values of the environment variable HOME");
    assert!(sources[1].ends_with("values.yaml"), "{sources:?}");
}
