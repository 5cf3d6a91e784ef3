//! Definitions of messages.

use flexarm_motion_io::internals::{Definitions, Kind, Many};

#[test]
fn constants_defaults_bounds_and_comments_of_a_definition_are_told_apart() {
    let text = "# a message\nuint8 ON=1\nstring WORD = a=b # no\nfloat64 gain 0.5\nstring<=8[<=3] names\nfloat32[4] q # four\n\
                Header header\nPart[] parts\n================================================================================\n\
                MSG: demo/Part\nbool is_on\n";
    let found = Definitions::parse("demo/msg/Whole", text);
    let names: Vec<&str> = found.fields("demo/Whole").unwrap().iter().map(|field| &*field.name).collect();
    assert_eq!(names, ["gain", "names", "q", "header", "parts"]);
    let kinds: Vec<(Kind, Many)> =
        found.fields("demo/Whole").unwrap().iter().map(|field| (field.kind.clone(), field.many)).collect();
    assert_eq!(kinds[1], (Kind::Text, Many::Sequence));
    assert_eq!(kinds[2], (Kind::F32, Many::Fixed(4)));
    assert_eq!(kinds[3].0, Kind::Struct("std_msgs/Header".into()));
    assert_eq!(kinds[4].0, Kind::Struct("demo/Part".into()));
    assert_eq!(found.fields("demo/Part").unwrap().len(), 1);
}
