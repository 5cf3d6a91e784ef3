//! Mistakes in files of measurements are refused with path, line and column, in every format.

use std::fs;
use std::path::{Path, PathBuf};

use flexarm_identify::{IdentifyRequest, PlanRequest, identify_robot, plan_measurements};
use flexarm_run::Robot;

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl Folder {
    fn new() -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-places-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// Returns the error of an identification, without the path of the folder.
    fn refused(&self, robot: &Robot, job: &str, file: &str, content: &str) -> String {
        let path = self.0.join("job.toml");
        fs::write(&path, format!("format = 1\n{job}\n")).unwrap();
        fs::write(self.0.join(file), content).unwrap();
        self.plain(identify_robot(robot, &path, &IdentifyRequest::default()).expect_err(job).to_string())
    }

    fn plain(&self, error: String) -> String {
        error.replace(&format!("{}/", self.0.display()), "")
    }
}

fn kr210() -> Robot {
    Robot::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210")).unwrap()
}

const JOINTS: &str = "joint_1,joint_2,joint_3,joint_4,joint_5,joint_6";

/// Job, further columns, rows after the joints, expected place and start of the message. A row that
/// begins with a comma has no value for the first joint.
const TABLES: [(&str, &str, &str, &str); 14] = [
    (MOVED, "fz,dx,dy,dz", "0,-981,0,0,1e-3\n0,,0,0,1e-3", "t.csv:3:1: fz is empty, expected a number"),
    (MOVED, "fz,dx,dy,dz", ",-981,0,0,1e-3", "t.csv:2:1: joint \"joint_1\" has no value"),
    (MOVED, "fz,dx,dy,dz", "400,-981,0,0,1e-3", "t.csv:2:1: joint \"joint_1\" at 400: outside the range of any joint"),
    (MOVED, "fz,d,dx,dy,dz", "0,-981,1e-3,0,0,1e-3", "t.csv:2:1: a row has d and dx, dy, dz"),
    (MOVED, "fz,d,ux,uy,uz", "0,-981,1e-3,0,0,0", "t.csv:2:1: direction has zero length"),
    (MOVED, "fz,d", "0,-981,1e-3", "t.csv:2:1: a single value needs its direction"),
    (MOVED, "fz,dx,dy,dz", "0,-981,,,", "t.csv:2:1: t.csv:2: there is no measured value"),
    (MOVED, "fz,dx,dy,dz", "0,0,0,0,1e-3", "t.csv:2:1: t.csv:2: the loads before and after are equal"),
    (MOVED, "fz,dx,dy,dz,std", "0,-981,0,0,1e-3,-1", "t.csv:2:1: std is -1, expected a positive number"),
    (MOVED, "mass,dx,dy,dz", "0,-5,0,0,1e-3", "t.csv:2:1: a load has a mass of -5 kg"),
    (MOVED, "fz,dx,dy,dz,gauge", "0,-981,0,0,1e-3,1", "t.csv:1:1: column \"gauge\" is not known"),
    (MOVED, "fz,dx,dy,dz", "", "t.csv:1:1: the table has no rows"),
    (PLACED, "x,y,z", "0,,,", "t.csv:1:1: no row has a value of x, y or z"),
    (PLACED, "x,y,z,cx", "0,1,2,3,", "t.csv:2:1: cx is empty, expected a number"),
];
const MOVED: &str = "[[displacement]]\nfile = \"t.csv\"";
const PLACED: &str = "[instrument.tracker]\n[target.ball]\nxyz = [0.0, 0.0, 0.1]\n[[place]]\nfile = \"t.csv\"";

/// Further formats: job, file, content, expected.
const FILES: [(&str, &str, &str, &str); 8] = [
    (ENCODERS, "t.csv", "t,m,l\n0,0,0\n0.1,0,\n0.2,0,0", "t.csv:3:1: column \"l\" is empty, expected a number"),
    (RESPONSE, "t.csv", "hz,re,im\n1,1,1\n\n2,,1", "t.csv:4:1: expected finite numbers, hz >= 0 and std > 0"),
    (RESPONSE, "t.csv", "f,re,im\n1,1,1", "t.csv:1:1: column \"f\" is not known"),
    (RESPONSE, "t.csv", "hz,re\n1,1", "t.csv:1:1: expected the columns re and im, or magnitude and phase"),
    (HAMMER, "t.uff", "solid x", "t.uff:1:1: this is not a universal file"),
    (HAMMER, "t.uff", "    -1\n   164\n code\n 0 0\n", "t.uff:4:1: expected factors of length and force above 0"),
    ("[[displacement]]\njoints = [0, 0, 0, 0, 0]", "t.csv", "", "job.toml:3:10: 5 joint values, the robot has 6"),
    ("[[frequency]]\njoints = [0, 0, 0, 0, 0, 0]\nhz = [-1.0]", "t.csv", "", "job.toml:4:6: hz: expected positive"),
];
const ENCODERS: &str = "[[encoders]]\nfile = \"t.csv\"\ntime = \"t\"\nmotor = { joint_1 = \"m\", joint_2 = \"m\", \
    joint_3 = \"m\", joint_4 = \"m\", joint_5 = \"m\", joint_6 = \"m\" }\nlink = { joint_1 = \"l\" }";
const RESPONSE: &str = "[[response]]\nfile = \"t.csv\"\njoints = [0, 0, 0, 0, 0, 0]\nunit = \"m/N\"\n\
    watched_direction = \"x\"\nhit_direction = \"x\"";
const HAMMER: &str = "[[response]]\nfile = \"t.uff\"\njoints = [0, 0, 0, 0, 0, 0]";

#[test]
fn a_mistake_in_any_table_or_file_of_measurements_is_refused_at_its_path_line_and_column() {
    let (folder, robot) = (Folder::new(), kr210());
    for (job, columns, rows, expected) in TABLES {
        // Every row gives the first joint; the other five are at zero.
        let row = |row: &str| {
            let (first, rest) = row.split_once(',').unwrap();
            format!("{first},0,0,0,0,0,{rest}\n")
        };
        let rows: String = rows.lines().map(row).collect();
        let error = folder.refused(&robot, job, "t.csv", &format!("{JOINTS},{columns}\n{rows}"));
        assert!(error.starts_with(expected), "{error}\nexpected {expected}");
    }
    for (job, file, content, expected) in FILES {
        let error = folder.refused(&robot, job, file, content);
        assert!(error.starts_with(expected), "{error}\nexpected {expected}");
    }
    let poses = folder.0.join("poses.csv");
    fs::write(&poses, format!("{JOINTS}\n0,0,0,0,0,0\n0,0,,0,0,0\n")).unwrap();
    let request = PlanRequest { poses: Some(poses), ..PlanRequest::new(3) };
    let error = folder.plain(plan_measurements(&robot, &request).unwrap_err().to_string());
    assert!(error.starts_with("poses.csv:3:1: joint \"joint_3\" has no value"), "{error}");
}
