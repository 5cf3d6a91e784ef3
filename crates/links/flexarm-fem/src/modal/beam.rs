//! Modal link of a uniform beam, computed with beam elements between its two ends.
//!
//! Start at [`BeamLink::modal`]. The road is that of a mesh: elements, condensation, integrals.
//! Link axes.
//!
//! Not here: the beam element ([`crate::beam`]), the link of two rigid parts
//! ([`BeamLink::reduce`]).

use std::fmt::Display;

use super::{ModalLink, ModalOptions, ModalSource};
use crate::beam_link::BeamLink;
use crate::element::Quadrature;
use crate::error::{FemError, positive};
use crate::material::Material;
use crate::mesh::{BeamProperties, ElementBlock, ElementKind, Mesh, Region};
use crate::model::{AssemblyOptions, FeModel};
use crate::reduction::{Condensation, CondensationOptions, Interface, InterfaceFrame, Tie};
use crate::section::{Bar, Section};
use crate::sparse::ModesWanted;

impl BeamLink {
    /// Computes the modal link of this beam: static shapes of the distal interface and `modes`
    /// fixed-interface modes.
    ///
    /// The rigid arms from the beam to the joints are massless. The number of elements is 24, or
    /// two per mode if that is more.
    ///
    /// ```
    /// use flexarm_fem::{BeamLink, Material, Section};
    ///
    /// let section = Section::Circle { diameter: 0.02 };
    /// let rod = BeamLink::new("rod", section, Material::STEEL, 1.0).modal(8)?;
    /// assert_eq!(rod.coordinates(), 14);
    /// // Cantilever: 1.8751² sqrt(EI/(μ l⁴)) / 2π.
    /// assert!((rod.held_frequencies_hz()[0] - 14.47).abs() < 0.01);
    /// # Ok::<(), flexarm_fem::FemError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::modal_with`].
    pub fn modal(&self, modes: usize) -> Result<ModalLink, FemError> {
        let options = ModalOptions::default();
        self.modal_with(&ModalOptions { modes, elements: options.elements.max(2 * modes), ..options })
    }

    /// Computes the modal link of this beam with options.
    ///
    /// Returns six coordinates of B, then [`ModalOptions::modes`] fixed-interface modes; link axes
    /// about Lo, SI. The static stiffness is that of the closed form.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for impossible dimensions, materials and masses, too few elements
    /// and too many modes, [`FemError::Missing`] for a section without shear stiffness in
    /// Timoshenko's theory, [`FemError::BeamElements`] if rounding makes the elements singular.
    pub fn modal_with(&self, options: &ModalOptions) -> Result<ModalLink, FemError> {
        let reduced = self.reduce()?;
        let m = options.elements;
        let range = |what: &str, found: usize, allowed: String| FemError::OutOfRange {
            what: what.into(),
            found: found as f64,
            allowed,
        };
        if !(2..=10_000).contains(&m) {
            return Err(range("number of beam elements", m, "2 to 10000".into()));
        }
        if options.modes > 6 * (m - 1) {
            let allowed = format!("up to {}, six per inner node of the elements", 6 * (m - 1));
            return Err(range("number of fixed-interface modes", options.modes, allowed));
        }

        // Mesh of the beam, model, condensation to A and B, and modes.
        let mesh = self.elements(m)?;
        let assembly = AssemblyOptions::default();
        let refused = |step, cause: &dyn Display| FemError::BeamElements { step, cause: cause.to_string() };
        let model = FeModel::assemble(&mesh, &assembly).map_err(|cause| refused("assembly", &cause))?;
        let interface =
            |name: &str, X_LI, node| Interface { name: name.into(), X_LI, nodes: vec![node], tie: Tie::Rigid };
        let interfaces = [interface("A", self.X_LA, 0), interface("B", self.X_LB, m as u32)];
        let condensation = Condensation::new(&model, &interfaces, CondensationOptions::default())
            .map_err(|cause| refused("condensation", &cause))?;
        let fixed_modes = condensation
            .fixed_modes(ModesWanted::Count(options.modes))
            .map_err(|cause| refused("fixed-interface modes", &cause))?;
        let frame = |i: &Interface| InterfaceFrame { name: i.name.clone(), X_LI: i.X_LI, tie: Some(i.tie) };
        let mut superelement = condensation.superelement(interfaces.iter().map(frame).collect(), &fixed_modes);
        // The closed-form stiffness keeps the last digits that condensation loses.
        let K12 = reduced.matrix12();
        superelement.K.view_mut((0, 0), (12, 12)).copy_from(&K12);

        let source = ModalSource {
            mesh: &mesh,
            materials: &[Material::STEEL],
            quadrature: Quadrature::Exact,
            condensation: &condensation,
            interfaces: &interfaces,
            fixed_modes: &fixed_modes,
            superelement: &superelement,
        };
        Ok(source.modal_link(&self.name, options.geometric))
    }

    /// Mesh of the beam with `m` elements of equal length, link axes.
    fn elements(&self, m: usize) -> Result<Mesh, FemError> {
        let bar = self.section.bar(&self.material)?;
        let factor = match self.mass {
            Some(mass) => positive("mass of the link (kg)", mass)? / (bar.mass_per_length * self.length),
            None => 1.0,
        };
        let bar = Bar {
            mass_per_length: bar.mass_per_length * factor,
            rotary_y: bar.rotary_y * factor,
            rotary_z: bar.rotary_z * factor,
            ..bar
        };
        let axis = |k: usize| self.X_LE.rotation.matrix().column(k).into_owned();
        let start = self.X_LE.translation.vector;
        Ok(Mesh {
            node_ids: (1..=m as u64 + 1).collect(),
            nodes: (0..=m).map(|k| start + axis(0) * (self.length * k as f64 / m as f64)).collect(),
            blocks: vec![ElementBlock {
                kind: ElementKind::Beam2,
                region: 0,
                ids: (1..=m as u64).collect(),
                connectivity: (0..m as u32).flat_map(|k| [k, k + 1]).collect(),
            }],
            // The section has its own stiffness and mass, so the material is not used.
            regions: vec![Region {
                name: self.name.clone(),
                material: Some(Material::STEEL),
                beam: Some(BeamProperties { section: Section::Given(bar), y_axis: axis(1), theory: self.theory }),
            }],
            ..Mesh::default()
        })
    }
}
