//! What stands in a panel: lines, bands, markers, rules, ellipses.

/// A colour by name: the page's style sheet says which, in light, in dark and on paper (after Okabe and Ito).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Colour {
    Ink,
    Blue,
    Vermillion,
    Green,
    Purple,
    Sky,
    Orange,
    Muted,
}

impl Colour {
    /// Its CSS class.
    pub fn class(self) -> &'static str {
        match self {
            Self::Ink => "ink",
            Self::Blue => "blue",
            Self::Vermillion => "vermillion",
            Self::Green => "green",
            Self::Purple => "purple",
            Self::Sky => "sky",
            Self::Orange => "orange",
            Self::Muted => "muted",
        }
    }

    /// The colour of the `index`-th of many curves.
    pub fn cycle(index: usize) -> Self {
        const ORDER: [Colour; 7] =
            [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple, Colour::Sky, Colour::Orange, Colour::Ink];
        ORDER.get(index % ORDER.len()).copied().unwrap_or(Self::Ink)
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub colour: Colour,
    pub width: f64,
    pub dashed: bool,
}

impl Stroke {
    /// A solid line.
    pub fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashed: false }
    }

    /// A dashed line.
    pub fn dashed(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashed: true }
    }
}

/// A curve; values without a place (NaN, not positive on a logarithmic axis) break it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub series: String,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub stroke: Stroke,
}

/// The area between two curves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Band {
    pub series: String,
    pub x: Vec<f64>,
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    pub colour: Colour,
    /// Whether the axis limits take it in.
    pub fits: bool,
}

/// The shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Marker {
    /// A pole.
    Cross,
    /// A zero.
    Ring,
    /// Anything else.
    Dot,
}

/// Markers, with error bars and a text each where these are given (then as long as `x`).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Points {
    pub series: String,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// Half lengths of the vertical error bars; empty: none.
    pub y_error: Vec<f64>,
    /// What a pointer over the marker reads; empty: nothing.
    pub titles: Vec<String>,
    pub marker: Marker,
    pub colour: Colour,
}

/// A straight line across the panel, with a word at its end.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rule {
    pub at: f64,
    pub vertical: bool,
    pub label: String,
}

/// An ellipse in data coordinates: circles of pole maps, error ellipses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ellipse {
    pub series: String,
    pub centre: (f64, f64),
    /// Half axes; an axis that is not finite or negative draws nothing.
    pub radii: (f64, f64),
    /// Rotation in radians, counterclockwise in data coordinates (equal scales assumed).
    pub angle_rad: f64,
    pub colour: Colour,
    pub filled: bool,
}

/// Anything that stands in a panel. Limits fit lines, bands and points; rules and ellipses never widen them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Mark {
    Line(Line),
    Band(Band),
    Points(Points),
    Rule(Rule),
    Ellipse(Ellipse),
}

impl Mark {
    /// A curve.
    pub fn line(series: &str, x: &[f64], y: &[f64], stroke: Stroke) -> Self {
        Self::Line(Line { series: series.to_owned(), x: x.to_vec(), y: y.to_vec(), stroke })
    }

    /// A vertical rule.
    pub fn at_x(at: f64, label: &str) -> Self {
        Self::Rule(Rule { at, vertical: true, label: label.to_owned() })
    }

    /// A horizontal rule.
    pub fn at_y(at: f64, label: &str) -> Self {
        Self::Rule(Rule { at, vertical: false, label: label.to_owned() })
    }

    /// The series that it belongs to: what the legend lists and toggles.
    pub fn series(&self) -> &str {
        match self {
            Self::Line(line) => &line.series,
            Self::Band(band) => &band.series,
            Self::Points(points) => &points.series,
            Self::Ellipse(ellipse) => &ellipse.series,
            Self::Rule(_) => "",
        }
    }

    /// The coordinates that limits must take in, along x and along y.
    pub(super) fn extents(&self) -> Vec<(&[f64], &[f64])> {
        match self {
            Self::Line(line) => vec![(&line.x, &line.y)],
            Self::Band(band) if band.fits => vec![(&band.x, &band.low), (&band.x, &band.high)],
            Self::Points(points) => vec![(&points.x, &points.y)],
            Self::Band(_) | Self::Rule(_) | Self::Ellipse(_) => Vec::new(),
        }
    }
}
