//! Small stages for tests of configs and graphs.

use afmid_pipeline::{
    Array, Axis, Caching, Context, Entry, Example, Faults, Port, Ports, Registry, Spec, Stage, StageError, Table,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

const SIGNAL: Port<Array> = Port::new("signal", "signal", "samples of a sine");
const CLEAN: Port<Array> = Port::new("clean", "signal", "the signal without noise");
const NOISE: Port<Array> = Port::new("noise", "signal", "the noise alone");
const PEAKS: Port<Table> = Port::new("peaks", "peaks", "where the signal peaks");
const MARKS: Port<Table> = Port::new("marks", "marks", "marks set by hand");
const ANY: Port<Table> = Port::new("table", "", "any table");
const WEIGHTS: Port<Table> = Port::optional("weights", "marks", "weights, if there are any");

/// A sine.
///
/// Method: samples of `amplitude_v * sin(2 pi k / 8)`.
///
/// Shapes: `samples` values.
///
/// Units: volts.
///
/// Accuracy: rounding.
///
/// Errors: no samples.
///
/// Source: any textbook.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Sine {
    /// How many samples. Why: two periods.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub samples: usize,
    /// Amplitude in V.
    pub amplitude_v: f64,
    /// What becomes of the first sample.
    pub start: Start,
    /// Noise that is added.
    pub noise: Noise,
    /// Values that are put in, in order.
    pub spikes_v: Vec<f64>,
}

/// How a sine begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At zero.
    AtZero,
    /// At its maximum.
    AtPeak,
}

/// Noise.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Standard deviation in V.
    pub std_v: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self { std_v: 0.0 }
    }
}

impl Default for Sine {
    fn default() -> Self {
        Self { samples: 16, amplitude_v: 1.0, start: Start::AtZero, noise: Noise::default(), spikes_v: Vec::new() }
    }
}

impl Stage for Sine {
    const SPEC: Spec = Spec {
        name: "test.sine",
        version: 1,
        summary: "a sine",
        inputs: &[],
        outputs: &[SIGNAL.spec()],
        caching: Caching::Always,
        seeded: false,
        source: "any textbook",
    };

    fn check(&self, faults: &mut Faults) {
        let some = self.amplitude_v != 0.0 || self.noise.std_v != 0.0;
        faults.require(some, || "a sine without amplitude or noise is no signal".to_owned());
    }

    fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let phase = if self.start == Start::AtPeak { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let value = |k: usize| self.amplitude_v * (k as f64 * std::f64::consts::FRAC_PI_4 + phase).sin();
        let times = Axis::new("time", "s", "time", (0..self.samples).map(|k| k as f64).collect());
        let values: Vec<f64> = (0..self.samples).map(value).collect();
        Ok(Ports::new().with(&SIGNAL, Array::over(vec![times]).with("signal", "V", "sine", &["time"], values)))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Half the amplitude",
            params: "amplitude_v = 0.5",
            inputs: || Ok(Ports::new()),
            expect: |outputs| {
                let values =
                    outputs.get(&SIGNAL).and_then(|array| array.real("signal")).map_err(|error| error.to_string())?;
                let peak = values.iter().copied().fold(0.0, f64::max);
                // two roundings of values near 1
                if (peak - 0.5).abs() < 4.0 * f64::EPSILON {
                    Ok(format!("The peak is {peak:.3} V."))
                } else {
                    Err(format!("peak {peak}"))
                }
            },
        }]
    }
}

macro_rules! passive {
    ($stage:ident, $name:literal, $inputs:expr, $outputs:expr) => {
        /// A stage that is only wired, never run.
        #[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $stage {}

        impl Stage for $stage {
            const SPEC: Spec = Spec {
                name: $name,
                version: 1,
                summary: "only wired, never run",
                inputs: $inputs,
                outputs: $outputs,
                caching: Caching::Always,
                seeded: false,
                source: "none",
            };

            fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
                Err(StageError::new("this stage is only wired, never run"))
            }

            fn examples() -> Vec<Example> {
                Vec::new()
            }
        }
    };
}
passive!(Split, "test.split", &[SIGNAL.spec()], &[CLEAN.spec(), NOISE.spec()]);
passive!(Peaks, "test.peaks", &[SIGNAL.spec(), WEIGHTS.spec()], &[PEAKS.spec()]);
passive!(Count, "test.count", &[ANY.spec()], &[MARKS.spec()]);

/// A stage with a parameter that has no default.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// The files.
    pub files: Vec<String>,
    /// The channel.
    pub channel: String,
}

impl Stage for Load {
    const SPEC: Spec = Spec {
        name: "test.load",
        version: 1,
        summary: "needs files",
        inputs: &[],
        outputs: &[SIGNAL.spec()],
        caching: Caching::Always,
        seeded: false,
        source: "none",
    };

    fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        Err(StageError::new("this stage is only wired, never run"))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// All of them.
pub fn registry() -> Registry {
    let entries =
        [Entry::of::<Sine>(), Entry::of::<Split>(), Entry::of::<Peaks>(), Entry::of::<Count>(), Entry::of::<Load>()];
    Registry::new().with(&entries).expect("names are unique")
}
