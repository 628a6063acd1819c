//! From the moving lever to the codes of a record: force, lever, detector, recorder in this order.

use super::adc::Adc;
use super::afm_system::AfmSystem;
use super::contact::{ADHESION_CUT, Contact};
use super::detector::Detector;
use super::error::{SimulateError, require};
use super::hidden_motion::simulate_hidden;
use super::lever::ModalLever;
use super::motion::{ContactEvent, Drive, Sampling};
use super::phases::RecordPlan;
use super::ramp::TriangleRamp;
use super::readout_noise::{Drift, ReadoutNoise};
use crate::effects::{Effects, Instant};
use crate::events::EventKind;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The microscope, without a record's own surface, pull-off forces and phase.
#[derive(Debug, Clone, PartialEq)]
pub struct Microscope {
    /// Lever.
    pub lever: ModalLever,
    /// Contact.
    pub contact: Contact,
    /// Detector.
    pub detector: Detector,
    /// Noise of the readout.
    pub noise: ReadoutNoise,
    /// Converter of the deflection channel.
    pub adc: Adc,
    /// Converter of the piezo monitor.
    pub monitor: PiezoMonitor,
    /// Ramp; its phase is set per record.
    pub ramp: TriangleRamp,
    /// Temperature of the lever and the contact, K; 0: no thermal motion.
    pub temperature_k: f64,
    /// Samples per second, Hz.
    pub sample_rate_hz: f64,
}

/// The channel that shows the piezo's drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiezoMonitor {
    /// Metres per monitored volt.
    pub m_per_v: f64,
    /// Volts per code.
    pub lsb_v: f64,
    /// White noise before the converter, V.
    pub white_v: f64,
}

/// Scatter of the sample and of the contact over the archive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Mean height of the surface on the ramp's scale, m.
    pub surface_m: f64,
    /// Standard deviation of the surface's height from record to record, m.
    pub surface_std_m: f64,
}

/// One event as the record shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedEvent {
    /// What happened, when on the ramp's clock, with which force.
    pub event: ContactEvent,
    /// Where its first trace lies in the record, samples (the instant plus the detector's delay).
    pub sample: f64,
    /// At least one margin from both ends, and not the echo of another one.
    pub counted: bool,
}

/// A simulated record.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedRecord {
    /// Codes of the deflection channel.
    pub deflection: Vec<i16>,
    /// Codes of the piezo monitor.
    pub piezo: Vec<i16>,
    /// Force of the sample on the tip at each sample's instant (the detector's delay taken off), N.
    pub force_n: Vec<f64>,
    /// Every event.
    pub events: Vec<RecordedEvent>,
    /// Deflection codes at a limit.
    pub saturated: usize,
}

/// Where a record stands in its archive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Its number, from zero.
    pub record: usize,
    /// Number of records.
    pub records: usize,
    /// Samples per record.
    pub samples: usize,
    /// Events closer to an end than this are not counted, samples.
    pub margin_samples: usize,
    /// Seed of the archive.
    pub seed: u64,
}

/// Independent random streams: one per record and part, so that a change of one part leaves the others' numbers alone.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Archive,
    Surface,
    Motion,
    Readout,
    Monitor,
    Jitter,
    Intensity,
}

const STREAMS_PER_RECORD: u64 = 8;

fn stream(seed: u64, record: usize, part: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(record as u64 * STREAMS_PER_RECORD + part as u64);
    rng
}

/// The archive's own random stream (phases, drift).
pub fn archive_stream(seed: u64) -> ChaCha8Rng {
    stream(seed, 0, Stream::Archive)
}

impl Microscope {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        self.lever.check()?;
        self.contact.check()?;
        self.detector.check()?;
        self.noise.check()?;
        self.adc.check()?;
        self.ramp.check()?;
        require("piezo_m_per_v", self.monitor.m_per_v, self.monitor.m_per_v > 0.0, "wanted above 0")?;
        require("piezo_lsb_v", self.monitor.lsb_v, self.monitor.lsb_v > 0.0, "wanted above 0")?;
        let drive_v = 0.5 * self.ramp.range_m / self.monitor.m_per_v;
        let fits = drive_v / self.monitor.lsb_v < f64::from(i16::MAX);
        require("piezo_lsb_v", self.monitor.lsb_v, fits, "half of ramp_m / piezo_m_per_v must fit int16 codes")?;
        require("piezo_white_v", self.monitor.white_v, self.monitor.white_v >= 0.0, "wanted 0 or more")?;
        require("temperature_k", self.temperature_k, self.temperature_k >= 0.0, "wanted 0 or more")?;
        let rate = self.sample_rate_hz;
        let highest = self.lever.modes.iter().map(|m| m.frequency_hz).fold(0.0, f64::max);
        require("sample_rate_hz", rate, rate > 2.0 * highest, "wanted above twice the highest mode's frequency")
    }

    /// Surface and pull-off forces of each record, drawn from its own stream.
    pub fn plan(&self, scatter: Scatter, place: Place) -> RecordPlan {
        let mut rng = stream(place.seed, place.record, Stream::Surface);
        let surface: f64 = StandardNormal.sample(&mut rng);
        let duration_s = place.samples as f64 / self.sample_rate_hz;
        let cycles = (duration_s * self.ramp.frequency_hz).ceil() as usize + 2;
        let pull_off = |deviate: f64| self.contact.adhesion_n * (1.0 + self.contact.adhesion_scatter * deviate);
        RecordPlan {
            surface_m: scatter.surface_m + scatter.surface_std_m * surface.clamp(-ADHESION_CUT, ADHESION_CUT),
            pull_off_n: (0..cycles).map(|_| pull_off(within(ADHESION_CUT, &mut rng))).collect(),
        }
    }

    /// Simulates one record.
    ///
    /// # Accuracy
    /// The motion is exact (`simulate_motion`); the rest is arithmetic. The same seed gives the same codes on any
    /// number of threads: each record has its own streams.
    pub fn record(&self, plan: &RecordPlan, phase: f64, drift: &Drift, place: Place) -> SimulatedRecord {
        self.record_with(plan, phase, drift, place, &Effects::default())
    }

    /// Simulates one record with causes hidden in it ([`simulate_hidden`]).
    ///
    /// # Model
    /// Frequencies are those of the record's middle; the sampling instants of the whole record are shifted by one draw
    /// of the jitter; volts are added behind the electronics and before the noise, limits act in front of the
    /// converter.
    ///
    /// # Accuracy
    /// With nothing hidden: the bits of [`Microscope::record`].
    pub fn record_with(
        &self,
        plan: &RecordPlan,
        phase: f64,
        drift: &Drift,
        place: Place,
        effects: &Effects,
    ) -> SimulatedRecord {
        let lever = self.lever_at(place, effects);
        let system = AfmSystem::with_effects(&lever, &self.contact, &self.detector, self.temperature_k, effects);
        let ramp = TriangleRamp { phase, ..self.ramp };
        let drive = Drive { ramp, surface_m: plan.surface_m, pull_off_n: &plan.pull_off_n };
        let interval_s = 1.0 / self.sample_rate_hz;
        // the delay moves the instants, not the samples
        let start_s = jittered(-self.detector.delay_s - effects.delay_s, effects.jitter_s, place);
        let lost = Lost::new(effects, self.sample_rate_hz);
        let sampling = Sampling { start_s, interval_s, samples: place.samples + lost.total() };
        let mut rng = stream(place.seed, place.record, Stream::Motion);
        let (contact, detector) = (&self.contact, &self.detector);
        let mut motion = simulate_hidden(&system, &lever, contact, detector, &drive, sampling, effects, &mut rng);
        lost.drop_from(&mut motion.signal_m);
        lost.drop_from(&mut motion.force_n);
        let deflection = self.deflection_codes(motion.signal_m, drift, place, &ramp, effects);
        SimulatedRecord {
            saturated: self.adc.saturated(&deflection),
            deflection,
            force_n: motion.force_n,
            piezo: self.piezo_codes(&ramp, place, &lost),
            events: self.recorded(&motion.events, place, -start_s, &lost),
        }
    }

    /// The lever of a record whose frequencies may have changed.
    pub(super) fn lever_at(&self, place: Place, effects: &Effects) -> ModalLever {
        let middle = place.instant(0.5 * place.samples as f64 / self.sample_rate_hz, 0.0);
        let change: f64 = effects.frequency.iter().map(|change| change(&middle)).sum();
        let mut lever = self.lever.clone();
        if change != 0.0 {
            lever.modes.iter_mut().for_each(|mode| mode.frequency_hz *= 1.0 + change);
        }
        lever
    }

    fn deflection_codes(
        &self,
        signal_m: Vec<f64>,
        drift: &Drift,
        place: Place,
        ramp: &TriangleRamp,
        effects: &Effects,
    ) -> Vec<i16> {
        let mut volts = signal_m;
        if effects.intensity != 0.0 {
            let mut rng = stream(place.seed, place.record, Stream::Intensity);
            for v in &mut volts {
                let deviate: f64 = StandardNormal.sample(&mut rng);
                *v *= 1.0 + effects.intensity * deviate;
            }
        }
        for (k, v) in volts.iter_mut().enumerate() {
            let along = (place.record as f64 + k as f64 / place.samples as f64) / place.records as f64;
            *v = self.detector.sensitivity_v_per_m * *v + drift.offset_v(along);
        }
        let lost = Lost::new(effects, self.sample_rate_hz);
        if !effects.added.is_empty() {
            for (k, v) in volts.iter_mut().enumerate() {
                let time_s = lost.taken(k) as f64 / self.sample_rate_hz;
                let instant = place.instant(time_s, ramp.height_m(ramp.half_cycle(time_s), time_s));
                *v += effects.added.iter().map(|added| added(&instant)).sum::<f64>();
            }
        }
        self.noise.add_random(&mut volts, self.sample_rate_hz, &mut stream(place.seed, place.record, Stream::Readout));
        if let Some((low, high)) = effects.limits {
            volts.iter_mut().for_each(|v| *v = v.max(low).min(high));
        }
        volts.into_iter().map(|v| self.adc.code(v)).collect()
    }

    fn piezo_codes(&self, ramp: &TriangleRamp, place: Place, lost: &Lost) -> Vec<i16> {
        let adc = Adc { bits: 16, lsb_v: self.monitor.lsb_v };
        let mut rng = stream(place.seed, place.record, Stream::Monitor);
        (0..place.samples)
            .map(|k| {
                let time_s = lost.taken(k) as f64 / self.sample_rate_hz;
                let deviate: f64 = StandardNormal.sample(&mut rng);
                let volts = ramp.height_m(ramp.half_cycle(time_s), time_s) / self.monitor.m_per_v;
                adc.code(volts + self.monitor.white_v * deviate)
            })
            .collect()
    }

    fn recorded(&self, events: &[ContactEvent], place: Place, delay_s: f64, lost: &Lost) -> Vec<RecordedEvent> {
        let (margin, samples) = (place.margin_samples as f64, place.samples as f64);
        let at = |event: &ContactEvent| lost.stored((event.time_s + delay_s) * self.sample_rate_hz);
        events
            .iter()
            .enumerate()
            .map(|(i, event)| {
                let sample = at(event);
                let near_another = i > 0 && sample - at(&events[i - 1]) < margin
                    || events.get(i + 1).is_some_and(|next| at(next) - sample < margin);
                let inside = sample >= margin && sample <= samples - margin;
                RecordedEvent { event: *event, sample, counted: inside && !near_another }
            })
            .collect()
    }
}

/// `start_s` shifted by the record's own draw of the jitter.
fn jittered(start_s: f64, jitter_s: f64, place: Place) -> f64 {
    if jitter_s == 0.0 {
        return start_s;
    }
    let deviate: f64 = StandardNormal.sample(&mut stream(place.seed, place.record, Stream::Jitter));
    start_s + jitter_s * deviate
}

/// Samples that were taken and never stored: the place of each gap among the stored ones, and its length.
struct Lost(Vec<(usize, usize)>);

impl Lost {
    fn new(effects: &Effects, sample_rate_hz: f64) -> Self {
        let mut gaps: Vec<(usize, usize)> = effects
            .lost
            .iter()
            .map(|(time_s, count)| ((time_s * sample_rate_hz).max(0.0) as usize, *count as usize))
            .collect();
        gaps.sort_unstable();
        Self(gaps)
    }

    fn total(&self) -> usize {
        self.0.iter().map(|(_, count)| count).sum()
    }

    /// Number among the taken samples of stored sample `k`.
    fn taken(&self, k: usize) -> usize {
        k + self.0.iter().filter(|(at, _)| *at <= k).map(|(_, count)| count).sum::<usize>()
    }

    /// Place among the stored samples of place `taken` among the taken ones; inside a gap, the gap's.
    fn stored(&self, taken: f64) -> f64 {
        self.0.iter().rev().fold(taken, |taken, (at, count)| {
            let at = *at as f64;
            if taken <= at { taken } else { (taken - *count as f64).max(at) }
        })
    }

    fn drop_from(&self, values: &mut Vec<f64>) {
        for (at, count) in self.0.iter().rev() {
            let end = (at + count).min(values.len());
            values.drain((*at).min(end)..end);
        }
    }
}

impl Place {
    /// A time of this record.
    pub fn instant(&self, time_s: f64, piezo_m: f64) -> Instant {
        let last = self.records.saturating_sub(1).max(1);
        Instant { record: self.record, place: self.record as f64 / last as f64, time_s, piezo_m }
    }
}

/// A standard normal deviate cut at `limit` by rejection.
fn within(limit: f64, rng: &mut ChaCha8Rng) -> f64 {
    loop {
        let deviate: f64 = StandardNormal.sample(rng);
        if deviate.abs() <= limit {
            return deviate;
        }
    }
}

/// Counted events of one kind over an archive.
pub fn counted<'a>(records: impl IntoIterator<Item = &'a [RecordedEvent]>, kind: EventKind) -> usize {
    records.into_iter().flatten().filter(|e| e.counted && e.event.kind == kind).count()
}
