//! Matrices and lists of Abaqus and CalculiX as text.

use flexarm_fe_io::exchange::DofLabel;
use flexarm_fe_io::internals::{Text, parse_dof_list, parse_labelled};

#[test]
fn commas_and_blanks_and_either_triangle_read_alike() {
    for text in [
        "1,1, 1,1, 4.0\n1,2, 1,1, -1.5\n1,2, 1,2, 3.0\n",
        "1 1 1 1 4.0\n1 1 1 2 -1.5\n1 2 1 2 3.0\n",
        "** note\n1,1,1,1,4.\r\n1,1,1,2,-1.5\r\n1,2,1,1,-1.5\r\n1,2,1,2,3\r\n",
    ] {
        let (matrix, warning) = parse_labelled(Text::new(text, "t")).unwrap();
        assert_eq!(matrix.dense().unwrap().as_slice(), [4.0, -1.5, -1.5, 3.0]);
        assert_eq!(matrix.rows, [DofLabel::new(1, 1), DofLabel::new(1, 2)]);
        assert_eq!(warning, None);
    }
}

#[test]
fn internal_unknowns_of_abaqus_stand_last_and_are_reported() {
    let text = "-2,1,-2,1,7\n-1,1,-1,1,6\n5,1,5,1,4\n5,1,-1,1,1\n";
    let (matrix, warning) = parse_labelled(Text::new(text, "t")).unwrap();
    let nodes: Vec<_> = matrix.rows.iter().map(|label| label.node.unwrap()).collect();
    assert_eq!(nodes, [5, -1, -2]);
    assert!(warning.unwrap().contains("2 rows have negative node numbers"));
}

#[test]
fn a_dof_list_is_text_and_not_numbers() {
    let rows = parse_dof_list(Text::new("10.1\n10.10\n\n", "job.dof")).unwrap();
    assert_eq!(rows, [DofLabel::new(10, 1), DofLabel::new(10, 10)]);
    let error = parse_dof_list(Text::new("10.1\n10\n", "job.dof")).unwrap_err();
    assert!(error.to_string().starts_with("job.dof:2: row: found \"10\""), "{error}");
}
