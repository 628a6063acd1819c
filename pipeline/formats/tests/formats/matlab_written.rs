//! Files that scipy 1.17.1 wrote (tests/make_mat.py) and reads back with the numbers given here.

use crate::support::{channel, locations, remarked, samples, written};
use afmid_formats::Format;
use afmid_formats::readers::matlab::Mat;

#[test]
fn picoscope_exports_have_their_rate_from_tinterval() {
    for name in ["pico_v4.mat", "pico_v6.mat", "pico_v7.mat"] {
        let contents = Mat::open(&written(name)).unwrap();
        assert_eq!(locations(&contents), ["/A", "/B"], "{name}");
        let a = channel(&contents, "/A");
        assert_eq!((a.samples, a.stored_as), (400, "float32"));
        // 1 / 4e-7, the nearest double.
        assert_eq!(a.sample_rate_hz, Some(2.5e6), "{:?}", contents.remarks);
        assert!(remarked(&contents, "taken from /Tinterval = 0.0000004"), "{:?}", contents.remarks);
        assert!(remarked(&contents, "/Length is the single number 400"));
        assert_eq!(remarked(&contents, "/Version is the text \"2.3.1\""), name != "pico_v4.mat");
        let samples_a = samples(a);
        // float(loadmat(f)['A'].astype('f8').sum()), [3, 0] and ['B'][399, 0]; the sum in another order: 400 roundings
        // of 1e-16.
        assert!((samples_a.iter().sum::<f64>() - 0.917822778574191).abs() < 1e-12);
        assert_eq!(samples_a[3], 0.4155718684196472);
        assert_eq!(samples(channel(&contents, "/B"))[399], 1.308494210243225);
    }
}

#[test]
fn everything_nested_is_found() {
    for name in ["nested_v6.mat", "nested_v7.mat"] {
        let contents = Mat::open(&written(name)).unwrap();
        let mut wanted =
            vec!["/s(1).x", "/s(2).x", "/c{1}", "/c{2}.deep.y", "/rec.z", "/two.w", "/wide[1]", "/wide[2]", "/on"];
        let cube: Vec<String> = (0..12).map(|n| format!("/cube[{},{}]", n % 3 + 1, n / 3 + 1)).collect();
        wanted.extend(cube.iter().map(String::as_str));
        assert_eq!(locations(&contents), wanted, "{name}");
        let is = |location: &str, first: f64, step: f64, count: usize, rate: Option<f64>| {
            let channel = channel(&contents, location);
            let ramp: Vec<f64> = (0..count).map(|n| first + step * n as f64).collect();
            assert_eq!(samples(channel), ramp, "{location}");
            assert_eq!(channel.sample_rate_hz.map(f64::round), rate, "{location}");
        };
        is("/s(1).x", 0.0, 1.0, 40, None);
        is("/s(2).x", 0.0, 3.0, 40, None);
        is("/c{1}", 0.0, 1.0, 20, None);
        is("/c{2}.deep.y", 0.0, 1.0, 30, Some(1e6));
        is("/rec.z", 0.0, 1.0, 50, Some(1e5));
        is("/two.w", 0.0, 1.0, 25, None);
        is("/wide[2]", 60.0, 1.0, 60, None);
        // n['cube'][0, j, k] = 4 j + k, [1, j, k] is 12 more
        is("/cube[2,3]", 6.0, 12.0, 2, None);
        assert_eq!(channel(&contents, "/c{2}.deep.y").stored_as, "int64");
        for text in [
            "disagree: /two.fs = 100, /two.dt = 1",
            "/s(1).unit is the text \"nm\"",
            "/rec.note is a text of 100 characters",
            "/lines is a text of 4 characters",
            "/none is an empty array",
            "/wide: its 2 rows, not its 60 columns",
            "/c{2}.deep.y: 64-bit integers",
        ] {
            assert!(remarked(&contents, text), "{text}: {:?}", contents.remarks);
        }
    }
}
