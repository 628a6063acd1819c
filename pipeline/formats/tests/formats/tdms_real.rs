//! Real TDMS files against npTDMS 1.13.0: `TdmsFile.read(path)`, then per channel `len(c)`,
//! `float(np.sum(c[:], dtype=float))`, `c[0]`, `c[1]`, `c[len // 2]`, `c[-1]` and `c.properties`.

use crate::support::{assert_sum, channel, locations, real, values};
use afmid_formats::readers::tdms::Tdms;
use afmid_formats::{Contents, Format, Raw};

fn opened(name: &str) -> Option<Contents> {
    real(&format!("tdms/{name}")).map(|path| Tdms::open(&path).unwrap())
}

/// Number of samples, sum and the values at 0, 1, the middle and the end.
fn check(contents: &Contents, location: &str, samples: usize, sum: f64, at: [f64; 4]) {
    let found = values(channel(contents, location));
    assert_eq!(found.len(), samples);
    assert_sum(&found, sum);
    assert_eq!([found[0], found[1], found[samples / 2], found[samples - 1]], at, "{location}");
}

#[test]
fn big_endian_segments_of_labview() {
    let Some(found) = opened("big_endian.tdms") else { return };
    assert_eq!(found.format, "NI TDMS 2.0 (4713), big-endian");
    // wf_start_time is 1904 (relative); NI_ExpStartTimeStamp of the first channel is 2018-11-13T23:04:49.403585.
    assert_eq!(found.started_at, "2018-11-13T23:04:49.403585434Z");
    assert_eq!(locations(&found), ["/Measured Data/Amplitude sweep", "/Measured Data/Phase sweep"]);
    let at = [0.0, 0.0, -2.6730195725650843, 5.067986572324634];
    check(&found, "/Measured Data/Amplitude sweep", 3500, 92.4168263064218, at);
    let at = [0.0, 0.0634175857813252, -0.8910065241883611, 0.8446644287207723];
    check(&found, "/Measured Data/Phase sweep", 3500, 24.607279472921544, at);
    for c in &found.channels {
        assert_eq!((c.sample_rate_hz, c.unit.as_str(), c.long_name.as_str()), (Some(1000.0), "", "Sine"));
        assert_eq!((c.gaps.len(), c.stored_as), (0, "float64"));
    }
}

#[test]
fn daqmx_raw_data_with_linear_scales() {
    let Some(found) = opened("raw1.tdms") else { return };
    assert_eq!(found.format, "NI TDMS 2.0 (4713), little-endian");
    // Stated behind the last samples: wf_start_time = 2016-12-15T22:35:21.
    assert_eq!(found.started_at, "2016-12-15T22:35:21Z");
    let cases = [
        (
            "First  Channel",
            129.41648609881895,
            [-0.18402661214026306, 0.1480147709585864, 0.07568590350047304, 0.0009155552842799158],
            424_059.0,
        ),
        (
            "Second Chan",
            1819.5751823480941,
            [1.0303048799096652, 0.6497390667439802, 0.9155552842799157, 0.8291879024628437],
            5_962_202.0,
        ),
        (
            "Third Chan",
            3475.2009643848996,
            [1.7352824488052003, 1.8994720297860652, 1.9827875606555376, 2.077700125125889],
            11_387_191.0,
        ),
        (
            "Fourth Chan",
            5149.5931882686855,
            [2.49824518570513, 2.6364940336313976, 2.634357737968078, 2.511368144779809],
            16_873_672.0,
        ),
        (
            "Fifth Chan",
            6759.486373485519,
            [3.2273323770867033, 3.325296792504654, 3.4641560106204414, 3.6780907620471814],
            22_148_809.0,
        ),
        (
            "Sixth Chan",
            8314.76699118015,
            [4.336680196539201, 3.981444746238594, 4.02142399365215, 3.9255958738975187],
            27_244_997.0,
        ),
        (
            "Seventh Cha",
            9808.32605975524,
            [5.043183690908536, 4.558549760429701, 5.088961455122532, 5.074922940763573],
            32_138_942.0,
        ),
    ];
    assert_eq!(found.channels.len(), cases.len());
    for (name, sum, at, codes) in cases {
        let location = format!("/Layer Data/{name}");
        check(&found, &location, 2000, sum, at);
        let c = channel(&found, &location);
        // wf_increment is 1.9999999999999998e-05.
        assert_eq!(
            (c.sample_rate_hz, c.unit.as_str(), c.long_name.as_str()),
            (Some(1.9999999999999998e-05_f64.recip()), "Volts", name)
        );
        assert_eq!((c.scale_factor, c.add_offset, c.stored_as), (0.0003051850947599719, 0.0, "int16"));
        let Raw::Int16(raw) = c.source.read(0, 2000).unwrap() else { panic!("codes are int16") };
        // c.raw_data.sum(): whole numbers, exact.
        assert_eq!(raw.iter().map(|&r| f64::from(r)).sum::<f64>(), codes);
    }
}

#[test]
fn a_digital_log_of_signal_express() {
    let Some(found) = opened("Digital_Input.tdms") else { return };
    // wf_start_time = 2012-07-09T23:58:24.593732 (npTDMS gives microseconds, cut off).
    assert_eq!(found.started_at, "2012-07-09T23:58:24.5937329Z");
    let cases = [
        ("All Data", 20_000, 10_000.0, 2000.0),
        ("Decimated Data_Level1", 400, 200.0, 40.0),
        ("Decimated Data_Level2", 8, 4.0, 0.8),
    ];
    assert_eq!(found.channels.len(), cases.len());
    for (group, samples, sum, rate) in cases {
        // Its group's name has slashes, so the location is the path with its quotes.
        let location = format!("/'07/09/2012 06:58:23 PM - Digital Input - {group}'/'Dev1_port3_line7 - line 0'");
        check(&found, &location, samples, sum, [0.0, 1.0, 0.0, 1.0]);
        let c = channel(&found, &location);
        assert_eq!((c.sample_rate_hz, c.unit.as_str(), c.stored_as, c.gaps.len()), (Some(rate), "", "uint8", 0));
    }
    assert!(crate::support::remarked(&found, "different numbers of samples"));
}

#[test]
fn a_waveform_with_its_start() {
    let Some(found) = opened("raw_timestamps.tdms") else { return };
    // wf_start_time = 2024-01-24T01:48:43.068614.
    assert_eq!(found.started_at, "2024-01-24T01:48:43.068614483Z");
    assert_eq!(locations(&found), ["/Untitled/Untitled"]);
    let at = [0.0, 0.049067674327418015, 1.942890293094024e-16, -0.04906767432741799];
    check(&found, "/Untitled/Untitled", 128, 3.247402347028583e-15, at);
    assert_eq!(found.channels[0].sample_rate_hz, Some(1000.0));
}
