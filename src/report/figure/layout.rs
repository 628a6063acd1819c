//! Figures: rows of panels under one legend.

use std::fmt::Write;

use super::axis::Axis;
use super::draw::{self, Frame};
use super::mark::{Mark, Marker, Stroke};
use super::svg::{escape, px};

/// Width of every figure in its own units; the page scales it.
pub(super) const WIDTH: f64 = 1000.0;
const MARGIN_LEFT: f64 = 74.0;
// half of a label such as `140 kHz` at the right end
const MARGIN_RIGHT: f64 = 26.0;
const MARGIN_TOP: f64 = 30.0;
const MARGIN_BOTTOM: f64 = 48.0;
const MARGIN_BOTTOM_BARE: f64 = 10.0;
const LEGEND_ROW: f64 = 24.0;

/// A panel: two axes and what stands between them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub marks: Vec<Mark>,
    /// One data unit is as long along x as along y.
    pub equal_scales: bool,
}

impl Panel {
    /// An empty panel.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.to_owned(), x, y, marks: Vec::new(), equal_scales: false }
    }

    /// Adds a mark; later ones lie on top.
    pub fn with(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }
}

/// Panels side by side.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Height of the plot areas.
    pub height: f64,
    /// Panels with their shares of the width.
    pub panels: Vec<(f64, Panel)>,
}

impl Row {
    /// One panel over the whole width.
    pub fn one(height: f64, panel: Panel) -> Self {
        Self { height, panels: vec![(1.0, panel)] }
    }
}

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Figure {
    /// Unique on the page; letters, digits and hyphens. The file name of an exported figure.
    pub id: String,
    /// What it shows, in a few words.
    pub title: String,
    /// What to see in it.
    pub caption: String,
    pub rows: Vec<Row>,
    /// Width of a column of pixels within which curves are decimated.
    pub column_px: f64,
}

/// A name as part of a figure's id: what is not a letter, digit or hyphen becomes a hyphen.
pub(crate) fn slug(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

impl Figure {
    /// A figure without panels.
    pub fn new(id: &str, title: &str, caption: &str) -> Self {
        Self {
            id: id.to_owned(),
            title: title.to_owned(),
            caption: caption.to_owned(),
            rows: Vec::new(),
            column_px: 0.5,
        }
    }

    /// Adds a row of panels.
    pub fn row(mut self, row: Row) -> Self {
        self.rows.push(row);
        self
    }

    /// The picture as an `svg` element for a page that brings the style sheet.
    pub fn svg(&self) -> String {
        self.write("")
    }

    /// The picture as a file of its own, with `style` inside.
    pub fn standalone(&self, style: &str) -> String {
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", self.write(style))
    }

    fn write(&self, style: &str) -> String {
        let keys = legend(&self.rows);
        let (legend_svg, legend_height) = draw_legend(&keys);
        let mut body = String::new();
        let mut top = legend_height;
        let mut index = 0;
        for row in &self.rows {
            let bottom = if row.panels.iter().all(|(_, panel)| panel.x.hide_labels) {
                MARGIN_BOTTOM_BARE
            } else {
                MARGIN_BOTTOM
            };
            let shares: f64 = row.panels.iter().map(|(share, _)| share).sum();
            let mut left = 0.0;
            for (share, panel) in &row.panels {
                let width = WIDTH * share / shares;
                let frame = Frame {
                    left: left + MARGIN_LEFT,
                    top: top + if panel.title.is_empty() { 10.0 } else { MARGIN_TOP },
                    width: (width - MARGIN_LEFT - MARGIN_RIGHT).max(1.0),
                    height: row.height,
                };
                let series = |name: &str| keys.iter().position(|key| key.series == name);
                draw::panel(&mut body, panel, frame, &format!("{}-{index}", self.id), self.column_px, &series);
                left += width;
                index += 1;
            }
            let titled = row.panels.iter().any(|(_, panel)| !panel.title.is_empty());
            top += row.height + bottom + if titled { MARGIN_TOP } else { 10.0 };
        }
        let mut out = String::with_capacity(body.len() + 1024);
        let (width, height) = (px(WIDTH), px(top));
        // size attributes serve viewers of the exported file; in the page the style sheet scales the figure
        let _ = write!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"figure\" id=\"{}\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            escape(&self.id),
            escape(&self.title)
        );
        if !style.is_empty() {
            let _ = write!(
                out,
                "<title>{}</title><style>{style}</style><rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>",
                escape(&self.title)
            );
        }
        let _ = write!(out, "{legend_svg}{body}</svg>");
        out
    }
}

/// An entry of the legend: how the marks of one series look.
struct Key<'a> {
    series: &'a str,
    line: Option<Stroke>,
    band: Option<&'static str>,
    marker: Option<(Marker, &'static str)>,
}

fn legend(rows: &[Row]) -> Vec<Key<'_>> {
    let mut keys: Vec<Key<'_>> = Vec::new();
    for mark in rows.iter().flat_map(|row| &row.panels).flat_map(|(_, panel)| &panel.marks) {
        let series = mark.series();
        if series.is_empty() {
            continue;
        }
        let at = keys.iter().position(|key| key.series == series).unwrap_or(keys.len());
        if at == keys.len() {
            keys.push(Key { series, line: None, band: None, marker: None });
        }
        let Some(key) = keys.get_mut(at) else { continue };
        match mark {
            Mark::Line(line) => key.line = key.line.or(Some(line.stroke)),
            Mark::Band(band) => key.band = Some(band.colour.class()),
            Mark::Points(points) => key.marker = Some((points.marker, points.colour.class())),
            Mark::Ellipse(ellipse) => key.line = key.line.or(Some(Stroke::solid(ellipse.colour, 1.2))),
            Mark::Rule(_) => {}
        }
    }
    keys
}

/// Draws the legend in as many rows as it needs and says how high it is.
fn draw_legend(keys: &[Key<'_>]) -> (String, f64) {
    let mut out = String::new();
    let (mut x, mut y) = (MARGIN_LEFT, 14.0);
    for (index, key) in keys.iter().enumerate() {
        // the average character of a 12.5 px text is about 6.6 px wide
        let width = 30.0 + 6.6 * key.series.chars().count() as f64 + 18.0;
        if x + width > WIDTH && x > MARGIN_LEFT {
            (x, y) = (MARGIN_LEFT, y + LEGEND_ROW);
        }
        let _ = write!(out, "<g class=\"key\" data-key=\"{index}\" transform=\"translate({} {})\">", px(x), px(y));
        let _ = write!(out, "<rect class=\"hit\" x=\"-4\" y=\"-12\" width=\"{}\" height=\"24\"/>", px(width - 8.0));
        if let Some(class) = key.band {
            let _ = write!(out, "<rect class=\"band {class}\" x=\"0\" y=\"-6\" width=\"22\" height=\"12\"/>");
        }
        if let Some(stroke) = key.line {
            // a hair of a line shows no colour on so short a piece
            let stroke = Stroke { width: stroke.width.max(1.6), ..stroke };
            let _ = write!(out, "<path {} d=\"M0,0 22,0\"/>", draw::stroke(stroke));
        }
        if let Some((marker, class)) = key.marker {
            out.push_str(&draw::marker(marker, class, (11.0, 0.0), ""));
        }
        let _ = write!(out, "<text x=\"29\" y=\"4.2\">{}</text></g>", escape(key.series));
        x += width;
    }
    (out, if keys.is_empty() { 0.0 } else { y + 12.0 })
}
