//! Tables as people write them, real files of other programs, damage, and the split.

use std::path::{Path, PathBuf};

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, InputFiles, Ports, Stage};

use super::stage::{PAIR, SUMMARY};
use super::*;

fn text(content: &str) -> ColumnTable {
    read_text(content.as_bytes(), Separator::Auto).unwrap()
}

fn values(table: &ColumnTable) -> Vec<Vec<f64>> {
    table.columns.iter().map(|column| column.values.clone()).collect()
}

#[test]
fn every_usual_way_to_write_columns_gives_the_same_numbers() {
    let wanted = vec![vec![0.5, 1.5], vec![-2e-3, 3.0]];
    for written in [
        "0.5 -2e-3\n1.5 3\n",
        "  0.5\t -2.0000e-03\t\r\n  1.5\t3\r\n",
        "# made by hand\nu, y\n0.5, -2e-3\n\n1.5, 3\n",
        "u;y\n0,5;-2e-3\n1,5;3\n",
        "0,5 -2e-3\n1,5 3\n",
        "\u{feff}\"u\",\"y\"\n\"0.5\",\"-0.002\"\n\"1.5\",\"3\"",
        "force (N)\tresponse (V)\n0.5\t-2e-3\n1.5\t3\n",
    ] {
        assert_eq!(values(&text(written)), wanted, "{written:?}");
    }
    let named = text("force (N)\tresponse (V)\n0.5\t-2e-3\n");
    assert_eq!(named.columns[1].name, "response (V)");
}

#[test]
fn missing_entries_are_nan_and_text_is_named_only_where_it_is_wanted() {
    let table = text("t,u,y,remark\n0,1,,ok\n1,NaN,5,\n2,3,6,lost\n");
    assert!(table.columns[2].values[0].is_nan() && table.columns[1].values[1].is_nan());
    assert!(Column::Name("y".to_owned()).of(&table).is_ok());
    let error = Column::Number(4).of(&table).unwrap_err().to_string();
    assert!(error.contains("`ok` in line 2"), "{error}");
    let error = Column::Name("z".to_owned()).of(&table).unwrap_err().to_string();
    assert!(error.contains("1 `t`, 2 `u`, 3 `y`, 4 `remark`"), "{error}");
    assert_eq!(read_text(b"a b\nc d\n", Separator::Auto).unwrap_err(), ColumnError::NoNumbers);
    let broken = read_text(b"1 2\n3 4\nu y\n5 6\n", Separator::Auto).unwrap_err();
    assert!(matches!(broken, ColumnError::TextAmongNumbers { line: 3, rows: 2, .. }), "{broken}");
}

/// A folder of shared data, or `None` with a counted line.
fn shared(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("stand-in: {folder} is not there, written here instead");
    None
}

const LVM: &str = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tNo\n***End_of_Header***\t\n\t\nChannels\t2\n\
    Samples\t2\t2\t\nDelta_X\t3,906250E-5\t3,906250E-5\t\n***End_of_Header***\t\t\t\nX_Value\tExcitation\tResponse\tComment\n\
    \t0,914018\t1,204792\n\t0,537321\t1,208403\n";

#[test]
fn labview_headers_give_names_and_the_sample_interval() {
    let stand_in = text(LVM);
    let mut tables = vec![stand_in];
    if let Some(folder) = shared("loaders/lvm") {
        tables.push(read_text(&std::fs::read(folder.join("short.lvm")).unwrap(), Separator::Auto).unwrap());
        for (name, columns, interval) in [
            ("multi_time_column.lvm", 5, 1.953125e-5),
            ("no_decimal_separator.lvm", 7, 0.00025),
            ("with_empty_fields.lvm", 9, 0.001),
        ] {
            let table = read_text(&std::fs::read(folder.join(name)).unwrap(), Separator::Auto).unwrap();
            assert_eq!((table.columns.len(), table.interval_s), (columns, Some(interval)), "{name}");
        }
        let remarks = read_text(&std::fs::read(folder.join("with_comments.lvm")).unwrap(), Separator::Auto).unwrap();
        assert!(Column::Name("Comment".to_owned()).of(&remarks).is_err());
        assert_eq!(Column::Number(2).of(&remarks).unwrap().values[1], 1.522167);
    }
    for table in &tables {
        assert_eq!(table.interval_s, Some(3.90625e-5));
        assert!(table.columns[2].name.starts_with("Response"));
        assert_eq!(&table.columns[1].values[..2], &[0.914018, 0.537321]);
    }
    assert_eq!(
        read_text(LVM.split("***").next().unwrap().as_bytes(), Separator::Auto),
        Err(ColumnError::EndlessHeader)
    );
}

/// A MATLAB file of one 3 x 2 matrix `x` of doubles and a row vector `v` of int16, in either byte order.
fn mat(big: bool) -> Vec<u8> {
    let word = |value: u32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    let mut file = vec![b' '; 124];
    file.extend(if big { [1, 0] } else { [0, 1] });
    file.extend(if big { *b"MI" } else { *b"IM" });
    let element = |kind: u32, data: &[u8]| {
        let mut bytes = [word(kind), word(data.len() as u32)].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let mut variable = |class: u32, name: &str, sizes: [u32; 2], kind: u32, data: Vec<u8>| {
        let flags = element(6, &[word(class), word(0)].concat());
        let sizes = element(5, &sizes.map(word).concat());
        let body = [flags, sizes, element(1, name.as_bytes()), element(kind, &data)].concat();
        file.extend(element(14, &body));
    };
    let doubles = [1.0_f64, 2.0, 3.0, 10.0, 20.0, 30.0];
    let bytes = |value: &f64| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    variable(6, "x", [3, 2], 9, doubles.iter().flat_map(bytes).collect());
    let shorts = |value: i16| if big { value.to_be_bytes() } else { value.to_le_bytes() };
    variable(10, "v", [1, 3], 3, [-5_i16, 6, 7].into_iter().flat_map(shorts).collect());
    file
}

#[test]
fn matlab_matrices_are_columns_in_either_byte_order() {
    for big in [false, true] {
        let table = read_mat(&mat(big)).unwrap();
        let names: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(names, ["x:1", "x:2", "v"]);
        assert_eq!(values(&table), [[1.0, 2.0, 3.0], [10.0, 20.0, 30.0], [-5.0, 6.0, 7.0]]);
    }
}

#[test]
fn a_matlab_file_cut_anywhere_or_with_any_byte_changed_is_an_error_or_a_table() {
    let whole = mat(false);
    for cut in 0..whole.len() {
        let _ = read_mat(&whole[..cut]);
        let mut spoilt = whole.clone();
        spoilt[cut] ^= 0xff;
        let _ = read_mat(&spoilt);
    }
    assert!(matches!(read_mat(&whole[..200]), Err(ColumnError::Damaged { .. })));
    assert_eq!(read_mat(b"\x89HDF\r\n\x1a\n").unwrap_err(), ColumnError::Hdf5);
    assert_eq!(read_mat(b"short").unwrap_err(), ColumnError::NotMat5);
}

#[test]
fn real_matlab_files_are_read_or_refused_with_a_reason() {
    let Some(folder) = shared("loaders/mat") else { return };
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let read = read_mat(&std::fs::read(&path).unwrap());
        println!(
            "{name}: {}",
            read.as_ref().map_or_else(ToString::to_string, |t| format!("{} columns", t.columns.len()))
        );
        match name.as_str() {
            "little_endian.mat" | "big_endian.mat" | "testmulti_7.4_GLNX86.mat" => assert!(read.is_ok(), "{name}"),
            "testhdf5_7.4_GLNX86.mat" => assert_eq!(read.unwrap_err(), ColumnError::Hdf5),
            "testdouble_4.2c_SOL2.mat" | "testvec_4_GLNX86.mat" => assert_eq!(read.unwrap_err(), ColumnError::NotMat5),
            "corrupted_zlib_data.mat" | "malformed1.mat" => {
                assert!(
                    matches!(read, Err(ColumnError::Damaged { .. } | ColumnError::NoMatrix(_))),
                    "{name}: {read:?}"
                );
            }
            _ => assert!(matches!(read, Err(ColumnError::NoMatrix(_))), "{name}: {read:?}"),
        }
    }
}

fn run(stage: &Columns, folder: &Path) -> Result<(Ports, Vec<String>), afmid_pipeline::StageError> {
    let cx = Context::new(folder, 1, &NoProgress);
    let ports = stage.run(&Ports::new(), &cx)?;
    Ok((ports, cx.into_warnings()))
}

#[test]
fn trends_come_from_the_identification_stretch_alone() {
    let folder = tempfile::tempdir().unwrap();
    // a line of slope 2 in the first stretch, then an unrelated level
    let y = |k: usize| if k < 60 { 7.0 + 2.0 * k as f64 } else { 1000.0 };
    let rows: String = (0..100).map(|k| format!("{} {} {}\n", k % 3, k % 5, y(k))).collect();
    std::fs::write(folder.path().join("a.dat"), rows).unwrap();
    let stage = Columns {
        file: "a.dat".to_owned(),
        inputs: vec![Column::Number(1), Column::Number(2)],
        output: Column::Number(3),
        sample_rate_hz: Some(10.0),
        identification: Some([0, 60]),
        verification: Some([55, 100]),
        remove: Removal::Line,
        ..Columns::default()
    };
    let (ports, warnings) = run(&stage, folder.path()).unwrap();
    let pair = ports.get(&PAIR).unwrap();
    pair.validate().unwrap();
    // rounding of sums of 60 values of 100
    assert!(pair.real("response_identification").unwrap().iter().all(|y| y.abs() < 1e-10));
    let held_out = pair.real("response_verification").unwrap();
    assert!((held_out[44] - (1000.0 - 7.0 - 2.0 * 99.0)).abs() < 1e-10, "{}", held_out[44]);
    assert_eq!(pair.real("force_verification").unwrap().len(), 2 * 45);
    assert_eq!(pair.axis("time_verification").unwrap().values[0], 5.5);
    assert!(warnings[0].contains("share 5 samples"), "{warnings:?}");
    assert!(
        (ports.get(&SUMMARY).unwrap().0["removed"]["output"]["slope_per_s"].as_f64().unwrap() - 20.0).abs() < 1e-10
    );
}

#[test]
fn what_cannot_be_used_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), "t,u,y\n0,1,2\n1,,3\n2,5,6\n3.5,7,8\n").unwrap();
    let stage = |change: fn(&mut Columns)| {
        let mut stage = Columns {
            file: "a.csv".to_owned(),
            inputs: vec![Column::Name("t".to_owned())],
            output: Column::Number(3),
            sample_rate_hz: Some(1.0),
            ..Columns::default()
        };
        change(&mut stage);
        stage
    };
    let error = |stage: &Columns| run(stage, folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(run(&stage(|_| {}), folder.path()).is_ok());
    assert!(error(&stage(|s| s.inputs = vec![Column::Number(2)])).contains("misses sample 1"));
    assert!(error(&stage(|s| s.sample_rate_hz = None)).contains("sample rate is not known"));
    let unequal = |s: &mut Columns| {
        s.sample_rate_hz = None;
        s.time = Some(Column::Number(1));
    };
    assert!(error(&stage(unequal)).contains("not equally spaced"));
    assert!(error(&stage(|s| s.verification = Some([2, 9]))).contains("the record has 4 samples"));
    for wrong in [
        stage(|s| s.file.clear()),
        stage(|s| s.inputs.clear()),
        stage(|s| s.output = Column::Number(0)),
        stage(|s| s.sample_rate_hz = Some(0.0)),
        stage(|s| s.identification = Some([5, 5])),
    ] {
        assert!(afmid_pipeline::stage::check(&wrong).is_err());
    }
    assert!(stage(|s| s.file = "b.csv".to_owned()).sources(folder.path(), &InputFiles::new()).is_err());
}
