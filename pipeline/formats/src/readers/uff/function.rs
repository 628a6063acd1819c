//! From datasets to channels.

use super::header::Header;
use super::layout::Layout;
use super::samples::{Picked, Text};
use super::scan::{Data, Dataset, Scanned};
use crate::evenness::{Stretches, Times, of_gaps};
use crate::facts::AS_RATE;
use crate::grid::{Grid, Store};
use crate::number::Number;
use crate::pinned::Pinned;
use crate::printed::Printed;
use crate::rate::of_step;
use crate::{Contents, FoundChannel, FoundResponse, Frequencies, Parts, Source, unit_ratio};
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

/// What a file of these datasets holds.
pub(super) fn contents(scanned: Scanned, pinned: &Pinned) -> Contents {
    let Scanned { datasets, others, mut remarks } = scanned;
    let started_at = datasets.iter().find_map(|d| d.header.started_at.clone()).unwrap_or_default();
    let (mut text, mut binary) = (false, false);
    let (mut channels, mut responses) = (Vec::new(), Vec::new());
    let mut seen: HashMap<String, usize> = HashMap::new();
    for (number, dataset) in datasets.iter().enumerate() {
        match dataset.data {
            Data::Text => text = true,
            _ => binary = true,
        }
        let name = dataset.header.response.clone();
        let times = seen.entry(name.clone()).and_modify(|n| *n += 1).or_insert(1);
        let location = if *times == 1 { name } else { format!("{name}[{times}]") };
        if dataset.header.complex && dataset.header.is_response() {
            match response(dataset, &location, pinned) {
                Ok(found) => {
                    remarks.extend(doubles(dataset, &location));
                    responses.push(found);
                }
                Err(why) => remarks.push(format!("the frequency response {location} is left out: {why}")),
            }
            continue;
        }
        match function(dataset, &location, pinned, &mut remarks) {
            Ok(found) => channels.extend(found),
            Err(why) => {
                let what = dataset.header.function_name();
                remarks.push(format!("dataset 58 number {}, {location} ({what}), is left out: {why}", number + 1));
            }
        }
    }
    for (dataset, count) in others {
        remarks.push(format!("{count} datasets {dataset} are left out: only 58 and 58b hold samples"));
    }
    if !responses.is_empty() {
        let count = responses.len();
        remarks.push(format!("{count} frequency responses are no recordings: the stage `io.frf` reads them"));
    }
    let kinds = match (text, binary) {
        (true, true) => "datasets 58 and 58b",
        (false, true) => "dataset 58b",
        _ => "dataset 58",
    };
    Contents { format: format!("Universal File Format, {kinds}"), started_at, channels, responses, remarks }
}

/// The channels of a dataset: its ordinate and, if uneven, its abscissa. Errors: why there is none.
fn function(
    dataset: &Dataset,
    location: &str,
    pinned: &Pinned,
    remarks: &mut Vec<String>,
) -> Result<Vec<FoundChannel>, String> {
    let header = &dataset.header;
    if header.complex {
        return Err(format!("its {} values are complex", header.points));
    }
    if header.points == 0 {
        return Err("it has no values".to_owned());
    }
    let (mut ordinates, abscissa) = sources(dataset, pinned)?;
    remarks.extend(doubles(dataset, location));
    let ordinate = ordinates.pop().ok_or("it has no values")?;
    let times = abscissa.as_ref().and_then(|(source, _)| stored_clock(header, source.as_ref(), location, remarks));
    let abscissa = abscissa.filter(|_| times.is_none());
    let clock = if header.even { even_clock(header, location, remarks) } else { times };
    let rate = clock.as_ref().map(|clock| clock.rate_hz);
    let mut long_name = header.identification.join(", ");
    if long_name.is_empty() {
        header.ordinate.label.clone_into(&mut long_name);
    }
    let channel = |location: String, unit: &str, long_name: String, rate, stored_as, source| FoundChannel {
        unit: unit.to_owned(),
        long_name,
        sample_rate_hz: rate,
        rate_relative_std: clock.as_ref().map_or(0.0, |clock| clock.relative_std),
        start_s: clock.as_ref().map(|clock| clock.start_s),
        gaps: clock.as_ref().map(|clock| clock.gaps.clone()).unwrap_or_default(),
        ..FoundChannel::new(location, header.points as usize, stored_as, source)
    };
    let stored_as = stored_as(dataset);
    let name = format!("{long_name} ({})", header.function_name());
    let mut channels = vec![channel(location.to_owned(), &header.ordinate.unit, name, rate, stored_as, ordinate)];
    if let Some((source, stored_as)) = abscissa {
        let label = format!("abscissa of {location}: {}", header.abscissa.label);
        let abscissa = channel(format!("{location}/abscissa"), &header.abscissa.unit, label, None, stored_as, source);
        channels.push(FoundChannel { is_axis: true, ..abscissa });
    }
    Ok(channels)
}

fn stored_as(dataset: &Dataset) -> &'static str {
    match (dataset.data, dataset.layout.is_some_and(Layout::is_double)) {
        (Data::Text, _) => "text",
        (_, true) => "float64",
        (_, false) => "float32",
    }
}

/// What to say where the data take the bytes of double precision and single is stated.
fn doubles(dataset: &Dataset, location: &str) -> Option<String> {
    let doubles = dataset.layout.is_some_and(Layout::is_double) && !dataset.header.double;
    doubles.then(|| format!("{location}: single precision is stated, its data take the bytes of double: read as that"))
}

/// A frequency response. Errors: why there is none.
fn response(dataset: &Dataset, location: &str, pinned: &Pinned) -> Result<FoundResponse, String> {
    let header = &dataset.header;
    let samples = header.points as usize;
    if samples == 0 {
        return Err("it has no values".to_owned());
    }
    let (ordinates, abscissa) = sources(dataset, pinned)?;
    let [real, imaginary] = <[Arc<dyn Source>; 2]>::try_from(ordinates).map_err(|_| "its values are no pairs")?;
    let part = |source| FoundChannel::new(location, samples, stored_as(dataset), source);
    let listed = |(source, stored_as)| {
        Frequencies::Listed(FoundChannel::new(format!("{location}/abscissa"), samples, stored_as, source))
    };
    let even = Frequencies::Even(header.abscissa_start, header.step());
    let [output, input] = header.degrees.clone();
    Ok(FoundResponse {
        location: location.to_owned(),
        frequencies: abscissa.map_or(even, listed),
        frequency_unit: header.abscissa.unit.clone(),
        values: [part(real), part(imaginary)],
        parts: Parts::RealImaginary,
        guessed: false,
        coherence: None,
        unit: unit_ratio(&header.ordinate.unit, &header.denominator.unit),
        output,
        input,
        remarks: Vec::new(),
    })
}

/// When samples were taken.
#[derive(Debug)]
struct Clock {
    rate_hz: f64,
    /// Standard error of the rate, relative.
    relative_std: f64,
    start_s: f64,
    /// Samples before which the times jump.
    gaps: Vec<usize>,
}

/// The clock of an even abscissa.
fn even_clock(header: &Header, location: &str, remarks: &mut Vec<String>) -> Option<Clock> {
    let (start, step, unit) = (header.abscissa_start, header.abscissa_step, &header.abscissa.unit);
    let Some(seconds) = header.seconds() else {
        let what = header.abscissa_name();
        remarks.push(format!(
            "{location} has no sample rate: {what} is not time; it runs from {start} in steps of {step} {unit}"
        ));
        return None;
    };
    if !(step.is_finite() && step > 0.0) {
        remarks.push(format!("{location} has no sample rate: its step is {step} {unit}"));
        return None;
    }
    if start != 0.0 {
        remarks.push(format!("{location} begins at {start} {unit}"));
    }
    let rate_hz = of_step(header.step() * seconds);
    Some(Clock { rate_hz, relative_std: 0.0, start_s: start * seconds, gaps: Vec::new() })
}

/// Abscissae of more points are not looked at: they are read whole.
const MOST_TIMES: usize = 1 << 22;

/// The clock of an abscissa that is stored point by point and runs evenly to within its printing, but for jumps.
fn stored_clock(header: &Header, abscissa: &dyn Source, location: &str, remarks: &mut Vec<String>) -> Option<Clock> {
    let what = header.abscissa_name();
    let none = |why: &str| {
        format!("{location} has no sample rate: {what} is stored point by point, in {location}/abscissa{why}")
    };
    let Some(seconds) = header.seconds() else {
        remarks.push(none(""));
        return None;
    };
    match stored_times(abscissa, header.points as usize) {
        Ok(found) => {
            let (unit, even) = (&header.abscissa.unit, found.even);
            remarks.push(format!(
                "{location}/abscissa is {AS_RATE}: its {} values run evenly from {} {unit} in steps of {} {unit}",
                header.points, even.first, even.step
            ));
            remarks.extend(of_gaps(&format!("{location}/abscissa"), &found));
            Some(Clock {
                rate_hz: of_step(even.step * seconds),
                relative_std: even.relative_std(),
                start_s: even.first * seconds,
                gaps: found.gaps,
            })
        }
        Err(why) => {
            remarks.push(none(&format!(": {why}")));
            None
        }
    }
}

/// How a stored abscissa runs: neighbours are printed alike or differ by the printing. Errors: why it is not even.
fn stored_times(abscissa: &dyn Source, points: usize) -> Result<Stretches, String> {
    if points > MOST_TIMES {
        return Err(format!("its {points} values are too many to look at, wanted at most {MOST_TIMES}"));
    }
    let times = abscissa.read(0, points).map_err(|error| error.to_string())?.widened();
    let printed = Printed::of(&times);
    Times { printed: Some(&printed), ..Times::exact(&times) }.stretches(None)
}

type Abscissa = Option<(Arc<dyn Source>, &'static str)>;

/// Where ordinates (one, or real and imaginary part) and, if uneven, abscissa come from. Errors: the data are not as
/// many as the points.
fn sources(dataset: &Dataset, pinned: &Pinned) -> Result<(Vec<Arc<dyn Source>>, Abscissa), String> {
    let header = &dataset.header;
    let bytes = dataset.to.saturating_sub(dataset.from);
    let parts = header.numbers() as u64;
    let per_point = if header.even { parts } else { parts + 1 };
    let points = header.points;
    let pinned = pinned.clone();
    if dataset.data == Data::Text {
        // A number has a digit and a blank at least.
        if points.saturating_mul(2 * per_point) > bytes.saturating_add(1) {
            return Err(format!("{points} points are stated, its {bytes} bytes cannot hold them"));
        }
        let widths: &'static [usize] = match (header.double, header.even, header.complex) {
            (false, ..) => &[13],
            (true, true, _) => &[20],
            (true, false, false) => &[13, 20],
            (true, false, true) => &[13, 20, 20],
        };
        let (points, every) = (points as usize, per_point as usize);
        let numbers = points * every;
        let text = Text { pinned, from: dataset.from, to: dataset.to, widths, numbers, parsed: OnceLock::new() };
        let text = Arc::new(text);
        let pick =
            |first| -> Arc<dyn Source> { Arc::new(Picked { text: Arc::clone(&text), first, every, samples: points }) };
        let abscissa: Abscissa = if header.even { None } else { Some((pick(0), "text")) };
        return Ok(((every - header.numbers()..every).map(pick).collect(), abscissa));
    }
    let Some(layout) = dataset.layout else {
        return Err(format!("{points} points are stated, which its {bytes} bytes of data do not match"));
    };
    let source = |first, width| Grid {
        store: Store::File(pinned.clone()),
        first: dataset.from + first,
        step: layout.point(),
        samples: points as usize,
        number: if width == 8 { Number::F64 } else { Number::F32 },
        big_endian: dataset.data == Data::BigEndian,
    };
    let part =
        |part: u64| -> Arc<dyn Source> { Arc::new(source(layout.abscissa + part * layout.ordinate, layout.ordinate)) };
    let stored_as = if layout.abscissa == 8 { "float64" } else { "float32" };
    let abscissa: Abscissa = if header.even { None } else { Some((Arc::new(source(0, layout.abscissa)), stored_as)) };
    Ok(((0..parts).map(part).collect(), abscissa))
}
