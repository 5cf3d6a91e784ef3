//! YAML as a tree of texts.

use flexarm_files::{YamlError, YamlValue, read_yaml};

/// Maximum depth of a document.
const MAX_NESTED: usize = 40;

fn fails(text: &str, most: usize) -> YamlError {
    read_yaml(text, most, |_| Ok::<(), YamlError>(())).unwrap_err()
}

#[test]
fn a_document_is_a_tree_of_texts_with_their_lines() {
    let mut roots = Vec::new();
    read_yaml("a: &x [1, \"2\"]\nb: *x\n---\n!degrees 3\n", 20, |root| {
        roots.push(root);
        Ok::<(), YamlError>(())
    })
    .unwrap();
    let YamlValue::Map(items) = &roots[0].value else { panic!("{roots:?}") };
    assert_eq!(items.iter().map(|item| item.line).collect::<Vec<_>>(), [1, 1, 2, 1]);
    let YamlValue::List(copied) = &items[3].value else { panic!("{items:?}") };
    assert!(matches!(&copied[0].value, YamlValue::Scalar { text, is_plain: true, tag: None } if text == "1"));
    assert!(matches!(&copied[1].value, YamlValue::Scalar { text, is_plain: false, .. } if text == "2"));
    assert!(matches!(&roots[1].value, YamlValue::Scalar { tag: Some(tag), .. } if tag == "degrees"));
}

#[test]
fn what_lies_behind_aliases_is_counted_and_as_deep_as_it_would_be_written() {
    let chain = |links: usize| {
        let links = (1..=links).map(|k| format!("a{k}: &a{k} [*a{}]\n", k - 1));
        format!("a0: &a0 x\n{}", links.collect::<String>())
    };
    // The enclosing map adds one level.
    assert!(read_yaml(&chain(MAX_NESTED - 1), 10_000, |_| Ok::<(), YamlError>(())).is_ok());
    let deep = fails(&chain(MAX_NESTED), 10_000);
    assert_eq!((deep.line, deep.message.contains("nested more than 40 deep")), (41, true), "{deep:?}");
    assert!(fails(&chain(30), 200).message.contains("more than 200 numbers"));
    assert!(fails("a: &a [*a]", 100).message.contains("an alias refers to"));
    assert_eq!(fails("a: [1, 2\nb: }", 100).line, 2);
}
