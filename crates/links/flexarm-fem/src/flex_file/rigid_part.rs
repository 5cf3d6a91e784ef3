//! Mass and inertia of a rigid part in a reduced-link file, written and read.

use nalgebra::Matrix3;

use super::document::{Node, Table};
use super::error::FlexFileError;
use super::text::numbers;
use super::units::Units;
use crate::rigid_part::RigidPart;

/// Writes mass (kg), centre of mass (m) and inertia about it (kg·m²), link axes.
pub(super) fn inertial(part: &RigidPart) -> String {
    let I = &part.inertia;
    let moments = [I[(0, 0)], I[(1, 1)], I[(2, 2)], I[(0, 1)], I[(0, 2)], I[(1, 2)]];
    format!("mass = {:?}\ncom = {}\ninertia = {}\n", part.mass, numbers(part.com.iter()), numbers(moments.iter()),)
}

/// Reads and checks the mass properties of a part, in SI, link axes.
///
/// * `name`: of the part, in messages.
pub(super) fn read_inertial(
    item: &Node<'_, '_>,
    table: &Table<'_, '_>,
    name: &str,
    units: &Units,
) -> Result<RigidPart, FlexFileError> {
    let mass = table.require("mass", "the mass of this part")?.number()? * units.mass;
    let com = table.require("com", "the centre of mass of this part, link axes")?.vector()?;
    let inertia = table.require("inertia", "[ixx, iyy, izz, ixy, ixz, iyz] about the com")?;
    let [xx, yy, zz, xy, xz, yz] =
        inertia.numbers::<6>("numbers: ixx, iyy, izz, ixy, ixz, iyz")?.map(|moment| moment * units.inertia());

    let part = RigidPart { mass, com: com * units.length, inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) };
    part.check(name).map_err(|cause| item.refused(cause, "mass and inertia of a possible body"))?;
    Ok(part)
}
