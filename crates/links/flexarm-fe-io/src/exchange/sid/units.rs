//! Conversion of a [`Sid`] to other units. The values of the shape coordinates are unchanged; their
//! factors change.
//!
//! Dimensions per shape coordinate, with the units L of length, M of mass and T of time:
//!
//! ```text
//! origin, phi  L      mdCM, Ct  M L      Ke, ksigma  M L²/T²      K0t       M L     (per acceleration)
//! psi, AP      1      J, Cr, Me, Gr, Ge, Oe  M L²     De  M L²/T   K0r, K0omega  M L²
//! sigma   M/(L T²)    first-order parts: as their matrices         K0F  L per force, 1 per torque
//! ```

use super::{Sid, SidMatrix, SidNode};
use flexarm_fem::units::UnitSystem;

impl Sid {
    /// Converts the body to other units. Blocks that are neither in the standard nor written for
    /// [`ModalLink`](flexarm_fem::ModalLink) are unchanged.
    pub fn in_units(&self, from: &UnitSystem, to: &UnitSystem) -> Self {
        let [length, mass, time] = [from.length / to.length, from.mass / to.mass, from.time / to.time];
        let (first, second) = (mass * length, mass * length * length);
        let energy = second / (time * time);
        let of_node = |node: &SidNode| SidNode {
            id: node.id,
            rframe: node.rframe.clone(),
            origin: node.origin.scaled(&|_| length),
            phi: node.phi.scaled(&|_| length),
            psi: node.psi.clone(),
            AP: node.AP.clone(),
            sigma: node.sigma.as_ref().map(|sigma| sigma.scaled(&|_| mass / (length * time * time))),
        };
        let n = self.nq().max(1);
        let of_other = |(name, block): &(String, SidMatrix)| {
            let scaled = match name.to_ascii_lowercase().as_str() {
                "k0t" => block.scaled(&|_| first),
                "k0r" | "k0omega" => block.scaled(&|_| second),
                // Six loads per interface, n columns each: three forces, three torques.
                "k0f" => block.scaled(&|column| if column / n % 6 < 3 { length } else { 1.0 }),
                _ => block.clone(),
            };
            (name.clone(), scaled)
        };
        Self {
            comment: self.comment.clone(),
            mass: self.mass * mass,
            modes: self.modes.clone(),
            nodes: self.nodes.iter().map(of_node).collect(),
            mdCM: self.mdCM.scaled(&|_| first),
            J: self.J.scaled(&|_| second),
            Ct: self.Ct.scaled(&|_| first),
            Cr: self.Cr.scaled(&|_| second),
            Me: self.Me.scaled(&|_| second),
            Gr: self.Gr.scaled(&|_| second),
            Ge: self.Ge.scaled(&|_| second),
            Oe: self.Oe.scaled(&|_| second),
            ksigma: self.ksigma.scaled(&|_| energy),
            Ke: self.Ke.scaled(&|_| energy),
            De: self.De.scaled(&|_| second / time),
            others: self.others.iter().map(of_other).collect(),
        }
    }
}

impl SidMatrix {
    /// Multiplies every entry by a factor that depends on its column, from 0.
    fn scaled(&self, factor: &dyn Fn(usize) -> f64) -> Self {
        let mut scaled = self.clone();
        let columns = 0..self.ncol;
        if columns.clone().any(|column| factor(column) != 1.0) && scaled.structure == 4 && scaled.entries0.is_empty() {
            // A unit matrix is not one in other units: store its diagonal.
            scaled.structure = 1;
            scaled.entries0 = (0..self.nrow.min(self.ncol)).map(|i| ((i, i), 1.0)).collect();
        }
        scaled.entries0.iter_mut().for_each(|((_, column), value)| *value *= factor(*column));
        scaled.entries1.iter_mut().for_each(|((_, _, column), value)| *value *= factor(*column));
        scaled
    }
}
