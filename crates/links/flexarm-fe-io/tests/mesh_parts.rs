//! Parts of the mesh readers: groups, element types, node numbers, unknown formats.

use flexarm_fe_io::internals::{Collector, IdIndex, Source, class, shape};
use flexarm_fe_io::{FeFileError, ReadOptions, parse_mesh, read_mesh};

#[test]
fn an_unknown_format_is_answered_with_the_known_ones() {
    let options = ReadOptions::default();
    for (bytes, word) in [
        (&b"solid cube\n"[..], "solid cube"),
        (b"", "nothing"),
        (b"\x1f\x8bxx", "gzip"),
        (b"$ made by hand\nSOL 101\nCEND\nBEGIN BULK\nGRID,1,,0.,0.,0.\n", "Nastran bulk data"),
        (b"GRID           1             0.0     0.0     0.0\nCTETRA,1,1,1,2,3,4\n", "gmsh INPUT.bdf -save"),
        (b"    -1\n  2411\n", "universal file"),
        (b"*KEYWORD\n*NODE\n", "LS-DYNA"),
        (b"ISO-10303-21;\nHEADER;\n", "must be meshed first"),
        (b"# vtk DataFile Version 3.0\n", "VTK"),
    ] {
        let message = parse_mesh(bytes, "x", &options).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    assert_eq!(&*read_mesh("no/such/file.msh", &options).unwrap_err().expected, "a file that can be read");
}

/// Puts triangles into 64 groups, as from a file with 8 bytes per triangle; returns the number
/// of stored node numbers.
fn held(triangles: impl ExactSizeIterator<Item = [u64; 3]>) -> Result<usize, FeFileError> {
    let bytes = vec![b'\n'; 8 * triangles.len()];
    let src = Source { bytes: &bytes, origin: "t.msh", binary: false };
    let groups: Vec<i64> = (1..=64).collect();
    let mut collector = Collector::new(false);
    for (id, nodes) in (1..).zip(triangles) {
        collector.element(&src, &shape(2).unwrap(), id, 0, &groups, &nodes)?;
    }
    Ok(collector.sets.values().map(|set| set.ids.capacity()).sum())
}

#[test]
fn many_groups_of_shared_nodes_do_not_grow_with_the_elements() {
    let numbers = held((0..20_000_u32).map(u64::from).map(|k| [k % 7, 7, 8 + k % 5])).unwrap();
    assert!(numbers <= 64 * 128, "{numbers}"); // 24 million bytes / 8 without tidying
}

#[test]
fn many_groups_of_many_nodes_are_refused() {
    let error = held((0..40_000_u32).map(u64::from).map(|k| [3 * k, 3 * k + 1, 3 * k + 2])).unwrap_err();
    assert!(error.to_string().contains("at most 4 nodes per byte"), "{error}");
}

#[test]
fn only_bricks_that_are_not_what_they_say_are_remarked_on() {
    let remark = |name| class(name).unwrap().1.unwrap_or("");
    assert_eq!(remark("C3D8I"), "");
    assert_eq!(remark("C3D8"), "read with incompatible modes unless quadrature = calculix");
    assert!(remark("C3D8R").starts_with("reduced integration is not used"));
}

#[test]
fn every_layout_finds_its_numbers_and_no_others() {
    for ids in [vec![5, 6, 7, 8], vec![8, 5, 7, 6], vec![5, 7_000_000_000, 6, 8]] {
        let index = IdIndex::new(&ids).unwrap();
        for (k, id) in ids.iter().enumerate() {
            assert_eq!(index.get(*id), Some(k as u32), "{ids:?}");
        }
        assert_eq!((index.get(4), index.get(9), index.get(u64::MAX)), (None, None, None));
        let mut found = Vec::new();
        index.extend_from_range(1, u64::MAX, 2, &mut found);
        let odd = ids.iter().enumerate().filter(|(_, id)| **id % 2 == 1 && **id < 100);
        found.sort_unstable();
        assert_eq!(found, odd.map(|(k, _)| k as u32).collect::<Vec<_>>(), "{ids:?}");
    }
}

#[test]
fn a_number_that_is_there_twice_is_reported_with_both_places() {
    assert_eq!(IdIndex::new(&[3, 4, 3]).err(), Some((0, 2)));
    assert_eq!(IdIndex::new(&[3, u64::MAX, 9, u64::MAX]).err(), Some((1, 3)));
}
