//! What tables of text state of time: several clocks, units wherever they stand, stamps, jumps, jitter.

use std::fmt::Write;

use afmid_formats::readers::matlab::Mat;
use afmid_formats::readers::numpy::Npz;
use afmid_formats::readers::text_table::TextTable;
use afmid_formats::{Contents, FoundChannel, is_fact};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::mat_builder::Order;
use super::support::open;

fn table(header: &str, rows: usize, row: impl Fn(usize) -> String) -> Contents {
    let mut text = format!("{header}\n");
    for k in 0..rows {
        let _ = writeln!(text, "{}", row(k));
    }
    open::<TextTable>("table.csv", text.as_bytes()).unwrap()
}

fn of<'a>(contents: &'a Contents, name: &str) -> &'a FoundChannel {
    let named = contents.channels.iter().find(|channel| channel.location == name);
    named.unwrap_or_else(|| panic!("no {name} in {contents:?}"))
}

/// Rate and start of a channel.
fn clock(contents: &Contents, name: &str) -> (Option<f64>, Option<f64>) {
    (of(contents, name).sample_rate_hz, of(contents, name).start_s)
}

fn said<'a>(contents: &'a Contents, words: &str) -> &'a str {
    let found = contents.remarks.iter().find(|remark| remark.contains(words));
    found.unwrap_or_else(|| panic!("nothing of «{words}» in {:?}", contents.remarks))
}

/// A value that is no clock.
fn y(k: usize) -> f64 {
    (k as f64 * 0.7).sin()
}

#[test]
fn each_column_of_times_has_its_columns() {
    // side by side, the times of each in front of it
    let pairs = table("t1 (ms),a (V),t2 (ms),b (V)", 50, |k| format!("{},{},{},{}", 2 * k, y(k), 5 * k + 3, y(k)));
    assert_eq!((clock(&pairs, "a"), clock(&pairs, "b")), ((Some(500.0), Some(0.0)), (Some(200.0), Some(0.003))));
    // all times first: the names say whose they are
    let named = table("Time near (s);Time far (s);near (g);far (g)", 50, |k| {
        format!("{:.3};{:.3};{:.4};{:.4}", k as f64 * 1e-3, k as f64 * 4e-3, y(k), y(k))
    });
    assert_eq!((clock(&named, "near").0, clock(&named, "far").0), (Some(1000.0), Some(250.0)));
    // values between the clocks, two of them on the second
    let three = table("time (s),u (V),time (s),x (V),y (V)", 50, |k| {
        format!("{:.3},{:.4},{:.3},{:.4},{:.4}", k as f64 * 5e-3, y(k), k as f64 * 2e-3, y(k), y(k + 1))
    });
    assert_eq!(
        (clock(&three, "u").0, clock(&three, "x").0, clock(&three, "y").0),
        (Some(200.0), Some(500.0), Some(500.0))
    );
    // the columns of an oscilloscope share their times
    let copies = table("Time (s),C1 (V),Time (s),C2 (V)", 50, |k| {
        format!("{:.3},{:.4},{:.3},{:.4}", k as f64 * 1e-3, y(k), k as f64 * 1e-3, y(k))
    });
    assert_eq!((clock(&copies, "C1"), clock(&copies, "C2")), ((Some(1000.0), Some(0.0)), (Some(1000.0), Some(0.0))));
}

#[test]
fn the_unit_of_times_and_rates_is_read_wherever_it_stands() {
    for header in ["Time (ms),y", "time_ms,y", "t/ms,y", "t [ms],y", "time,y\n[ms],[V]", "millis,y"] {
        let found = table(header, 50, |k| format!("{:.1},{}", 0.5 * k as f64, y(k)));
        assert_eq!(clock(&found, "y").0, Some(2000.0), "{header}: {:?}", found.remarks);
        assert!(!of(&found, "y").rate_is_guess, "{header}");
    }
    for header in
        ["# fs: 2 kHz\ny,z", "# dt: 0.5 ms\ny,z", "Sample Interval,500 us\ny,z", "# Sampling Rate (kHz): 2\ny,z"]
    {
        let found = table(header, 50, |k| format!("{},{}", y(k), y(k + 3)));
        assert_eq!(clock(&found, "y").0, Some(2000.0), "{header}: {:?}", found.remarks);
    }
    let guessed = table("time,y", 50, |k| format!("{:.4},{}", 5e-4 * k as f64, y(k)));
    assert!(of(&guessed, "y").rate_is_guess && clock(&guessed, "y").0 == Some(2000.0));
    said(&guessed, "(no unit: taken as seconds)");
}

#[test]
fn whole_numbers_epochs_and_days_give_no_rate() {
    for (first, step) in [("0", 1_u64), ("53124", 10), ("1622690466000", 5), ("1622690466000000000", 10_000_000)] {
        let first: u64 = first.parse().unwrap();
        let found = table("TIME, X", 50, |k| format!("{},{:.4}", first + step * k as u64, y(k)));
        assert_eq!(clock(&found, "X").0, None, "{first}: {:?}", found.remarks);
        said(&found, "it gives no sample rate");
        assert!(of(&found, "TIME").is_axis);
    }
    let days = table("time,x", 50, |k| format!("{:.9},{:.4}", 738_000.25 + k as f64 / 86_400e1, y(k)));
    assert_eq!(clock(&days, "x").0, None);
    // what stands beside them says it
    let phone = table("time,seconds_elapsed,x", 50, |k| {
        format!("{},{:.3},{:.4}", 1_622_690_466_000_000_000_u64 + 10_000_000 * k as u64, 0.01 * k as f64, y(k))
    });
    assert_eq!((clock(&phone, "x").0, of(&phone, "x").rate_is_guess), (Some(100.0), false));
}

#[test]
fn what_has_a_unit_of_time_is_a_clock_only_in_front_of_others_and_beside_times() {
    let lag = table("a (V),b (V),lag (s)", 50, |k| format!("{:.4},{:.4},{}", y(k), y(k + 2), 3 * k + 5));
    assert_eq!((clock(&lag, "a").0, clock(&lag, "b").0), (None, None), "{:?}", lag.remarks);
    let second = table("X (ms),a (V),Y (ms),b (V)", 50, |k| format!("{},{:.4},{},{:.4}", k, y(k), 4 * k, y(k)));
    assert_eq!((clock(&second, "a").0, clock(&second, "b").0), (Some(1000.0), Some(250.0)), "{:?}", second.remarks);
    let header = "# Sampling frequency [Hz]: 500\nTime (s),y (V)";
    let contradicted = table(header, 50, |k| format!("{:.3},{:.4}", 1e-3 * k as f64, y(k)));
    assert_eq!(clock(&contradicted, "y").0, None, "{:?}", contradicted.remarks);
}

#[test]
fn times_that_jump_are_gaps_and_times_that_wander_are_refused_with_the_place() {
    type Jump = (&'static str, fn(usize) -> f64, &'static [usize]);
    let jumps: [Jump; 4] = [
        ("a pause", |k| k as f64 + if k >= 100 { 37.5 } else { 0.0 }, &[100]),
        ("lost samples", |k| k as f64 + if k >= 100 { 4.0 } else { 0.0 }, &[100]),
        ("several", |k| k as f64 + 20.5 * (k / 80) as f64, &[80, 160, 240]),
        ("begun again", |k| (k % 150) as f64, &[150]),
    ];
    for (what, time, gaps) in jumps {
        let found = table("Time (s),y", 300, |k| format!("{:.5},{:.4}", 1e-3 * time(k), y(k)));
        assert_eq!(
            (clock(&found, "y").0, &of(&found, "y").gaps[..]),
            (Some(1000.0), gaps),
            "{what}: {:?}",
            found.remarks
        );
        assert!(said(&found, "a gap").contains(&format!("row {}", gaps[0])), "{what}");
    }
    let jitter =
        table("Time (s),y", 300, |k| format!("{:.7},{:.4}", 1e-3 * (k as f64 + 5e-3 * (k as f64 * 2.1).sin()), y(k)));
    let channel = of(&jitter, "y");
    assert!((channel.sample_rate_hz.unwrap() / 1000.0 - 1.0).abs() < 4.0 * channel.rate_relative_std.max(1e-5));
    assert!(channel.rate_relative_std > 0.0 && channel.gaps.is_empty());
    let wanders =
        table("Time (s),y", 300, |k| format!("{:.7},{:.4}", 1e-3 * (k as f64 + 2.0 * (k as f64 * 0.02).sin()), y(k)));
    assert_eq!(clock(&wanders, "y").0, None);
    assert!(said(&wanders, "furthest from the even grid").contains("row"), "{:?}", wanders.remarks);
}

/// A field of a struct: its name and array.
fn field(name: &str, numbers: &[f64]) -> (String, Vec<u8>) {
    let order = Order(false);
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    (name.to_owned(), order.array(6, &[numbers.len() as u32, 1], "", &order.element(9, &bytes)))
}

fn text_field(name: &str, text: &str) -> (String, Vec<u8>) {
    let order = Order(false);
    (name.to_owned(), order.array(4, &[1, text.len() as u32], "", &order.element(16, text.as_bytes())))
}

/// Names and bytes of a struct's fields.
type Fields = Vec<(String, Vec<u8>)>;

/// A file of structs.
fn structs(all: &[(&str, Fields)]) -> Contents {
    let order = Order(false);
    let mut bytes = order.header();
    for (name, fields) in all {
        let mut names = Vec::new();
        for (name, _) in fields {
            names.extend(name.bytes());
            names.resize(names.len().next_multiple_of(16), 0);
        }
        let mut inside = [order.element(5, &order.word(16)), order.element(1, &names)].concat();
        fields.iter().for_each(|(_, array)| inside.extend(array));
        bytes.extend(order.array(2, &[1, 1], name, &inside));
    }
    open::<Mat>("structs.mat", &bytes).unwrap()
}

fn values(count: usize) -> Vec<f64> {
    (0..count).map(y).collect()
}

#[test]
fn structs_state_when_their_channels_begin() {
    for (name, late, start) in [
        ("t0", 0.003, 0.003),
        ("t_start", 0.003, 0.003),
        ("start_time", 0.003, 0.003),
        ("start", 0.003, 0.003),
        ("t0_ms", 3.0, 0.003),
        ("Tstart", 0.003, 0.003),
    ] {
        for (rate, value) in [("fs", 1e4), ("dt", 1e-4)] {
            let one = |value_of: f64| vec![field("y", &values(50)), field(rate, &[value]), field(name, &[value_of])];
            let found = structs(&[("A", one(0.0)), ("B", one(late))]);
            assert_eq!(clock(&found, "/A.y"), (Some(1e4), Some(0.0)), "{name} {:?}", found.remarks);
            assert_eq!(clock(&found, "/B.y"), (Some(1e4), Some(start)), "{name} {:?}", found.remarks);
        }
    }
    // the number of a sample, a temperature
    let other = structs(&[("A", vec![field("y", &values(50)), field("start", &[120.0]), field("T0", &[293.0])])]);
    assert_eq!(clock(&other, "/A.y"), (None, None));
    let two = [field("fs", &[1e4]), field("t0", &[0.1]), field("start_time", &[0.2]), field("y", &values(50))];
    let two = structs(&[("A", two.to_vec())]);
    assert_eq!(clock(&two, "/A.y"), (Some(1e4), None));
    assert!(!is_fact(said(&two, "it is not known when")));
    let unit = [field("fs", &[1e4]), field("t0", &[3.0]), text_field("t0_units", "ms"), field("y", &values(50))];
    assert_eq!(clock(&structs(&[("A", unit.to_vec())]), "/A.y"), (Some(1e4), Some(3.0 * 1e-3)));
}

#[test]
fn starts_beside_times_hold_only_where_both_tell_the_same() {
    let times: Vec<f64> = (0..50).map(|k| 1e-4 * f64::from(k)).collect();
    let of = |t0: f64| vec![field("t", &times), field("y", &values(50)), field("t0", &[t0])];
    let apart = structs(&[("A", of(0.0)), ("B", of(0.003))]);
    assert_eq!((clock(&apart, "/A.y"), clock(&apart, "/B.y")), ((Some(1e4), None), (Some(1e4), None)));
    assert!(!is_fact(said(&apart, "its times begin at 0 s, a number beside it says 0.003 s")));
    // one clock counts from 1970, the other from the trigger
    let absolute = structs(&[("A", of(1.6e9)), ("B", of(1.6e9))]);
    assert_eq!((clock(&absolute, "/A.y").1, clock(&absolute, "/B.y").1), (Some(0.0), Some(0.0)));
}

#[test]
fn statements_that_contradict_one_another_give_no_rate_and_name_both() {
    for header in ["# Rate: 10 ms", "# Sample interval: 10 ms", "Sample interval,10,ms", "# Sampling: 100 Hz"] {
        let found = table(&format!("{header}\nTime (s),y (V)"), 50, |k| format!("{:.4},{:.4}", 1e-4 * k as f64, y(k)));
        assert_eq!(clock(&found, "y").0, None, "{header} {:?}", found.remarks);
        let said = said(&found, "no sample rate");
        assert!(said.contains("steps by 0.0001 s") && said.contains("10"), "{said}");
        assert!(found.why_no_rate("y").is_some());
    }
    for header in ["# Rate: 0.1 ms", "# Sample interval: 100 us", "# Sampling: 10 kHz"] {
        let found = table(&format!("{header}\nTime (s),y (V)"), 50, |k| format!("{:.4},{:.4}", 1e-4 * k as f64, y(k)));
        assert_eq!(clock(&found, "y").0, Some(1e4), "{header} {:?}", found.remarks);
    }
    // a rate of something else
    let other = table("# Rate: 5 mm\nTime (s),y (V)", 50, |k| format!("{:.4},{:.4}", 1e-4 * k as f64, y(k)));
    assert_eq!(clock(&other, "y").0, Some(1e4), "{:?}", other.remarks);
    let row = |k: usize, ms: f64| format!("{:.4},{:.4},{:.4}", 1e-4 * k as f64, ms * k as f64, y(k));
    let beside = table("Time (s),Time (ms),y (V)", 50, |k| row(k, 0.2));
    assert_eq!(clock(&beside, "y").0, None, "{:?}", beside.remarks);
    let said = said(&beside, "no sample rate");
    assert!(said.contains("10000") && said.contains("5000"), "{said}");
    let agree = table("Time (s),Time (ms),y (V)", 50, |k| row(k, 0.1));
    assert_eq!(clock(&agree, "y").0, Some(1e4), "{:?}", agree.remarks);
    let times = |step: f64| -> Vec<f64> { (0..50).map(|k| step * f64::from(k)).collect() };
    for (step_ms, rate) in [(0.1, Some(1e4)), (0.2, None)] {
        let fields = vec![field("t_s", &times(1e-4)), field("t_ms", &times(step_ms)), field("y", &values(50))];
        assert_eq!(clock(&structs(&[("A", fields)]), "/A.y").0, rate);
    }
}

#[test]
fn intervals_and_rates_without_a_unit_are_guesses_or_counts() {
    let of = |header: &str| table(&format!("{header}\ny (V),z (V)"), 50, |k| format!("{:.4},{:.4}", y(k), y(k + 3)));
    for (header, rate, guess) in [
        ("# Sample period: 0.1", Some(10.0), true),
        ("# Sampling rate: 10", Some(10.0), true),
        ("# fs: 10", Some(10.0), false),
        ("# dt = 0.1", Some(10.0), false),
        ("XIncrement,0.1", Some(10.0), false),
        ("# Sample period: 100", None, false),
        ("# dt: 100", None, false),
        ("# Sample period: 100\n# Unit: us", Some(1e4), false),
        ("# Sample period (us): 100", Some(1e4), false),
        ("Sample period,100,us", Some(1e4), false),
        ("Sample period,100\nUnit,us", Some(1e4), false),
        ("Sample period,100\nSample period unit,us", Some(1e4), false),
        ("Sample interval,100\nHorizontal units,us", Some(1e4), false),
        ("# Sampling rate: 10\n# Unit: kHz", Some(1e4), false),
    ] {
        let found = of(header);
        assert_eq!((clock(&found, "y").0, of_guess(&found)), (rate, guess), "{header}: {:?}", found.remarks);
        let taken = found.remarks.iter().any(|remark| remark.contains("(no unit: taken as") && !is_fact(remark));
        assert_eq!(taken, guess, "{header}: {:?}", found.remarks);
        assert_eq!(found.why_no_rate("y").is_some(), rate.is_none(), "{header}: {:?}", found.remarks);
    }
    for (name, value, rate) in
        [("fs", 10.0, Some(10.0)), ("dt", 0.1, Some(10.0)), ("dt", 100.0, None), ("dt_us", 100.0, Some(1e4))]
    {
        let found = structs(&[("A", vec![field("y", &values(50)), field(name, &[value])])]);
        assert_eq!(clock(&found, "/A.y").0, rate, "{name} {:?}", found.remarks);
        assert_eq!(found.why_no_rate("/A.y").is_some(), rate.is_none());
    }
}

fn of_guess(contents: &Contents) -> bool {
    of(contents, "y").rate_is_guess
}

#[test]
fn a_statement_without_a_unit_has_that_of_the_one_that_it_agrees_with() {
    let of = |header: &str, step: f64| table(header, 50, |k| format!("{:.4},{:.4}", step * k as f64, y(k)));
    for (header, step) in [
        // the rate proves the unit of the times
        ("# fs: 10 kHz\nTime,y (V)", 0.1),
        ("# fs: 10 kHz\nTime,y (V)", 100.0),
        // the times prove that of the interval, of the rate
        ("# Sample period: 100\nTime (s),y (V)", 1e-4),
        ("# Sample period: 0.1\nTime (s),y (V)", 1e-4),
        ("# Sampling rate: 10\nTime (ms),y (V)", 0.1),
    ] {
        let found = of(header, step);
        let channel = self::of(&found, "y");
        let rate = channel.sample_rate_hz.unwrap_or_default();
        assert!((rate / 1e4 - 1.0).abs() < 1e-9 && !channel.rate_is_guess, "{header}: {:?}", found.remarks);
    }
    let refused = of("# Sample period: 100\nTime,y (V)", 0.1);
    assert_eq!(clock(&refused, "y").0, None, "{:?}", refused.remarks);
}

#[test]
fn seconds_since_1970_in_four_digits_have_the_round_rate() {
    for (rows, digits) in [(50, 4), (300, 4), (5000, 4), (300, 6)] {
        let found =
            table("Time (s),y", rows, |k| format!("{:.digits$},{:.4}", 1_622_690_466.0 + 1e-4 * k as f64, y(k)));
        assert_eq!(clock(&found, "y").0, Some(1e4), "{rows} {digits} {:?}", found.remarks);
    }
    let times: Vec<f64> = (0..300).map(|k| 1_622_690_466.25 + 1e-4 * f64::from(k)).collect();
    let found = structs(&[("A", vec![field("t", &times), field("y", &values(300))])]);
    assert_eq!(clock(&found, "/A.y").0, Some(1e4), "{:?}", found.remarks);
}

#[test]
fn what_is_stated_is_not_asked_for() {
    let stroke = table("t/ms,a/V,b/g", 50, |k| format!("{:.1},{:.4},{:.4}", 0.1 * k as f64, y(k), y(k + 5)));
    assert_eq!((clock(&stroke, "a").0, of(&stroke, "a").unit.as_str()), (Some(1e4), "V"), "{:?}", stroke.remarks);
    let index = table("Increment,1e-4\nIndex,a (V)", 50, |k| format!("{k},{:.4}", y(k)));
    assert_eq!(clock(&index, "a").0, Some(1e4), "{:?}", index.remarks);
    assert_eq!(index.channels.len(), 1, "{:?}", index.channels);
    let slow = table("# Sampling rate: 30 samples/min\na (V),b (V)", 50, |k| format!("{:.4},{:.4}", y(k), y(k + 5)));
    assert_eq!(clock(&slow, "a").0, Some(0.5), "{:?}", slow.remarks);
    let rates = |fields: Vec<(String, Vec<u8>)>| {
        let found = structs(&[("A", [fields, vec![field("y", &values(50)), field("z", &values(50))]].concat())]);
        (clock(&found, "/A.y").0, found.remarks)
    };
    let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
    for fields in [
        vec![text_field("fs", "10 kHz")],
        vec![field("fs", &[1e4, 1e4])],
        vec![field("dt", &[0.1]), text_field("dt_unit", "ms")],
        vec![field("t", &times), text_field("t_unit", "1e-3 s")],
        vec![field("t", &times), field("fs", &[1e4])],
    ] {
        let (rate, remarks) = rates(fields);
        assert_eq!(rate, Some(1e4), "{remarks:?}");
    }
    assert_eq!(rates(vec![field("fs", &[1e4, 2e4])]).0, None);
    let other = rates(vec![field("t", &times), field("fs", &[3e4])]);
    assert!(other.0.is_none() && other.1.iter().any(|remark| remark.contains("no sample rate")), "{other:?}");
}

/// An NPZ archive of these members: name, type, number of elements if it is no single one, bytes.
fn npz(members: &[(&str, &str, Option<usize>, Vec<u8>)]) -> Contents {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, descr, count, data) in members {
        archive.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        let shape = count.map_or_else(String::new, |count| format!("{count},"));
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        std::io::Write::write_all(&mut archive, &bytes).unwrap();
    }
    open::<Npz>("arrays.npz", &archive.finish().unwrap().into_inner()).unwrap()
}

fn floats(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

#[test]
fn texts_and_moments_of_numpy_state_units_and_times() {
    let wide = |text: &str| -> Vec<u8> { text.chars().flat_map(|c| (c as u32).to_le_bytes()).collect() };
    let signal = ("y", "<f8", Some(50), floats((0..50).map(y)));
    for name in ["t_unit", "t_units", "time_unit"] {
        let times = ("t", "<f8", Some(50), floats((0..50).map(|k| 0.1 * f64::from(k))));
        for unit in
            [(name, "<U2", None, wide("ms")), (name, "|S2", None, b"ms".to_vec()), (name, "<U2", Some(1), wide("ms"))]
        {
            let found = npz(&[times.clone(), signal.clone(), unit]);
            assert_eq!(clock(&found, "/y").0, Some(1e4), "{name} {:?}", found.remarks);
            assert!(!of(&found, "/y").rate_is_guess);
        }
    }
    let rate =
        npz(&[signal.clone(), ("fs", "<f8", None, floats([10.0].into_iter())), ("fs_unit", "<U3", None, wide("kHz"))]);
    assert_eq!(clock(&rate, "/y").0, Some(1e4), "{:?}", rate.remarks);
    let as_text = npz(&[signal.clone(), ("fs", "<U6", None, wide("10 kHz"))]);
    assert_eq!(clock(&as_text, "/y").0, Some(1e4), "{:?}", as_text.remarks);
    let unit = npz(&[signal.clone(), ("y_unit", "<U1", None, wide("g"))]);
    assert_eq!(of(&unit, "/y").unit, "g");
    for (descr, first, step) in [
        ("<M8[us]", 1_622_690_466_000_000_i64, 100),
        ("<M8[ns]", 1_622_690_466_000_000_000, 100_000),
        ("<m8[us]", 0, 100),
    ] {
        for name in ["t", "moments"] {
            let data = (0..50).flat_map(|k| (first + step * k).to_le_bytes()).collect();
            let found = npz(&[(name, descr, Some(50), data), signal.clone()]);
            let rate = clock(&found, "/y").0.unwrap_or_default();
            assert!((rate / 1e4 - 1.0).abs() < 1e-9, "{descr} {rate} {:?}", found.remarks);
            assert!(!of(&found, "/y").rate_is_guess);
        }
    }
}
