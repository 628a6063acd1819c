//! Files that NumPy 2.4.6 wrote (tests/make_npy.py, where the numbers are).

use crate::support::{channel, locations, remarked, samples, written};
use afmid_formats::readers::numpy::{Npy, Npz};
use afmid_formats::{Contents, Format};

fn npy(name: &str) -> Contents {
    let path = written(name);
    assert!(Npy::recognises(&std::fs::read(&path).unwrap(), &path));
    Npy::open(&path).unwrap()
}

#[test]
fn every_type_in_both_byte_orders() {
    let types = [
        ("i1", "int8", -3.0),
        ("i2", "int16", -3.0),
        ("i4", "int32", -3.0),
        ("i8", "int64", -3.0),
        ("u1", "uint8", 3.0),
        ("u2", "uint16", 3.0),
        ("u4", "uint32", 3.0),
        ("u8", "uint64", 3.0),
        ("f4", "float32", 0.37),
        ("f8", "float64", 0.37),
    ];
    for (code, stored_as, slope) in types {
        for order in ["little", "big"] {
            let contents = npy(&format!("{order}_{code}.npy"));
            assert_eq!((locations(&contents), contents.format.as_str()), (vec!["/array"], "NumPy NPY 1.0"));
            assert_eq!(contents.channels[0].stored_as, stored_as);
            let wanted = (0..40).map(|n| {
                let value = slope * f64::from(n);
                if code == "f4" { f64::from(value as f32) } else { value }
            });
            assert_eq!(samples(&contents.channels[0]), wanted.collect::<Vec<f64>>(), "{order} {code}");
        }
    }
}

#[test]
fn columns_in_both_memory_orders() {
    for name in ["c_order.npy", "fortran_order.npy"] {
        let contents = npy(name);
        assert_eq!(locations(&contents), ["/array[0]", "/array[1]", "/array[2]"], "{name}");
        for (column, channel) in contents.channels.iter().enumerate() {
            let wanted = (0..40).map(|row| f64::from(3 * row + column as i32).powi(2));
            assert_eq!(samples(channel), wanted.collect::<Vec<f64>>(), "{name} {column}");
        }
        assert!(remarked(&contents, "does not say which axis is time"));
    }
}

#[test]
fn wide_arrays_and_more_axes() {
    let wide = npy("wide.npy");
    assert_eq!(locations(&wide), ["/array[0]", "/array[1]"]);
    assert_eq!(samples(&wide.channels[1]), (40..80).map(f64::from).collect::<Vec<f64>>());
    let cube = npy("cube.npy");
    // np.arange(24).reshape(4, 3, 2)[:, 2, 1]
    assert_eq!(samples(channel(&cube, "/array[2,1]")), [5.0, 11.0, 17.0, 23.0]);
    assert_eq!(cube.channels.len(), 6);
}

#[test]
fn versions_booleans_scalars_and_empty_arrays() {
    for major in 1..=3 {
        let contents = npy(&format!("version{major}.npy"));
        assert_eq!(contents.format, format!("NumPy NPY {major}.0"));
        assert_eq!(samples(&contents.channels[0]), (-20..20).map(f64::from).collect::<Vec<f64>>());
    }
    let truth = npy("bool.npy");
    assert_eq!(samples(&truth.channels[0]).iter().sum::<f64>(), 16.0);
    assert!(remarked(&npy("scalar.npy"), "/array is the single number 2.5"));
    assert!(remarked(&npy("empty.npy"), "/array is an empty array"));
}

#[test]
fn every_numeric_field_is_a_channel() {
    let contents = npy("fields.npy");
    assert_eq!(locations(&contents), ["/array.code", "/array.xy[0]", "/array.xy[1]", "/array.in.z"]);
    let is = |location: &str, first: f64, step: f64| {
        let wanted: Vec<f64> = (0..40).map(|n| first + step * f64::from(n)).collect();
        assert_eq!(samples(channel(&contents, location)), wanted, "{location}");
    };
    // the times are the rate of the others
    assert!(contents.channels.iter().all(|channel| channel.sample_rate_hz == Some(1000.0)));
    is("/array.code", 0.0, 1.0);
    is("/array.xy[0]", -40.0, 2.0);
    is("/array.xy[1]", -39.0, 2.0);
    is("/array.in.z", 0.0, 0.125);
    assert!(remarked(&contents, "/array.name holds byte strings of 3"));
}

#[test]
fn half_precision_is_exact_in_both_byte_orders() {
    let half = npy("half.npy");
    assert_eq!(samples(&half.channels[0]), (-20..20).map(f64::from).collect::<Vec<f64>>());
    let big = npy("big_half.npy");
    assert_eq!(big.channels[0].stored_as, "float16");
    // np.float16(0.37 * n) for n = 1, 2, 39
    let found = samples(&big.channels[0]);
    assert_eq!([found[1], found[2], found[39]], [0.370_117_187_5, 0.740_234_375, 14.429_687_5]);
}

#[test]
fn what_is_no_channel_is_refused() {
    let cases = [
        ("quadruple", "128-bit floating"),
        ("complex", "complex"),
        ("text", "texts of 2"),
        ("objects", "Python objects"),
        ("dates", "dates"),
    ];
    for (name, problem) in cases {
        let error = Npy::open(&written(&format!("{name}.npy"))).unwrap_err();
        assert!(error.problem.contains(problem) && error.help.is_some(), "{name}: {error:?}");
    }
}

#[test]
fn archives_stored_and_deflated() {
    for name in ["stored.npz", "deflated.npz"] {
        let path = written(name);
        assert!(Npz::recognises(&std::fs::read(&path).unwrap(), &path));
        let contents = Npz::open(&path).unwrap();
        assert_eq!(locations(&contents), ["/deflection", "/codes[0]", "/codes[1]"], "{name}");
        for channel in &contents.channels {
            assert_eq!((channel.samples, channel.sample_rate_hz), (500, Some(2.5e6)));
        }
        let deflection = samples(&contents.channels[0]);
        // float(z['deflection'].sum()), [499]; 500 roundings of 1e-16 in another order of summation.
        assert!((deflection.iter().sum::<f64>() - 4.499893124478255).abs() < 1e-12);
        assert_eq!(deflection[499], -0.8931150880476102);
        let codes = (0..500).map(|n| f64::from((2 * n + 1) * 7));
        assert_eq!(samples(&contents.channels[2]), codes.collect::<Vec<f64>>());
        for text in ["/fs = 2500000", "/label is the text \"nm\"", "/spectrum is complex"] {
            assert!(remarked(&contents, text), "{text}: {:?}", contents.remarks);
        }
    }
}

#[test]
fn an_object_does_not_take_the_other_arrays_with_it() {
    for (name, rate) in [("objects.npz", Some(1e4)), ("object_stored.npz", None)] {
        let contents = Npz::open(&written(name)).unwrap();
        let y = channel(&contents, "/y");
        assert_eq!(samples(y), (-20..20).map(|n| f64::from(n) / 8.0).collect::<Vec<f64>>(), "{name}");
        assert_eq!(y.sample_rate_hz, rate, "{name}");
        assert!(remarked(&contents, "/notes holds Python objects, pickled, no channel"), "{:?}", contents.remarks);
    }
    let contents = Npz::open(&written("objects.npz")).unwrap();
    assert_eq!(locations(&contents), ["/y", "/long"]);
    assert_eq!(channel(&contents, "/long").sample_rate_hz, None);
}
