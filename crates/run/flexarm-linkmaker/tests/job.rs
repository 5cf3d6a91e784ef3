//! Job files of a reduction.

use std::path::Path;

use flexarm_linkmaker::LinkError;
use flexarm_linkmaker::internals::{is_job, parse_job};
use flexarm_linkmaker::reduce::{At, InterfaceEntry, ReduceJob, SplitChoice, Tie, UrdfEntry};

const JOB: &str = r#"mesh = "arm.msh.gz"
units = "mm-t-s"
material = { E = 70e9, nu = 0.33, rho = 2700.0 }
split = [1, 2.5, 3]
chains = [3, 4]
geometric = true
[materials]
rib = "steel"
[[interface]]
select = "interface_A"
xyz = [0, -75.0, 0]
[[interface]]
name = "far"
select = { plane = { point = [0, 0, 0], normal = [1, 0, 0] } }
at = "centroid"
tie = "distributing"
"#;

fn parse(text: &str) -> Result<ReduceJob, LinkError> {
    parse_job(text, Path::new("jobs/arm.toml"))
}

/// The mass beyond the mesh changes every result, so a flag for the URDF must not drop it.
#[test]
fn a_urdf_on_the_command_line_keeps_the_rest_and_the_joint_of_the_job() {
    let text = format!("{JOB}[urdf]\nfile = \"a.urdf\"\nlink = \"arm\"\njoint = \"elbow\"\nrest = true\n");
    let with = |link: &str| {
        let mut job = parse(&text).unwrap();
        let urdf = UrdfEntry { file: "b.urdf".into(), link: link.into(), ..UrdfEntry::default() };
        job.put_over(ReduceJob { urdf: Some(urdf), ..ReduceJob::default() });
        job.urdf.unwrap()
    };
    let (same, other) = (with("arm"), with("forearm"));
    assert_eq!((same.file.as_path(), same.rest, same.joint.as_deref()), (Path::new("b.urdf"), true, Some("elbow")));
    assert_eq!((other.rest, other.joint), (true, None));
}

#[test]
fn a_job_is_read_with_paths_and_places_and_written_so_that_it_reads_the_same() {
    let job = parse(JOB).unwrap();
    assert_eq!(job.mesh, Path::new("jobs/arm.msh.gz"));
    assert_eq!((job.link_name().as_str(), job.geometric), ("arm", Some(true)));
    assert_eq!(job.split, Some(SplitChoice::Point([1.0, 2.5, 3.0])));
    assert_eq!(job.interface[0].place, "jobs/arm.toml:10:10");
    assert_eq!(job.interface[1].tie, Some(Tie::Distributing));

    let written = toml::to_string(&ReduceJob { mesh: "arm.msh.gz".into(), ..job.clone() }).unwrap();
    let mut again = parse(&written).unwrap();
    for (again, first) in again.interface.iter_mut().zip(&job.interface) {
        again.place.clone_from(&first.place);
    }
    assert_eq!(again, job);
}

#[test]
fn mistakes_are_answered_with_line_and_column() {
    for (old, new, at, word) in [
        ("units =", "unit =", ":2:1:", "`unit`"),
        ("mm-t-s", "mm-N-s", ":2:9:", "mm-t-s"),
        ("= true", "= 1", ":6:13:", "boolean"),
        ("nu = 0.33, ", "", ":3:", "nu"),
        ("nu = 0.33", "nu = 0.77", ":3:", "Poisson"),
        ("\"steel\"", "\"steal\"", ":8:7:", "aluminium"),
        ("\"centroid\"", "\"center\"", ":15:6:", "centroid"),
        ("\"distributing\"", "\"rbe3\"", ":16:7:", "distributing"),
        ("\"interface_A\"", "\"plane(0,0,0)\"", ":10:10:", "plane(x,y,z; nx,ny,nz)"),
        ("[1, 2.5, 3]", "\"middle\"", ":4:9:", "elastic-centre"),
        ("mesh = \"arm.msh.gz\"", "", ":1:1:", "mesh = "),
    ] {
        assert!(JOB.contains(old));
        let message = parse(&JOB.replacen(old, new, 1)).unwrap_err().to_string();
        assert!(message.contains(&format!("arm.toml{at}")) && message.contains(word), "{old}: {message}");
    }
}

#[test]
fn flags_go_before_the_file() {
    let mut job = parse(JOB).unwrap();
    let entry = |name: &str| InterfaceEntry { name: Some(name.into()), ..InterfaceEntry::default() };
    let flags = ReduceJob {
        modes: Some(3),
        tie: Some(Tie::Rigid),
        interface: vec![InterfaceEntry { at: Some(At::Centroid), ..entry("A") }, entry("third")],
        ..ReduceJob::default()
    };
    job.put_over(flags);
    assert_eq!((job.modes, job.interface.len()), (Some(3), 3));
    assert_eq!((job.interface[0].xyz, job.interface[0].at), (None, Some(At::Centroid)));
    assert!(job.interface[0].select.is_some() && job.interface[1].tie.is_none());
}

#[test]
fn meshes_and_jobs_are_told_apart_by_content() {
    assert!(is_job(JOB) && is_job("# comment\n\n  mesh=\"x\"\nbroken ="));
    assert!(!is_job("$MeshFormat\nmesh = 1\n") && !is_job("*HEADING\nmesh = x\n") && !is_job("solid mesh\n"));
}
