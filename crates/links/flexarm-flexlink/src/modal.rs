//! Modal links on the tree: one body with its interfaces.
//!
//! The body keeps name and frame of the link L, in which all mass integrals and shapes are given
//! (linear first). Each interface except A becomes a child link without coordinates of its own, in
//! link axes. Not here: computation of modes and integrals (`flexarm-fem`), their dynamics
//! (`flexarm-kinematics`).

use std::sync::Arc;

use flexarm_fem::ModalLink;
use flexarm_kinematics::{
    InterfaceShape, Joint, JointKind, Link, LinkInertia, Mechanism, ModalBody, Pose, SpatialInertia,
};
use nalgebra::DMatrix;

use crate::interfaces::nearest;
use crate::substitute::{
    FlexibleLink, FlexibleSpan, Parts, Site, SubstitutionError, inertia_of, move_children, shared,
};

/// Maximum distance of the far interface from the far end of the reduced link, relative to its
/// length.
const AT_INTERFACE: f64 = 1e-6;

/// Converts the mass integrals and shapes of a modal link to those of the tree model: the same numbers,
/// about the origin of the link and in its axes (kg, kg m, kg m²; per modal coordinate). Second-order
/// terms that are all zero, as those of condensed matrices, are left out.
pub fn modal_body(link: &ModalLink) -> ModalBody {
    ModalBody {
        mass: link.mass,
        first_moment: link.first_moment,
        inertia: link.inertia,
        C_t: link.C_t.column_iter().map(|c| c.into_owned()).collect(),
        C_r: link.C_r.column_iter().map(|c| c.into_owned()).collect(),
        P: link.P.clone(),
        N: if link.N.iter().all(|N| N.amax() == 0.0) { Vec::new() } else { link.N.clone() },
        M: link.M.clone(),
        interfaces: link.interfaces.iter().map(|i| InterfaceShape { X_LI: i.X_LI, Phi: i.Phi.clone() }).collect(),
    }
}

/// Minimum eigenvalue of a mass matrix scaled to a unit diagonal; a value of zero or below is not
/// physical.
fn smallest_scaled(M: &DMatrix<f64>) -> f64 {
    let scale = M.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
    DMatrix::from_fn(M.nrows(), M.ncols(), |i, j| M[(i, j)] * scale[i] * scale[j]).symmetric_eigenvalues().min()
}

/// Replaces a link by a modal body.
///
/// Attached bodies are fixed rigidly to the interface on their side of the split. With
/// [`Parts::FromLink`], the mass integrals of the undeformed body are replaced by those of the
/// mechanism's link; where no body with these has the shapes of the beam, the beam has a share of
/// the mass, and bodies at its ends have the rest.
pub(crate) fn substitute_modal(
    mechanism: &mut Mechanism,
    flexible: &FlexibleLink,
    site: &Site,
    modal: &Arc<ModalLink>,
) -> Result<FlexibleSpan, SubstitutionError> {
    let (name, reduced) = (&flexible.link, &flexible.reduced);
    let fail = |what: String| SubstitutionError::NotModal { link: name.clone(), what };
    // The first interface must be at B.
    let Some(far) = modal.interfaces.first() else { return Err(fail("it has one interface only".into())) };
    let distance = (far.X_LI.translation.vector - site.p_LB).norm();
    if distance > AT_INTERFACE * site.length {
        return Err(fail(format!("its interface {:?} lies {distance:.3e} m from B of the reduced link", far.name)));
    }
    let mut body = modal_body(modal);
    // Masses: those of the modal body, or those of the link, as a whole or shared with its two ends.
    let (mut share, mut ends) = (1.0, attached_bodies(flexible, site));
    if let Parts::FromLink(_) = flexible.parts
        && !take_mass_integrals(&mut body, name, site)?
    {
        let divided = shared(flexible, site)?;
        share = divided.share;
        scale_mass(&mut body, share);
        ends = divided.ends.map(|part| (part.mass > 0.0).then(|| inertia_of(&part).spatial()));
    }

    // The body at A stays on the link; that at B goes to the child link of the first interface.
    let [near, beyond] = ends;
    for link in mechanism.links.iter_mut().filter(|l| l.name == *name) {
        link.inertia = near.map(rigid);
    }
    let mut part_masses = vec![body.mass];
    part_masses.extend(near.iter().chain(&beyond).map(|i| i.mass));
    add_interfaces(mechanism, name, site, modal, beyond);
    mechanism.modal.push((name.clone(), Arc::new(body)));
    Ok(FlexibleSpan {
        link: name.clone(),
        distal_link: format!("{name}__distal"),
        X_LA: reduced.X_LA,
        X_DB: Pose::from(far.X_LI.translation).inverse() * reduced.X_LB,
        joints: Vec::new(),
        length: site.length,
        part_masses,
        lumped: None,
        share,
    })
}

/// Replaces the mass integrals of the undeformed body by those of the mechanism's link; returns
/// whether a body with them has the mode shapes, and leaves the body unchanged if not.
fn take_mass_integrals(body: &mut ModalBody, name: &str, site: &Site) -> Result<bool, SubstitutionError> {
    let own = site.own(name)?.spatial();
    if (own.mass / body.mass - 1.0).abs() > 1e-9 {
        let what = format!("it weighs {} kg, the link {} kg", body.mass, own.mass);
        return Err(SubstitutionError::NotModal { link: name.to_owned(), what });
    }
    let before = (body.first_moment, body.inertia);
    (body.first_moment, body.inertia) = (own.first_moment, own.rotational);
    let fits = smallest_scaled(&body.mass_matrix()) > 0.0;
    if !fits {
        (body.first_moment, body.inertia) = before;
    }
    Ok(fits)
}

/// Scales the mass of a body, with its distribution and its shapes unchanged.
fn scale_mass(body: &mut ModalBody, factor: f64) {
    body.mass *= factor;
    body.first_moment *= factor;
    body.inertia *= factor;
    body.M *= factor;
    body.C_t.iter_mut().chain(&mut body.C_r).for_each(|integral| *integral *= factor);
    body.P.iter_mut().chain(&mut body.N).for_each(|integral| *integral *= factor);
}

/// Adds a child link per interface, with the joints nearest to it; that at B has the inertia
/// `beyond`.
fn add_interfaces(
    mechanism: &mut Mechanism,
    name: &str,
    site: &Site,
    modal: &ModalLink,
    beyond: Option<SpatialInertia>,
) {
    let far_ends = modal.interfaces.iter().map(|interface| interface.X_LI.translation.vector);
    let places: Vec<_> = std::iter::once(site.p_LA).chain(far_ends).collect();
    for (k, interface) in modal.interfaces.iter().enumerate() {
        // Interface frames have the axes of the link.
        let X_LI = Pose::from(interface.X_LI.translation);
        let to = if k == 0 { format!("{name}__distal") } else { format!("{name}__{}", interface.name) };
        move_children(mechanism, name, &to, &X_LI, |child, p| match child == site.distal_joint {
            true => k == 0,
            false => nearest(p, places.iter()) == Some(k + 1),
        });
        let at_B = beyond.filter(|_| k == 0).map(|i| {
            let part = rigid(i);
            LinkInertia { com: part.com - X_LI.translation.vector, ..part }
        });
        mechanism.links.push(Link { name: to.clone(), inertia: at_B });
        mechanism.joints.push(Joint::new(format!("{to}__interface"), JointKind::Interface(k), name, &to, X_LI));
    }
}

fn rigid(inertia: SpatialInertia) -> LinkInertia {
    LinkInertia { mass: inertia.mass, com: inertia.com(), inertia_com: inertia.inertia_com() }
}

/// Returns the inertias of the attached bodies: those near A, which go to the link itself, and
/// those near B, which go to the distal link.
fn attached_bodies(flexible: &FlexibleLink, site: &Site) -> [Option<SpatialInertia>; 2] {
    let reduced = &flexible.reduced;
    let middle = reduced.split.X_LS.translation.vector;
    let line = site.p_LB - site.p_LA;
    let (mut near, mut beyond): (Option<SpatialInertia>, Option<SpatialInertia>) = (None, None);
    if let (Some(details), Parts::Reduced) = (&reduced.details, flexible.parts) {
        for part in &details.attached {
            let place = if (part.com - middle).dot(&line) > 0.0 { &mut beyond } else { &mut near };
            let add = inertia_of(part).spatial();
            match place {
                Some(sum) => *sum += add,
                None => *place = Some(add),
            }
        }
    }
    [near, beyond]
}
