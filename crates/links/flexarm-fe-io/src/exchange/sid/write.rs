//! Writes a [`Sid`] as text in the layout of FEMBS files.

use super::{NODE_BLOCKS, Sid, SidMatrix};
use crate::exchange::fortran::fortran;

/// Writes a `.SID_FEM` file with 17 digits; it reads back bit for bit.
///
/// Index orders are those of the struct; see [`Sid::conventions`].
pub fn write_sid(sid: &Sid) -> String {
    let mut text =
        format!("{:5} {:4}    :{}\n part\n     new modal\n          refmod\n", sid.nodes.len(), sid.nq(), sid.comment);
    let mut line = |indent: usize, key: &str, value: &str| {
        text += &format!("{:indent$}{key:width$}= {value}\n", "", width = 48 - indent);
    };
    line(15, "mass", &number(sid.mass));
    line(15, "nelastq", &format!("{:3}", sid.nq()));
    for (k, mode) in sid.modes.iter().enumerate() {
        line(15, &format!("ielastq ({:4})", k + 1), mode);
    }
    text += "          end refmod\n          frame\n";
    for node in &sid.nodes {
        text += &format!("{:15}{:33}= {:8}\n", "", "new node", node.id);
        text += &format!("{:20}{:28}= {}\n", "", "rframe", node.rframe);
        let blocks = [Some(&node.origin), Some(&node.phi), Some(&node.psi), Some(&node.AP), node.sigma.as_ref()];
        for (name, block) in NODE_BLOCKS.into_iter().zip(blocks) {
            if let Some(block) = block {
                matrix(&mut text, 20, name, block);
            }
        }
        text += "               end node\n";
    }
    text += "          end frame\n";
    for (name, block) in sid.blocks() {
        matrix(&mut text, 10, name, block);
    }
    text += "     end modal\n end part\n";
    text
}

fn matrix(text: &mut String, indent: usize, name: &str, matrix: &SidMatrix) {
    *text += &format!("{:indent$}{name}\n", "");
    let inner = indent + 5;
    let mut line = |key: String, value: String| {
        *text += &format!("{:inner$}{key:width$}= {value}\n", "", width = 48 - inner);
    };
    for (key, value) in [
        ("order", usize::from(matrix.order)),
        ("nrow", matrix.nrow),
        ("ncol", matrix.ncol),
        ("nq", matrix.nq),
        ("nqn", matrix.nqn),
        ("structure", usize::from(matrix.structure)),
    ] {
        line(key.into(), format!("{value:3}"));
    }
    for ((row, column), value) in &matrix.entries0 {
        line(format!("m0({:2},{:2})", row + 1, column + 1), number(*value));
    }
    for ((row, mode, column), value) in &matrix.entries1 {
        line(format!("m1({:2},{:2},{:2})", row + 1, mode + 1, column + 1), number(*value));
    }
    *text += &format!("{:indent$}end {name}\n", "");
}

fn number(value: f64) -> String {
    fortran(value, 16, 23).replace('E', "D")
}
