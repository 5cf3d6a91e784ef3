//! Runs as columns, and the names of their channels.

use flexarm_sample::{Columns, ElasticSample, GaugeQuantity, RunHeader, Sample, TwinSample};

fn header(has_rigid: bool) -> RunHeader {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    RunHeader {
        joints: names(&["joint_1", "joint_2"]),
        prismatic: vec![false, true],
        elements: names(&["link_2"]),
        contributors: names(&["link_2", "joint_1"]),
        gauges: names(&["web_strain", "root_von_mises_pa"]),
        has_rigid,
        ..RunHeader::default()
    }
}

fn sample(step: u64) -> Sample {
    let x = step as f64;
    let twin =
        |x: f64| TwinSample { q: vec![x, 2.0 * x], qdot: vec![1.0, 2.0], effort: vec![-x, x], ..TwinSample::default() };
    Sample {
        time_s: 1e-3 * x,
        step,
        flexible: twin(x),
        rigid: twin(x + 0.5),
        error_world: [x, 1.0, 2.0, 3.0, 4.0, 5.0],
        elastic: vec![ElasticSample { deflection: [x; 6], load: [10.0 * x; 6] }],
        contributions: vec![[x, 0.0, 0.0], [0.0, x, 0.0]],
        gauges: vec![1e-6 * x, 1e6 * x],
        ..Sample::default()
    }
}

/// Truth: the columns themselves, taken apart and put together.
#[test]
fn columns_filled_with_their_own_values_are_the_same() {
    for has_rigid in [false, true] {
        let mut columns = Columns::new(&header(has_rigid));
        (0..5).for_each(|step| columns.push(&sample(step)));
        assert_eq!(columns.column("error_world").is_some(), has_rigid);
        assert!(columns.columns().iter().all(|column| column.values.len() == 5 * column.width));
        assert_eq!(columns.column("deflection").unwrap().values[6..12], [1.0; 6], "row 1 of one element");

        let parts = || columns.columns().iter().map(|column| (column.name.clone(), column.values.clone()));
        assert_eq!(columns.filled(parts()).as_ref(), Some(&columns));
        assert_eq!(columns.filled(parts().skip(1)), None, "a signal is missing");
        let short = parts().map(|(name, mut values)| {
            values.truncate(if name == "load" { values.len() - 1 } else { values.len() });
            (name, values)
        });
        assert_eq!(columns.filled(short), None, "a signal has too few values");
    }
}

#[test]
fn a_contributor_has_one_colour_as_link_spring_and_joint() {
    let header = header(true);
    // Contributors first; the spring of link_2 and joint_1 are known then.
    assert_eq!(["link_2", "joint_1", "joint_2", "other"].map(|name| header.color_number(name)), [0, 1, 2, 3]);
}

#[test]
fn gauges_are_listed_by_quantity_with_readable_names() {
    let header = header(true);
    let of = |quantity| header.gauges_of(quantity).collect::<Vec<_>>();
    assert_eq!(of(GaugeQuantity::Strain), [(0, "web".to_owned())]);
    assert_eq!(of(GaugeQuantity::Stress), [(1, "root von Mises".to_owned())]);
}
