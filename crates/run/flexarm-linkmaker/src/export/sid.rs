//! Export as Standard Input Data: the modal link, with the full mass distribution that the other
//! formats condense.

use std::path::PathBuf;
use std::time::Instant;

use flexarm_fe_io::exchange::{modal_link_held_at, parse_sid, sid_of_modal_link, write_sid};
use flexarm_fem::{ModalLink, ReducedLink, UnitSystem};
use flexarm_files::{check_free, file_stem, write_all};
use flexarm_settings::Setting;
use nalgebra::{DMatrix, Matrix3};

use super::{ExportChecks, ExportFormat, ExportJob, ExportSummary, difference, nodes, part_lines};
use crate::{LinkError, stamp};

pub(super) fn export(job: &ExportJob, link: &ReducedLink, started: Instant) -> Result<ExportSummary, LinkError> {
    let Some(modal) = link.details.as_deref().and_then(|details| details.modal.as_ref()) else {
        let what = "has no [modal] section, which SID requires: reduce the mesh again with this version (flexarm \
                    reduce), or export its matrices in another format";
        return Err(LinkError::file(&job.link, what));
    };
    let mut warnings = omissions(link, modal);
    let count = modal.interfaces.len() + 1;
    let ids = if job.nodes.is_empty() { (1..=count as i64).collect() } else { nodes(job, count)? };
    let mut sid = sid_of_modal_link(modal);
    for (node, id) in sid.nodes.iter_mut().zip(&ids) {
        node.id = *id;
    }
    let text = write_sid(&sid.in_units(&UnitSystem::SI, &job.units));
    let names = modal.interfaces.iter().map(|interface| interface.name.as_str());
    let names: Vec<&str> = std::iter::once("A").chain(names).collect();
    let pairs: Vec<String> = names.iter().zip(&ids).map(|(name, id)| format!("{name}={id}")).collect();
    let map = pairs.join(",");

    let stem = file_stem(&link.name);
    let texts: [(PathBuf, String); 2] = [
        (job.folder.join(format!("{stem}.SID_FEM")), text),
        (job.folder.join(format!("{stem}_README.txt")), readme(job, link, modal, &map)),
    ];
    let paths: Vec<PathBuf> = texts.iter().map(|(path, _)| path.clone()).collect();
    check_free(&paths, job.overwrite)?;
    // Checked before any file is written: data that cannot be read leave no file.
    let [stiffness_error, mass_error, integrals_error] =
        read_back(job, &link.name, modal, &texts[0], ids[0], &mut warnings)?;
    write_all(&texts)?;
    let whole = modal.rigid();
    Ok(ExportSummary {
        link: link.name.clone(),
        format: ExportFormat::Sid.name(),
        units: job.units.name(),
        rows: modal.coordinates(),
        modes: modal.coordinates().saturating_sub(6 * modal.interfaces.len()),
        map,
        mass_kg: whole.mass,
        com_m: whole.com.into(),
        inertia: whole.inertia.transpose().into(),
        stiffness: link.K_BB.transpose().into(),
        frequencies_hz: modal.held_frequencies_hz().into_iter().take(10).collect(),
        checks: ExportChecks {
            symmetry: link.checks.asymmetry,
            rigid_body_residual: link.checks.rigid_body_residual,
            mass_error: Some(mass_error),
            stiffness_error,
            integrals_error: Some(integrals_error),
        },
        wall_s: started.elapsed().as_secs_f64(),
        peak_rss_bytes: stamp::peak_rss_bytes(),
        warnings,
        files: paths.iter().map(|path| path.display().to_string()).collect(),
    })
}

/// Returns warnings about what a SID does not contain.
fn omissions(link: &ReducedLink, modal: &ModalLink) -> Vec<String> {
    let mut warnings = Vec::new();
    let attached = link.details.iter().flat_map(|details| &details.attached);
    let riding: f64 = attached.map(|body| body.mass).sum();
    if riding > 0.0 {
        warnings
            .push(format!("attached bodies of {riding:.4} kg are not in the SID, which contains only the link itself"));
    }
    if !modal.has_second_order() {
        warnings.push(crate::import::SECOND_ORDER_UNKNOWN.into());
    }
    warnings
}

/// Reads an exported text with the code of every import. Returns the relative differences of
/// stiffness, mass and mass integrals, and warns about large ones.
fn read_back(
    job: &ExportJob,
    link: &str,
    modal: &ModalLink,
    (path, text): &(PathBuf, String),
    first: i64,
    warnings: &mut Vec<String>,
) -> Result<[f64; 3], LinkError> {
    let back = parse_sid(text, &path.display().to_string()).map_err(Box::new)?;
    let back = back.in_units(&job.units, &UnitSystem::SI);
    let back = modal_link_held_at(link, &back, first).map_err(Box::new)?;
    let errors = [difference(&modal.K, &back.K), difference(&modal.M, &back.M), integrals(modal, &back)];
    for (what, error) in ["stiffness", "mass", "integrals"].iter().zip(errors) {
        if error.is_nan() || error > ExportFormat::Sid.digits() {
            warnings.push(format!("the exported {what}, read back, differs by {error:.1e} (relative to its diagonal)"));
        }
    }
    Ok(errors)
}

/// Maximum difference of the mass integrals, relative to the magnitudes given by mass, inertia and
/// modal mass.
fn integrals(a: &ModalLink, b: &ModalLink) -> f64 {
    let n = a.coordinates();
    if b.coordinates() != n {
        return f64::INFINITY;
    }
    let size: Vec<f64> = a.M.diagonal().iter().map(|m| m.sqrt()).collect();
    let (mass, lever) = (a.mass.sqrt(), a.inertia.amax().sqrt());
    let apart = |a: &Matrix3<f64>, b: &Matrix3<f64>| (a - b).amax();
    let mut worst = [
        (a.mass / b.mass - 1.0).abs(),
        (a.first_moment - b.first_moment).amax() / (mass * lever),
        apart(&a.inertia, &b.inertia) / (lever * lever),
    ]
    .into_iter()
    .fold(0.0, f64::max);
    for k in 0..n {
        let linear = (a.C_t.column(k) - b.C_t.column(k)).amax() / (mass * size[k]);
        let angular = (a.C_r.column(k) - b.C_r.column(k)).amax() / (lever * size[k]);
        worst = worst.max(linear).max(angular).max(apart(&a.P[k], &b.P[k]) / (lever * size[k]));
        for l in 0..n {
            worst = worst.max(apart(&a.N[k * n + l], &b.N[k * n + l]) / (size[k] * size[l]));
        }
    }
    let lost = a.geometric.is_some() != b.geometric.is_some();
    if let (Some(a), Some(b)) = (&a.geometric, &b.geometric) {
        let of = |G: &flexarm_fem::GeometricStiffness| -> Vec<DMatrix<f64>> {
            let all = G.acceleration.iter().chain(&G.angular).chain(&G.centrifugal).chain(G.interface.iter().flatten());
            all.cloned().collect()
        };
        for (a, b) in of(a).iter().zip(&of(b)) {
            worst = worst.max((a - b).amax() / a.amax().max(f64::MIN_POSITIVE));
        }
    }
    if lost { f64::INFINITY } else { worst }
}

/// Returns the text with frames, units and coordinates, which the format does not hold.
fn readme(job: &ExportJob, link: &ReducedLink, modal: &ModalLink, map: &str) -> String {
    let units = &job.units;
    let mut text = format!(
        "Link {}, written by flexarm export as {}\n\nbody reference frame: the link frame, a tangent frame at \
         interface A, whose node is fixed in it\naxes: parallel to the link frame\nunits: {units} \
         (length-mass-time; derived unit of force = {} N); angles in rad\nGr, Ge: column (axis-1) nq + mode; Oe: \
         xx yy zz xy yz xz; De is empty\n\nmap for flexarm import: {} \"{map}\" {} {units}\n\nshape coordinates:\n",
        link.name,
        job.format.name(),
        units.force(),
        Setting::Map,
        Setting::Units,
    );
    for (k, label) in modal.labels.iter().enumerate() {
        text += &format!("  {} {label}\n", k + 1);
    }
    text += &part_lines(link);
    text
}
