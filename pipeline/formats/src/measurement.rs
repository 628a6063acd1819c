//! Files of one measurement: their channels as those of one file, put together where their clocks agree.

use std::path::{Path, PathBuf};

use crate::calendar::days_to;
use crate::together::{begun_together, one_rate};
use crate::{Contents, FormatError, FoundChannel};

/// A date that is given more coarsely than this, in samples, does not say with which sample of another file one was
/// taken.
const COARSEST_DATE_SAMPLES: f64 = 0.5;

/// What files of one measurement are called: their names, with their folders where two have one name.
///
/// Errors: two have one name and one folder's name.
pub fn names_of_files(paths: &[PathBuf]) -> Result<Vec<String>, FormatError> {
    let last = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<String> = paths.iter().map(|path| last(path)).collect();
    let with_folder = |(path, name): (&PathBuf, &String)| {
        let several = names.iter().filter(|other| *other == name).count() > 1;
        let folder = path.parent().map(last).filter(|folder| several && !folder.is_empty());
        folder.map_or_else(|| name.clone(), |folder| format!("{folder}/{name}"))
    };
    let called: Vec<String> = paths.iter().zip(&names).map(with_folder).collect();
    match called.iter().enumerate().find(|(number, name)| called.iter().take(*number).any(|other| other == *name)) {
        None => Ok(called),
        Some((_, name)) => Err(FormatError::new(
            format!("two files of one measurement are called {name}: nothing tells their channels apart"),
            "name each file once, files of other folders by another name",
        )),
    }
}

/// What files of one measurement hold together, each by its name: a channel is `FILE:CHANNEL`. Of a single file that
/// file's contents as they are.
///
/// Errors: the files state dates that differ and are too coarse to tell by how many samples.
pub fn joined(files: Vec<(String, Contents)>) -> Result<Contents, FormatError> {
    let files = match <[(String, Contents); 1]>::try_from(files) {
        Ok([(_, only)]) => return Ok(only),
        Err(files) => files,
    };
    let later_s = later_by_dates(&files)?;
    let mut all = Contents {
        format: String::new(),
        started_at: String::new(),
        channels: Vec::new(),
        responses: Vec::new(),
        remarks: Vec::new(),
    };
    let mut formats: Vec<String> = Vec::new();
    for (number, (name, contents)) in files.into_iter().enumerate() {
        let of_it = |location: &str| format!("{name}:{}", location.trim_start_matches('/'));
        let begins_remark = |remark: &String| contents.channels.iter().any(|one| remark.starts_with(&one.location));
        let remark = |remark: &String| if begins_remark(remark) { of_it(remark) } else { format!("{name}: {remark}") };
        all.remarks.extend(contents.remarks.iter().map(remark));
        let says_starts = contents.channels.iter().any(|channel| channel.start_s.is_some());
        for channel in contents.channels {
            let start_s = match &later_s {
                None => channel.start_s,
                Some(later_s) => {
                    // a date alone is that of the first samples
                    let own = channel.start_s.or_else(|| (!says_starts).then_some(0.0));
                    own.zip(later_s.get(number).copied().flatten()).map(|(own, later)| own + later)
                }
            };
            all.channels.push(FoundChannel { location: of_it(&channel.location), start_s, ..channel });
        }
        if !formats.contains(&contents.format) {
            formats.push(contents.format);
        }
        if all.started_at.is_empty() {
            all.started_at = contents.started_at;
        }
    }
    all.format = formats.join(", ");
    Ok(all)
}

/// Seconds by which each file begins after the first by the dates that they state, none for files without; none where
/// dates say nothing: fewer than two, or all equal. Errors: as [`joined`].
fn later_by_dates(files: &[(String, Contents)]) -> Result<Option<Vec<Option<f64>>>, FormatError> {
    let stated = || files.iter().filter(|(_, contents)| !contents.started_at.is_empty());
    let Some((first_name, first)) = stated().next() else { return Ok(None) };
    let Some((other_name, other)) = stated().find(|(_, contents)| contents.started_at != first.started_at) else {
        return Ok(None);
    };
    let unclear = |why: &str| {
        let problem =
            format!("{first_name} began at {}, {other_name} at {}: {why}", first.started_at, other.started_at);
        FormatError::new(problem, "write both signals into one file, or leave the dates out if both began at once")
    };
    let rates = files.iter().flat_map(|(_, contents)| &contents.channels).filter_map(|one| one.sample_rate_hz);
    let fastest = rates.fold(0.0, f64::max);
    let mut later = Vec::with_capacity(files.len());
    let origin = Moment::of(&first.started_at).ok_or_else(|| unclear("no dates that can be compared"))?;
    for (_, contents) in files {
        if contents.started_at.is_empty() {
            later.push(None);
            continue;
        }
        let own = Moment::of(&contents.started_at).filter(|own| own.in_utc == origin.in_utc);
        let own = own.ok_or_else(|| unclear("no dates that can be compared"))?;
        if own.unit_s.max(origin.unit_s) * fastest > COARSEST_DATE_SAMPLES {
            return Err(unclear("dates that are too coarse to tell by how many samples"));
        }
        later.push(Some((own.seconds - origin.seconds) as f64 + (own.fraction - origin.fraction)));
    }
    Ok(Some(later))
}

/// A date and time of day.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moment {
    /// Since 1970, whole.
    seconds: i64,
    fraction: f64,
    /// One unit of its last digit.
    unit_s: f64,
    /// Whether it says its zone.
    in_utc: bool,
}

impl Moment {
    /// `2024-05-06T07:08:09.25`, with `Z`, `+01:00` or nothing behind it; none if it is no such date.
    fn of(text: &str) -> Option<Self> {
        let (date, time) = text.split_once(['T', ' '])?;
        let mut days = date.splitn(3, '-').map(|part| part.parse::<i64>().ok());
        let days = days_to(days.next()??, days.next()??, days.next()??);
        let zone = time.find(['Z', '+', '-']);
        let (time, zone) = time.split_at(zone.unwrap_or(time.len()));
        let mut parts = time.splitn(3, ':');
        let (hours, minutes) = (parts.next()?.parse::<i64>().ok()?, parts.next()?.parse::<i64>().ok()?);
        let (whole, digits) = parts.next().map_or(("0", ""), |last| last.split_once('.').unwrap_or((last, "")));
        let fraction = if digits.is_empty() { 0.0 } else { format!("0.{digits}").parse().ok()? };
        let ahead_s = match zone {
            "" | "Z" => 0,
            zone => {
                let (hours, minutes) = zone.get(1..)?.split_once(':')?;
                let ahead = 3600 * hours.parse::<i64>().ok()? + 60 * minutes.parse::<i64>().ok()?;
                if zone.starts_with('-') { -ahead } else { ahead }
            }
        };
        Some(Self {
            seconds: 86_400 * days + 3600 * hours + 60 * minutes + whole.parse::<i64>().ok()? - ahead_s,
            fraction,
            unit_s: (0..digits.len()).fold(1.0, |unit, _| unit / 10.0),
            in_utc: !zone.is_empty(),
        })
    }
}

/// Channels of several files from the instant on at which the last of them begins up to where the first of them ends,
/// and what to say of it. `rate_given`: whether the user says the rate of files that state none.
///
/// Errors: as [`begun_together`]; some state a rate and others none.
pub fn put_together(
    channels: &[&FoundChannel],
    rate_given: bool,
) -> Result<(Vec<FoundChannel>, Vec<String>), FormatError> {
    one_rate(channels)?;
    let rated = channels.iter().find_map(|channel| Some((&channel.location, channel.sample_rate_hz?)));
    let unrated = channels.iter().find(|channel| channel.sample_rate_hz.is_none());
    if let (Some((rated, rate)), Some(unrated), false) = (rated, unrated, rate_given) {
        let problem = format!("{} has no sample rate, {rated} has {rate}: wanted one clock", unrated.location);
        return Err(FormatError::new(problem, "say the rate of both with `sample_rate_hz` (--rate) if they have one"));
    }
    let mut said = Vec::new();
    let mut found: Vec<FoundChannel> = match begun_together(channels)? {
        Some((moved, words)) => {
            said.push(words);
            moved
        }
        None => channels.iter().map(|channel| (*channel).clone()).collect(),
    };
    let unknown: Vec<&str> =
        channels.iter().filter(|channel| channel.start_s.is_none()).map(|channel| channel.location.as_str()).collect();
    if !unknown.is_empty() {
        let does = if unknown.len() == 1 { "does" } else { "do" };
        said.push(format!("{} {does} not say when the first sample was taken: all begin at once", unknown.join(", ")));
    }
    let samples = found.iter().map(|channel| channel.samples).min().unwrap_or(0);
    if channels.iter().any(|channel| channel.samples != channels[0].samples) {
        let each: Vec<String> =
            channels.iter().map(|channel| format!("{} has {}", channel.location, channel.samples)).collect();
        said.push(format!("{samples} samples are taken, which all have: {}", each.join(", ")));
    }
    for channel in &mut found {
        channel.samples = samples;
        channel.gaps.retain(|gap| *gap < samples);
    }
    Ok((found, said))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Raw, Source};

    #[derive(Debug)]
    struct Counts;

    impl Source for Counts {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            Ok(Raw::Float64((start..start + count).map(|k| k as f64).collect()))
        }
    }

    fn file(started_at: &str, channels: Vec<FoundChannel>) -> Contents {
        let remarks = vec!["/y is odd".to_owned(), "an odd file".to_owned()];
        let (format, started_at) = ("test".to_owned(), started_at.to_owned());
        Contents { format, started_at, channels, responses: Vec::new(), remarks }
    }

    fn channel(location: &str, rate: Option<f64>, start_s: Option<f64>, samples: usize) -> FoundChannel {
        let found = FoundChannel::new(location, samples, "float64", Arc::new(Counts));
        FoundChannel { sample_rate_hz: rate, start_s, ..found }
    }

    /// Both files put together.
    fn both(dates: [&str; 2], u: FoundChannel, y: FoundChannel) -> Result<(Vec<FoundChannel>, String), FormatError> {
        let files = vec![("u.x".to_owned(), file(dates[0], vec![u])), ("y.x".to_owned(), file(dates[1], vec![y]))];
        let contents = joined(files)?;
        let (found, said) = put_together(&contents.channels.iter().collect::<Vec<_>>(), false)?;
        Ok((found, said.join("; ")))
    }

    fn first(channel: &FoundChannel) -> f64 {
        channel.source.read(0, 1).unwrap().widened()[0]
    }

    #[test]
    fn channels_of_several_files_have_their_files_names_and_share_instants() {
        let rate = Some(100.0);
        let ((found, said), files) = (
            both(["", ""], channel("/u", rate, Some(0.0), 50), channel("/y", rate, Some(0.1), 45)).unwrap(),
            vec![("only".to_owned(), file("", vec![channel("/y", rate, None, 5)]))],
        );
        assert_eq!((found[0].location.as_str(), found[1].location.as_str()), ("u.x:u", "y.x:y"));
        assert_eq!((first(&found[0]), first(&found[1]), found[0].samples, found[1].samples), (10.0, 0.0, 40, 40));
        assert!(said.contains("y.x:y begins 0.1 s (10.000 samples) after u.x:u"), "{said}");
        assert!(said.contains("40 samples are taken, which all have: u.x:u has 50, y.x:y has 45"), "{said}");
        assert_eq!(joined(files).unwrap().channels[0].location, "/y");
        let remarks = joined(vec![("a".to_owned(), file("", vec![channel("/y", rate, None, 5)])); 2]).unwrap().remarks;
        assert_eq!(remarks[..2], ["a:y is odd", "a: an odd file"]);
    }

    #[test]
    fn clocks_that_differ_or_are_not_known_are_refused_or_said() {
        let of = |u: Option<f64>, y: Option<f64>| both(["", ""], channel("u", u, None, 50), channel("y", y, None, 50));
        let problem = of(Some(100.0), Some(50.0)).unwrap_err().problem;
        assert!(problem.contains("y.x:y has 50 samples per second, u.x:u has 100"), "{problem}");
        let problem = of(None, Some(50.0)).unwrap_err().problem;
        assert!(problem.contains("u.x:u has no sample rate, y.x:y has 50"), "{problem}");
        let (_, said) = of(Some(50.0), Some(50.0)).unwrap();
        assert!(said.contains("u.x:u, y.x:y do not say when the first sample was taken"), "{said}");
    }

    #[test]
    fn dates_count_where_they_are_finer_than_a_sample() {
        let of = |dates: [&str; 2], start: Option<f64>| {
            both(dates, channel("u", Some(100.0), start, 50), channel("y", Some(100.0), start, 50))
        };
        for start in [None, Some(0.3)] {
            let (found, _) = of(["2024-05-06T07:59:59.950Z", "2024-05-06T08:00:00.050Z"], start).unwrap();
            assert_eq!((first(&found[0]), first(&found[1]), found[0].samples), (10.0, 0.0, 40));
        }
        let (found, _) = of(["2024-05-06T09:59:59.950+02:00", "2024-05-06T08:00:00.050Z"], None).unwrap();
        assert_eq!((first(&found[0]), first(&found[1])), (10.0, 0.0));
        for dates in [
            ["2024-05-06T08:00:00", "2024-05-06T08:00:01"],
            ["2024-05-06T08:00:00.050", "2024-05-06T08:00:00.060Z"],
            ["soon", "2024-05-06T08:00:00.060Z"],
        ] {
            let problem = of(dates, Some(0.0)).unwrap_err().problem;
            assert!(problem.contains(dates[0]) && problem.contains(dates[1]), "{problem}");
        }
        // to the second, and the same: the files' own times count
        assert_eq!(of(["2024-05-06T08:00:00"; 2], Some(0.0)).unwrap().0[0].samples, 50);
    }

    #[test]
    fn files_of_one_name_have_their_folders_names() {
        let of = |paths: [&str; 2]| names_of_files(&paths.map(PathBuf::from));
        assert_eq!(of(["in/a.csv", "out/b.csv"]).unwrap(), ["a.csv", "b.csv"]);
        assert_eq!(of(["in/a.csv", "out/a.csv"]).unwrap(), ["in/a.csv", "out/a.csv"]);
        assert!(of(["x/in/a.csv", "y/in/a.csv"]).unwrap_err().problem.contains("in/a.csv"));
    }
}
