//! What tables of text state of time: several clocks, units wherever they stand, stamps, jumps, jitter.

use std::fmt::Write;

use afmid_formats::readers::text_table::TextTable;
use afmid_formats::{Contents, FoundChannel};

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
    // both columns of times stand side by side: statements of one clock, the first of which gives the rate
    assert_eq!(clock(&named, "near").0, Some(1000.0));
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
