//! The story of a release diagnosis as artifacts.

use afmid_pipeline::{Array, Axis, Table};

use afmid_kernels::diagnosis::records::PositionCourse;
use afmid_kernels::diagnosis::release::{Cut, EventStory, LevelStory, Story};

/// Residuals, spectra and numbers of single events.
pub(super) fn residual_array(story: &Story, cut: &Cut, course: &[PositionCourse]) -> Array {
    let time: Vec<f64> = (0..story.measured.len()).map(|k| (k as f64 - cut.before as f64) * cut.interval_s).collect();
    let events: Vec<f64> = (0..story.events.len()).map(|k| k as f64).collect();
    let of = |pick: fn(&EventStory) -> f64| story.events.iter().map(pick).collect::<Vec<f64>>();
    let records: Vec<i64> = story.events.iter().map(|e| i64::try_from(e.record).unwrap_or(i64::MAX)).collect();
    let spectra = &story.spectra;
    let levels = |pick: fn(&LevelStory) -> f64| story.levels.iter().map(pick).collect::<Vec<f64>>();
    let (t, f, e, l) = (&["time"], &["frequency"], &["event"], &["level"]);
    let mut axes = vec![
        Axis::new("time", "s", "time after the release", time),
        Axis::new("frequency", "Hz", "frequency", spectra.frequency_hz.clone()),
        Axis::new("event", "1", "event", events),
        Axis::new("level", "V", "level at the converter", levels(|level| level.level_v)),
    ];
    let places: Vec<f64> = course.iter().map(|place| place.position_m).collect();
    if !places.is_empty() {
        axes.push(Axis::new("position", "m", "position of the piezo", places));
    }
    let array = Array::over(axes)
        .with("before", "V", "mean residual of the linear model", t, story.before.clone())
        .with("after", "V", "mean residual of the extended model", t, story.after.clone())
        .with("measured", "V", "mean event, weighted by amplitude, less offset and slope", t, story.measured.clone())
        .with("linear", "V", "the linear model's mean event", t, story.modelled(&story.before))
        .with("extended", "V", "the extended model's mean event", t, story.modelled(&story.after))
        .with("spectrum_before", "V^2/Hz", "density of `before`, one-sided", f, spectra.before.clone())
        .with("spectrum_after", "V^2/Hz", "density of `after`, one-sided", f, spectra.after.clone())
        .with("spectrum_noise", "V^2/Hz", "what the scatter of the events leaves in a mean", f, spectra.noise.clone())
        .with("record", "1", "number of the event's record", e, records)
        .with("amplitude", "V", "the event's amplitude", e, of(|event| event.amplitude_v))
        .with("event_rms_before", "V", "rms residual of the linear model", e, of(|event| event.rms_before))
        .with("event_rms_after", "V", "rms residual of the extended model", e, of(|event| event.rms_after))
        .with(
            "frequency_shift",
            "1",
            "first mode's frequency against the linear model's, relative",
            e,
            of(|event| event.frequency_shift),
        )
        .with("frequency_shift_std", "1", "its standard error", e, of(|event| event.frequency_shift_std))
        .with("level_before", "V", "mean residual of the linear model at a level", l, levels(|level| level.before[0]))
        .with(
            "level_before_std",
            "V",
            "its standard error, from the events' scatter",
            l,
            levels(|level| level.before[1]),
        )
        .with("level_after", "V", "mean residual of the extended model at a level", l, levels(|level| level.after[0]))
        .with(
            "level_after_std",
            "V",
            "its standard error, from the events' scatter",
            l,
            levels(|level| level.after[1]),
        );
    if course.is_empty() {
        return array;
    }
    let p = &["position"];
    let of = |pick: fn(&PositionCourse) -> f64| course.iter().map(pick).collect::<Vec<f64>>();
    array
        .with("free_before", "V", "free level at a position, against its mean", p, of(|place| place.before[0]))
        .with("free_before_std", "V", "its standard error, from the records' scatter", p, of(|place| place.before[1]))
        .with("free_after", "V", "the same less what the named causes make", p, of(|place| place.after[0]))
        .with("free_after_std", "V", "its standard error, from the records' scatter", p, of(|place| place.after[1]))
}

/// Energy of the residual common to all events over time and frequency, before and after.
pub(super) fn tile_table(story: &Story) -> Table {
    Table::of(&story.tiles)
        .with("from_s", "s", "begin, after the release", |[tile, _]| tile.from_s)
        .with("to_s", "s", "end", |[tile, _]| tile.to_s)
        .with("low_hz", "Hz", "lowest frequency", |[tile, _]| tile.low_hz)
        .with("high_hz", "Hz", "highest frequency", |[tile, _]| tile.high_hz)
        .with("excess_before", "1", "energy over the noise's, linear model", |[tile, _]| tile.excess)
        .with("excess_after", "1", "energy over the noise's, extended model", |[_, tile]| tile.excess)
        .with("p_before", "1", "probability of so much in noise, linear model", |[tile, _]| tile.p_value)
        .with("p_after", "1", "probability of so much in noise, extended model", |[_, tile]| tile.p_value)
        .table()
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::{Array, Context, Port, Stage, Table};

    use crate::diagnosis::ReleaseDiagnose;

    const RESIDUALS: Port<Array> = Port::new("residuals", "diagnosis-residuals", "");
    const TILES: Port<Table> = Port::new("tiles", "diagnosis-tiles", "");

    #[test]
    fn the_story_agrees_with_itself() {
        let example = ReleaseDiagnose::examples().remove(0);
        let stage = ReleaseDiagnose {
            modes: crate::model::ModeNumber::Fixed(2),
            detector_poles_hz: vec![1.5e6],
            window_samples: 4000,
            ..ReleaseDiagnose::default()
        };
        let ports = stage.run(&(example.inputs)().expect("inputs"), &Context::alone(7)).expect("a diagnosis");
        let array = ports.get(&RESIDUALS).expect("residuals");
        let of = |name: &str| array.real(name).expect("a variable");
        let levels = &array.axis("level").expect("levels").values;
        assert!(levels.len() > 10 && levels.is_sorted());
        // what is left by the extended model at a level is noise: of some sixty levels a few exceed three of their
        // errors, as many neighbours share their noise
        let beyond = of("level_after").iter().zip(of("level_after_std")).filter(|(mean, std)| mean.abs() > 3.0 * **std);
        assert!(beyond.count() * 5 < levels.len());
        let mean_square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        for (model, rest, spectrum) in
            [("linear", "before", "spectrum_before"), ("extended", "after", "spectrum_after")]
        {
            for ((measured, modelled), rest) in of("measured").iter().zip(of(model)).zip(of(rest)) {
                // rounding
                assert!((measured - modelled - rest).abs() < 1e-12);
            }
            let f = &array.axis("frequency").expect("frequencies").values;
            // Parseval: the first and the last bin count once, the others twice, and all are written one-sided
            let spectrum = of(spectrum);
            let ends = 0.5 * (spectrum[0] + spectrum[spectrum.len() - 1]);
            let power = (spectrum.iter().sum::<f64>() - ends) * (f[1] - f[0]);
            assert!((power / mean_square(of(rest)) - 1.0).abs() < 1e-9, "{power} {}", mean_square(of(rest)));
        }
        // the bend is common to all events; what is left of it is noise: 1.2 mV white over eight events, 2.5 MHz wide
        let level = 2.0 * (1.2e-3_f64).powi(2) * 2e-7 / 8.0;
        let noise = of("spectrum_noise");
        let mean = noise.iter().sum::<f64>() / noise.len() as f64;
        // 7 events' freedom in each of 2000 bins: one per cent; a fit of four own parameters takes less
        assert!((mean / level - 1.0).abs() < 0.05, "{mean} {level}");
        assert!(mean_square(of("before")) > 1.5 * mean_square(of("after")));
        for (before, after) in of("event_rms_before").iter().zip(of("event_rms_after")) {
            assert!(after < before && (after / 1.2e-3 - 1.0).abs() < 0.1, "{before} {after}");
        }
        let tiles = ports.get(&TILES).expect("tiles");
        let (before, after) =
            (tiles.real("excess_before").expect("before"), tiles.real("excess_after").expect("after"));
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        assert!(most(before) > 5.0 && most(after) < 4.0, "{} {}", most(before), most(after));
    }
}
