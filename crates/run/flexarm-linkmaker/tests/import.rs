//! Words of an import job.

use flexarm_linkmaker::import::{ImportMap, parse_part};

#[test]
fn a_map_names_rows_or_nodes() {
    assert!(matches!("A=947:1-3+948:1-3,B=#7-12".parse(), Ok(ImportMap::Rows(_))));
    let map: ImportMap = "A=plane(0,0,0;1,0,0),B=plane(1,0,0;1,0,0)".parse().unwrap();
    assert_eq!(map.entries()[0].1, "plane(0,0,0;1,0,0)");
    assert_eq!(map.entries()[1], ("B".into(), "plane(1,0,0;1,0,0)".into()));
    let refused = |text: &str| text.parse::<ImportMap>().unwrap_err().to_string();
    assert!(refused("A=plane(0,0,0;1,0,0),B=1002").contains("every interface"));
    assert!(refused("A=plane(0,0,0;1,0,0),A=plane(1,0,0;1,0,0)").contains("twice"));
}

#[test]
fn a_part_is_mass_centre_and_inertia() {
    let part = parse_part("2;0,0,0.5;1,2,3,0.1,0.2,0.3").unwrap();
    assert_eq!((part.mass, part.com.z, part.inertia[(0, 1)], part.inertia[(2, 1)]), (2.0, 0.5, 0.1, 0.3));
    assert!(parse_part("2;0,0;1,2,3,0,0,0").is_err());
}
