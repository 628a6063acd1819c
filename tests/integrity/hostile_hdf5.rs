//! HDF5 files of strangers whose structure does harm: what inflates to much, circles, depth, one object under many
//! names, very many attributes.

use std::fs;
use std::path::Path;
use std::process::Command;

use hdf5::{File, Group};

use super::common::{afmid, command, python_bin};
use super::hostile::{every_command, sealed, unsealed};

/// A file with a small measurement in `/x`, and what else `more` puts there.
fn file(path: &Path, more: impl FnOnce(&File) -> hdf5::Result<()>) {
    let file = File::create(path).expect("a file");
    let samples: Vec<f64> = (0..2000).map(|n| f64::from(n % 7)).collect();
    file.new_dataset_builder().with_data(&samples).create("x").expect("a dataset");
    more(&file).expect("it is written");
}

/// Zeros that take a thousandth of their room, in chunks.
fn zeros(group: &Group, name: &str, samples: usize, chunk: usize) -> hdf5::Result<()> {
    let dataset = group.new_dataset::<i8>().chunk(chunk).deflate(1).shape(samples).create(name)?;
    let block = vec![0_i8; chunk];
    (0..samples).step_by(chunk).try_for_each(|at| dataset.write_slice(&block, at..at + chunk))
}

#[test]
fn hdf5_files_that_inflate_to_much_are_bounded() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path().join("bomb.h5");
    let mib = 1 << 20;
    for (name, count, samples, chunk) in [
        ("one dataset in small chunks", 1, 1024 * mib, 4 * mib),
        ("one dataset of one chunk", 1, 700 * mib, 700 * mib),
        ("many datasets, each within the bounds", 12, 60 * mib, 4 * mib),
    ] {
        println!("{name}");
        file(&here, |file| {
            file.unlink("x")?;
            zeros(file, "x", samples, chunk)?;
            (1..count).try_for_each(|n| zeros(file, &format!("x{n}"), samples, chunk))
        });
        assert!(fs::metadata(&here).expect("a file").len() < 32 << 20);
        every_command(folder.path(), &here);
        fs::remove_file(&here).expect("removed");
    }
}

#[test]
fn hdf5_files_of_odd_structure_are_bounded_and_their_measurement_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path().join("odd.h5");
    type Make = fn(&File) -> hdf5::Result<()>;
    let odd: [(&str, Make); 5] = [
        ("a group that holds itself, twice", |file| {
            let group = file.create_group("circle")?;
            group.link_hard("/circle", "again")?;
            group.link_hard("/", "root")
        }),
        ("groups in groups", |file| {
            let mut group = file.create_group("deep")?;
            for _ in 0..5000 {
                group = group.create_group("g")?;
            }
            Ok(())
        }),
        ("forks: a million million paths to forty groups", |file| {
            file.create_group("fork0")?;
            for n in 1..40 {
                let group = file.create_group(&format!("fork{n}"))?;
                let below = format!("/fork{}", n - 1);
                group.link_hard(&below, "left")?;
                group.link_hard(&below, "right")?;
            }
            Ok(())
        }),
        ("one dataset under very many names", |file| {
            (0..50_000).try_for_each(|n| file.link_hard("/x", &format!("name{n}")))
        }),
        ("very many attributes", |file| {
            let dataset = file.dataset("x")?;
            (0..5000).try_for_each(|n| {
                dataset.new_attr::<f64>().create(format!("a{n}").as_str())?.write_scalar(&f64::from(n))
            })
        }),
    ];
    for (name, make) in odd {
        println!("{name}");
        file(&here, make);
        every_command(folder.path(), &here);
        let output = command(folder.path(), &["inspect", "odd.h5"]).output().expect("afmid starts");
        let shown = String::from_utf8_lossy(&output.stdout).into_owned();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        let refused = output.status.code() == Some(2) && error.contains("odd.h5") && error.contains("help: ");
        assert!((output.status.success() && shown.contains("2000")) || refused, "{name}: {shown}{error}");
        fs::remove_file(&here).expect("removed");
    }
    // what is not odd
    file(&here, |_| Ok(()));
    assert!(afmid(folder.path(), &["inspect", "odd.h5"]).contains("2000"));
}

/// Native records, and files of other programs, whose samples lie in another file.
const ELSEWHERE: &str = r#"
import h5py, numpy as np, os, sys
with h5py.File("source.h5", "w") as file:
    file["x"] = np.arange(2000.0)
np.arange(2000.0).tofile("raw.bin")
os.mkfifo("fifo")
def virtual(file, source):
    layout = h5py.VirtualLayout(shape=(2000,), dtype="f8")
    layout[:] = h5py.VirtualSource(source, "x", shape=(2000,))
    return file.create_virtual_dataset("x", layout)
def external(file, source):
    return file.create_dataset("x", (2000,), dtype="f8", external=[(source, 0, 16000)])
for native in (True, False):
    for name, make in {
        "virtual": lambda file: virtual(file, "source.h5"),
        "virtual_fifo": lambda file: virtual(file, "fifo"),
        "external": lambda file: external(file, "raw.bin"),
        "external_fifo": lambda file: external(file, "fifo"),
        "link": lambda file: file.__setitem__("x", h5py.ExternalLink("source.h5", "/x")),
        "link_fifo": lambda file: file.__setitem__("x", h5py.ExternalLink("fifo", "/x")),
    }.items():
        with h5py.File(f"{'native' if native else 'other'}_{name}.h5", "w") as file:
            made = make(file)
            if native:
                file.attrs["sample_rate_hz"] = 1e6
                if made is not None:
                    made.attrs["units"] = "V"
"#;

#[test]
fn samples_in_other_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let python = python_bin().join("python3");
    let made = Command::new(python).current_dir(here).args(["-c", ELSEWHERE]).status().expect("python3 starts");
    assert!(made.success());
    let mut names: Vec<String> = fs::read_dir(here)
        .expect("a folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.starts_with("native_") || name.starts_with("other_"))
        .collect();
    names.sort();
    assert_eq!(names.len(), 12);
    for name in names {
        let path = here.join(&name);
        every_command(here, &path);
        let output = command(here, &["run", "records.toml", "-o", "a.h5", "--cache", "cache"]).output();
        let output = output.expect("afmid starts");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{name}: {error}");
        assert!(error.contains(&name) && error.contains("help: "), "{name}: {error}");
        assert!(
            name.contains("link") || error.contains("another file") || name.starts_with("other"),
            "{name}: {error}"
        );
        assert!(!here.join("a.h5").exists());
    }
}

/// Puts in the place of a dataset of a result one that leads elsewhere, as anybody who seals it again can.
const LED_ELSEWHERE: &str = r#"
import h5py, numpy as np, sys
with h5py.File("source.h5", "w") as file:
    file["x"] = np.full(2000, 4242.25)
np.full(2000, 4242.25).tofile("raw.bin")
way, path = sys.argv[1:]
with h5py.File(path, "r+") as file:
    found = []
    samples = lambda item: isinstance(item, h5py.Dataset) and item.dtype.kind == "f" and item.ndim == 1
    file.visititems(lambda name, item: found.append(name) if samples(item) and "welch" in name else None)
    name, shape = found[0], file[found[0]].shape
    print("/" + name, shape)
    del file[name]
    if way == "virtual":
        layout = h5py.VirtualLayout(shape=shape, dtype="f8")
        layout[:] = h5py.VirtualSource("source.h5", "x", shape=(2000,))[:shape[0]]
        file.create_virtual_dataset(name, layout)
    elif way == "external":
        file.create_dataset(name, shape, dtype="f8", external=[("raw.bin", 0, 16000)])
    else:
        file[name] = h5py.ExternalLink("source.h5", "/x")
"#;

#[test]
fn sealed_results_lead_to_no_other_file() {
    let folder = super::small::folder(1, 20000);
    let here = folder.path();
    afmid(here, &["run", super::small::CONFIG, "-o", "whole.h5", "--cache", "cache"]);
    let whole = fs::read(here.join("whole.h5")).expect("a result");
    for way in ["virtual", "external", "link"] {
        fs::write(here.join("led.h5"), unsealed(whole.clone())).expect("written");
        let python = python_bin().join("python3");
        let made = Command::new(python).current_dir(here).args(["-c", LED_ELSEWHERE, way, "led.h5"]).status();
        assert!(made.expect("python3 starts").success());
        let bytes = fs::read(here.join("led.h5")).expect("written");
        fs::write(here.join("led.h5"), sealed(bytes)).expect("written");
        every_command(here, &here.join("led.h5"));
        for arguments in [&["show", "led.h5", "welch", "--json"][..], &["diff", "led.h5", "whole.h5"]] {
            let output = command(here, arguments).output().expect("afmid starts");
            let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
            println!("{way} {arguments:?}: {said}");
            assert!(!said.contains("4242"), "{way}, {arguments:?}: {said}");
        }
        let diff = command(here, &["diff", "led.h5", "whole.h5"]).output().expect("afmid starts");
        let said = String::from_utf8_lossy(&diff.stderr).into_owned();
        assert!(diff.status.code() == Some(1) && said.contains("led.h5") && said.contains("density"), "{way}: {said}");
    }
}
