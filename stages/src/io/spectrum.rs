//! The stage `io.spectrum`.

use std::path::{Path, PathBuf};

use afmid_kernels::spectra::averages_by_scatter;
use afmid_pipeline::recording::{
    InputFiles, Reading, WholeFile, hertz, is_hdf5_file, read_number_attribute, read_series,
};
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Array, Context, Example, Faults, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::file_patterns::matching_files;
use super::shared_data::moved;
use crate::artifacts::NewDensity;

/// Opens a power spectral density that another program has averaged and stored.
///
/// # Model
/// Two one-dimensional HDF5 datasets, or channels of a file of any other format such as columns of a table, of one
/// length: frequencies, equally spaced and ascending, and the one-sided density at them. Each value is the mean of
/// `averages` independent periodograms.
/// # Method
/// Both are read and checked; frequencies outside the range are left out. Nothing is rescaled but by `scale`.
/// # Shapes
/// One value per frequency.
/// # Units
/// Hz; the density in `unit`, squared, per hertz, as stored times `scale`.
/// # Accuracy
/// `standard_error` is the density over the square root of the number of averages.
/// # Errors
/// No such file or dataset; lengths that differ; frequencies that do not ascend in equal steps; a density that is not
/// positive; no number of averages, and no scatter to estimate it from.
/// # Source
/// P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70, for the scatter of an average.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Spectrum {
    /// The file, relative to the config file. A path that begins with `../../shared/data/` begins at the variable
    /// `AFMID_DATA` where that is set. Required.
    pub file: String,
    /// Dataset or channel of the frequencies, in Hz.
    pub frequency: String,
    /// Dataset or channel of the one-sided density.
    pub density: String,
    /// Unit of the signal whose density it is.
    pub unit: String,
    /// Factor from the stored density to `unit`^2/Hz. Why: 0.5 for a density that has been doubled once too often.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub scale: f64,
    /// Independent spectra that were averaged. Absent: the attribute `n_avg` of the density's dataset or of the file;
    /// without it what the scatter of neighbouring values shows, with a warning.
    #[schemars(range(min = 1.0, max = 1e9))]
    pub averages: Option<f64>,
    /// Frequencies below are left out, in Hz.
    #[schemars(range(min = 0.0))]
    pub lowest_hz: f64,
    /// Frequencies above are left out, in Hz.
    pub highest_hz: Option<f64>,
}

impl Default for Spectrum {
    fn default() -> Self {
        Self {
            file: String::new(),
            frequency: "/x".to_owned(),
            density: "/y".to_owned(),
            unit: "V".to_owned(),
            scale: 1.0,
            averages: None,
            lowest_hz: 0.0,
            highest_hz: None,
        }
    }
}

/// What `spectrum.thermal` takes.
pub(crate) const DENSITY: Port<Array> = Port::new(
    "density",
    "power-density",
    "one-sided power spectral density over frequency, with its number of averages",
);

impl Stage for Spectrum {
    const SPEC: Spec = Spec {
        name: "io.spectrum",
        version: 2,
        summary: "opens a stored power spectral density",
        inputs: &[],
        outputs: &[DENSITY.spec()],
        source: "P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        for (name, value) in [("file", &self.file), ("frequency", &self.frequency), ("density", &self.density)] {
            faults.require(!value.is_empty(), || format!("`{name}` is empty"));
        }
        let (lowest, highest) = (self.lowest_hz, self.highest_hz.unwrap_or(f64::INFINITY));
        faults.require(highest > lowest, || {
            format!("frequencies from {lowest} to {highest} Hz, wanted `lowest_hz` from 0 and below `highest_hz`")
        });
    }

    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let root = std::env::var_os("AFMID_DATA");
        let files = matching_files(&[moved(&self.file, root.as_deref().map(Path::new))], base, files)?;
        Ok(files.into_iter().map(|file| file.path).collect())
    }

    fn location_params() -> &'static [&'static str] {
        &["file"]
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let paths = self.sources(cx.base(), cx.files())?;
        let [path] = &paths[..] else {
            return Err(StageError::new(format!("`file` matches {} files, wanted one", paths.len())));
        };
        let hdf5 = is_hdf5_file(path)?;
        let (f, p) = match hdf5 {
            true => (read_series(cx.files(), path, &self.frequency)?, read_series(cx.files(), path, &self.density)?),
            false => self.channels(cx.files(), path).map_err(|error| error.at(path))?,
        };
        check_spectrum(&f, &p).map_err(|error| error.at(path))?;
        let averages = match self.averages {
            None if hdf5 => self.stored_averages(cx.files(), path)?,
            given => given,
        };
        let density = self.density(f, p, averages, cx).map_err(|error| error.at(path))?;
        Ok(Ports::new().with(&DENSITY, density))
    }

    fn examples() -> Vec<Example> {
        super::spectrum_example::examples()
    }
}

/// What the stage hands on of a density at hand, and what it warns of. Errors: as the stage.
pub fn density_of_values(
    frequency_hz: Vec<f64>,
    density: Vec<f64>,
    wanted: &Spectrum,
) -> Result<(Array, Vec<String>), StageError> {
    check_spectrum(&frequency_hz, &density)?;
    let cx = Context::new(Path::new(""), 1, &NoProgress);
    let density = wanted.density(frequency_hz, density, wanted.averages, &cx)?;
    Ok((density, cx.into_warnings()))
}

impl Spectrum {
    /// What lies between the limits, in its unit; of so many averages, or of as many as its scatter shows. Errors: nothing
    /// lies there; no scatter.
    fn density(&self, f: Vec<f64>, p: Vec<f64>, averages: Option<f64>, cx: &Context) -> Result<Array, StageError> {
        let averages = match averages {
            Some(averages) => averages,
            None => scattered_averages(&p, cx)?,
        };
        let highest = self.highest_hz.unwrap_or(f64::INFINITY);
        let inside = |f: f64| f >= self.lowest_hz && f <= highest;
        let (f, p): (Vec<f64>, Vec<f64>) =
            f.into_iter().zip(p).filter(|(f, _)| inside(*f)).map(|(f, p)| (f, p * self.scale)).unzip();
        match f.is_empty() {
            true => Err(StageError::new("no frequency between `lowest_hz` and `highest_hz`")),
            false => Ok(density_array(f, p, averages, &self.unit)),
        }
    }

    /// Frequencies in hertz and density of a file that is not HDF5.
    fn channels(&self, files: &InputFiles, path: &Path) -> Result<(Vec<f64>, Vec<f64>), StageError> {
        let file = WholeFile::open(files, path, &Reading::of("auto", None))?;
        let channels = &file.contents().channels;
        let bare = |name: &str| name.strip_prefix('/').unwrap_or(name).to_owned();
        let named = |name: &str| {
            let found = channels.iter().find(|channel| bare(&channel.location) == bare(name));
            found.ok_or_else(|| {
                let names: Vec<&str> = channels.iter().take(20).map(|channel| channel.location.as_str()).collect();
                StageError::new(format!("there is no channel `{name}`; the file has: {}", names.join(", ")))
            })
        };
        let (frequency, density) = (named(&self.frequency)?, named(&self.density)?);
        let unit_hz = hertz(&frequency.unit).unwrap_or(1.0);
        let f = file.read(frequency)?.into_iter().map(|f| f * unit_hz).collect();
        Ok((f, file.read(density)?))
    }

    fn stored_averages(&self, files: &InputFiles, path: &Path) -> Result<Option<f64>, StageError> {
        const NAME: &str = "n_avg";
        for location in [self.density.as_str(), "/"] {
            match read_number_attribute(files, path, location, NAME)? {
                Some(n) if n.is_finite() && n >= 1.0 => return Ok(Some(n)),
                Some(n) => {
                    return Err(StageError::new(format!("{location}: `{NAME}` is {n}, wanted 1 or more")).at(path));
                }
                None => {}
            }
        }
        Ok(None)
    }
}

/// The number of averages that neighbouring values show. Errors: they do not scatter.
fn scattered_averages(density: &[f64], cx: &Context) -> Result<f64, StageError> {
    let help = "set `averages` to the number of independent spectra in the mean";
    let unknown = || StageError::new("the file does not state how many spectra were averaged").help(help);
    let found = averages_by_scatter(density).ok_or_else(unknown)?;
    cx.warn(format!(
        "the file does not state how many spectra were averaged: {found:.0} by the scatter of neighbouring values, \
         on which the stated errors depend; {help}"
    ));
    Ok(found)
}

/// A density as `spectrum.thermal` takes it.
fn density_array(frequency_hz: Vec<f64>, density: Vec<f64>, averages: f64, unit: &str) -> Array {
    let standard_error: Vec<f64> = density.iter().map(|p| p / averages.sqrt()).collect();
    NewDensity { frequency_hz, density, standard_error, averages, signal_unit: unit, error_if: "" }.array()
}

fn check_spectrum(f: &[f64], p: &[f64]) -> Result<(), StageError> {
    if f.len() != p.len() || f.len() < 2 {
        return Err(StageError::new(format!(
            "{} frequencies and {} densities, wanted as many, two or more",
            f.len(),
            p.len()
        )));
    }
    let step = (f[f.len() - 1] - f[0]) / (f.len() - 1) as f64;
    // NaN fails both comparisons
    let even = |pair: &[f64]| (pair[1] - pair[0] - step).abs() <= 1e-3 * step;
    if let Some(at) = f.windows(2).position(|pair| !even(pair)) {
        return Err(StageError::new(format!(
            "the frequencies {} and {} Hz, number {at} and the next, are not one step of {step} Hz apart",
            f[at],
            f[at + 1]
        )));
    }
    match p.iter().position(|p| !(p.is_finite() && *p > 0.0)) {
        Some(at) => Err(StageError::new(format!("the density at {} Hz is {}, wanted above zero", f[at], p[at]))
            .help("a first bin that is zero: set `lowest_hz`")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spectra_that_no_fit_could_use_are_refused() {
        assert!(check_spectrum(&[1.0, 2.0, 3.0], &[1.0, 1.0, 1.0]).is_ok());
        for (f, p, said) in [
            (vec![1.0, 2.0], vec![1.0], "1 densities"),
            (vec![1.0, 2.0, 4.0], vec![1.0; 3], "not one step"),
            (vec![1.0, f64::NAN, 3.0], vec![1.0; 3], "not one step"),
            (vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 1.0], "at 0 Hz is 0"),
        ] {
            let error = check_spectrum(&f, &p).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    #[test]
    fn parameters_are_checked_alone() {
        let good = Spectrum { file: "a.h5".to_owned(), ..Spectrum::default() };
        assert!(afmid_pipeline::stage::check(&good).is_ok());
        assert!(afmid_pipeline::stage::check(&Spectrum::default()).is_err());
        assert!(afmid_pipeline::stage::check(&Spectrum { scale: 0.0, ..good.clone() }).is_err());
        assert!(afmid_pipeline::stage::check(&Spectrum { averages: Some(0.5), ..good.clone() }).is_err());
        assert!(afmid_pipeline::stage::check(&Spectrum { highest_hz: Some(0.0), ..good }).is_err());
    }
}
