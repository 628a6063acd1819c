//! What an export states of modes with their shapes.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use num_complex::Complex64;
use serde::Deserialize;
use serde_json::Value;

use super::Origin;

/// Modes with their shapes over degrees of freedom.
#[derive(Debug)]
pub struct ExportedShapes {
    /// `pipeline: stage (uses)`.
    pub source: String,
    /// The program that identified them.
    pub program: String,
    /// Ascending in frequency.
    pub modes: Vec<ExportedMode>,
    /// Where each value of a shape belongs.
    pub places: Vec<Place>,
    /// Names of the values that are not their nodes' numbers; empty: they are.
    pub names: Vec<String>,
    /// Whether every direction is stated; one that is not counts as z.
    pub directions_stated: bool,
    /// Of each node along the structure, m; empty where one is not known.
    pub position_m: BTreeMap<u32, f64>,
}

/// A node and what moves there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// From 1.
    pub node: u32,
    /// 0 to 5: x, y, z and rotations about them.
    pub degree: usize,
}

/// A mode.
#[derive(Debug)]
pub struct ExportedMode {
    /// |s| / 2 pi.
    pub frequency_hz: f64,
    /// Share of critical damping.
    pub damping_ratio: f64,
    /// s, rad/s.
    pub eigenvalue: Complex64,
    /// `a = 2 i w_d m`, with m the modal mass of the shape as it is scaled; zero where that is not known.
    pub modal_a: Complex64,
    /// `b = -s a`.
    pub modal_b: Complex64,
    /// Relative to the largest, in the order of the places.
    pub shape: Vec<Complex64>,
}

/// Why there is nothing to export.
#[derive(Debug, thiserror::Error)]
pub enum ShapesError {
    /// One channel has no shape.
    #[error("its modes have no shapes: they are of one channel")]
    OneChannel,
    /// Pairs of points.
    #[error("its shapes are over pairs of several outputs and several inputs: no mode shapes")]
    Pairs,
    /// Damaged, or of another program.
    #[error("its summary does not list modes with shapes: {0}")]
    Unlike(String),
    /// Not in the file's columns.
    #[error("mode {0} has numbers that are not known or beyond 1e99")]
    Number(usize),
}

#[derive(Deserialize)]
struct StatedMode {
    frequency_hz: f64,
    damping_ratio: f64,
    #[serde(default)]
    shape: Vec<StatedValue>,
    mass_normalised: Option<Vec<StatedNormalised>>,
}

#[derive(Deserialize)]
struct StatedValue {
    channel: String,
    re: f64,
    im: f64,
}

#[derive(Deserialize)]
struct StatedNormalised {
    value: Option<f64>,
}

#[derive(Deserialize)]
struct StatedPoint {
    point: String,
    direction: String,
    position_m: Option<f64>,
}

impl ExportedShapes {
    /// Describes what the summary of a stage states, as `show --json` has it.
    pub fn new(summary: &Value, origin: Origin) -> Result<Self, ShapesError> {
        let stated: Vec<StatedMode> = list(summary.get("modes").unwrap_or(&Value::Null))?;
        let channels: Vec<&str> = stated
            .first()
            .map(|mode| mode.shape.iter().map(|value| value.channel.as_str()).collect())
            .unwrap_or_default();
        let points: Vec<StatedPoint> = match summary.get("points") {
            Some(Value::Null) => return Err(ShapesError::Pairs),
            Some(points) => list(points)?,
            None => Vec::new(),
        };
        if channels.is_empty() {
            return Err(ShapesError::OneChannel);
        }
        if stated.iter().any(|mode| mode.shape.len() != channels.len()) {
            return Err(ShapesError::Unlike("shapes of unequal length".to_owned()));
        }
        let points = if points.len() == channels.len() { points } else { Vec::new() };
        let (places, numbered) = places(&points, channels.len());
        Ok(Self {
            source: format!("{}: {} ({})", origin.pipeline, origin.source, origin.uses),
            program: origin.program.to_owned(),
            modes: stated.iter().zip(1..).map(|(mode, number)| mode.exported(number)).collect::<Result<_, _>>()?,
            names: if numbered { Vec::new() } else { channels.iter().map(|&name| name.to_owned()).collect() },
            directions_stated: !points.is_empty() && points.iter().all(|point| degree(&point.direction).is_some()),
            position_m: positions(&points, &places),
            places,
        })
    }
}

fn list<T: for<'a> Deserialize<'a>>(value: &Value) -> Result<Vec<T>, ShapesError> {
    Vec::deserialize(value).map_err(|error| ShapesError::Unlike(error.to_string()))
}

impl StatedMode {
    fn exported(&self, number: usize) -> Result<ExportedMode, ShapesError> {
        let natural = TAU * self.frequency_hz;
        let damped = natural * (1.0 - self.damping_ratio.powi(2)).max(0.0).sqrt();
        let eigenvalue = Complex64::new(-self.damping_ratio * natural, damped);
        let modal_a = Complex64::new(0.0, 2.0 * damped * self.modal_mass().unwrap_or(0.0));
        let mode = ExportedMode {
            frequency_hz: self.frequency_hz,
            damping_ratio: self.damping_ratio,
            eigenvalue,
            modal_a,
            modal_b: -eigenvalue * modal_a,
            shape: self.shape.iter().map(|value| Complex64::new(value.re, value.im)).collect(),
        };
        let all = [mode.eigenvalue, mode.modal_a, mode.modal_b];
        // NaN is no less than anything
        let fits = |value: &Complex64| value.re.abs() < 1e99 && value.im.abs() < 1e99;
        if all.iter().chain(&mode.shape).all(fits) { Ok(mode) } else { Err(ShapesError::Number(number)) }
    }

    /// Of the shape as it is scaled, `1 / phi^2` with phi its largest value's at unit modal mass.
    fn modal_mass(&self) -> Option<f64> {
        let normalised = self.mass_normalised.as_ref()?;
        let size = |value: &StatedValue| value.re.hypot(value.im);
        let largest = (0..self.shape.len()).max_by(|&a, &b| size(&self.shape[a]).total_cmp(&size(&self.shape[b])))?;
        let phi = normalised.get(largest)?.value?;
        (phi != 0.0).then(|| phi.powi(-2))
    }
}

/// Where a value of no stated direction belongs: a beam or plate along x and y moves in z.
const Z: usize = 2;

/// Node numbers that fit the ten columns of every reader.
const MOST_NODES: u32 = 999_999_999;

/// Where the values belong, and whether the points' names are their nodes' numbers. Where points are not known, or two
/// values would share a place, each has a node of its own.
fn places(points: &[StatedPoint], values: usize) -> (Vec<Place>, bool) {
    let stated = numbers(points);
    let numbered = stated.is_some();
    let nodes = stated.unwrap_or_else(|| in_order(points));
    let place = |(node, point): (u32, &StatedPoint)| Place { node, degree: degree(&point.direction).unwrap_or(Z) };
    let places: Vec<Place> = nodes.into_iter().zip(points).map(place).collect();
    if places.len() == values && places.iter().collect::<BTreeSet<&Place>>().len() == values {
        return (places, numbered);
    }
    ((1..).take(values).map(|node| Place { node, degree: Z }).collect(), false)
}

/// The points' names where all are numbers of nodes.
fn numbers(points: &[StatedPoint]) -> Option<Vec<u32>> {
    let number = |name: &str| name.parse().ok().filter(|n: &u32| (1..=MOST_NODES).contains(n) && n.to_string() == name);
    points.iter().map(|point| number(&point.point)).collect()
}

/// Numbers from 1 in the order in which names first appear.
fn in_order(points: &[StatedPoint]) -> Vec<u32> {
    let mut seen: BTreeMap<&str, u32> = BTreeMap::new();
    let mut number = |name| {
        let next = seen.len() as u32 + 1;
        *seen.entry(name).or_insert(next)
    };
    points.iter().map(|point| number(point.point.as_str())).collect()
}

fn degree(direction: &str) -> Option<usize> {
    ["x", "y", "z", "rx", "ry", "rz"].iter().position(|name| *name == direction)
}

/// Positions of all nodes; empty where one is not known.
fn positions(points: &[StatedPoint], places: &[Place]) -> BTreeMap<u32, f64> {
    let fits = |position: &f64| position.abs() < 1e99;
    let of = |(place, point): (&Place, &StatedPoint)| Some((place.node, point.position_m.filter(fits)?));
    places.iter().zip(points).map(of).collect::<Option<_>>().unwrap_or_default()
}
