//! Tables of studies as Parquet files.

use flexarm_log::{CreateOptions, DataColumn, DataTable, DataValues, LogError};

/// Number of rows of a group in the file.
const GROUP: usize = 65_536;

fn table(rows: usize) -> DataTable {
    DataTable {
        columns: vec![
            DataColumn::new("run", DataValues::Whole((0..rows as i64).collect())),
            DataColumn::new(
                "payload.mass",
                DataValues::Number((0..rows).map(|k| if k % 5 == 2 { f64::NAN } else { 0.1 * k as f64 }).collect()),
            ),
            DataColumn::new(
                "reason",
                DataValues::Text((0..rows).map(|k| (k % 3 == 0).then(|| format!("größer {k}"))).collect()),
            ),
        ],
        texts: vec![("flexarm.study".into(), "{}".into())],
    }
}

#[test]
fn a_table_comes_back_as_it_was_written_and_twice_the_same_bytes() {
    let folder = std::env::temp_dir().join(format!("flexarm-table-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for rows in [0, 1, 7, GROUP + 3] {
        let (a, b) = (folder.join(format!("{rows}.parquet")), folder.join(format!("{rows}b.parquet")));
        let table = table(rows);
        table.write(&a, CreateOptions::default()).unwrap();
        table.write(&b, CreateOptions::default()).unwrap();
        assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
        let back = DataTable::read(&a).unwrap();
        assert_eq!((back.rows(), &back.texts, back.columns.len()), (rows, &table.texts, 3));
        assert_eq!(back.columns[0], table.columns[0]);
        assert_eq!(back.columns[2], table.columns[2]);
        let (DataValues::Number(x), DataValues::Number(y)) = (&back.columns[1].values, &table.columns[1].values) else {
            panic!("numbers")
        };
        assert!(x.iter().zip(y).all(|(x, y)| x.to_bits() == y.to_bits() || x.is_nan() && y.is_nan()));
    }
    let again = table(1).write(&folder.join("1.parquet"), CreateOptions::default());
    assert!(matches!(again, Err(LogError::Exists { .. })));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_table_that_was_cut_or_changed_is_told_as_no_table() {
    let path = std::env::temp_dir().join(format!("flexarm-table-cut-{}.parquet", std::process::id()));
    table(100).write(&path, CreateOptions::default().with_overwrite(true)).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 3, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(matches!(DataTable::read(&path), Err(LogError::NotARecording { .. })), "{length}");
    }
    std::fs::remove_file(&path).unwrap();
}

/// Equal numbers pack to almost nothing: the size of the file bounds neither memory nor time.
#[test]
fn a_small_table_that_unpacks_to_more_than_the_limit_is_refused_before_it_is_read() {
    let path = std::env::temp_dir().join(format!("flexarm-table-bomb-{}.parquet", std::process::id()));
    let column = |name: &str| DataColumn::new(name, DataValues::Number(vec![1.0; 17_000_000]));
    let bomb = DataTable { columns: vec![column("a"), column("b")], texts: Vec::new() };
    bomb.write(&path, CreateOptions::default().with_overwrite(true)).unwrap();
    let bytes = std::fs::metadata(&path).unwrap().len();
    let error = DataTable::read(&path).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    assert!(bytes < 268_435, "{bytes}");
    assert!(error.contains(" bytes, more than 268435456, the limit for its size"), "{error}");
    let size = error.split_once("it unpacks to ").and_then(|(_, size)| size.split_once(' ')).unwrap().0;
    // The numbers and what their pages need.
    assert!((272_000_000..272_200_000).contains(&size.parse::<u64>().unwrap()), "{error}");
}
