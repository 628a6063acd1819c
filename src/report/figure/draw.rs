//! Draws one panel: frame, grid, ticks, marks.

use std::fmt::Write;

use super::axis::{Axis, Resolved, TickStyle};
use super::decimate::decimate;
use super::layout::Panel;
use super::mark::{Band, Ellipse, Line, Mark, Marker, Points, Rule, Stroke};
use super::svg::{escape, px};
use crate::printable::printable;

/// Where a panel's plot area lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

/// More markers than this are drawn once per cell of so many pixels.
const MOST_MARKERS: usize = 2_000;
const CELL_PX: f64 = 4.0;

/// Data to pixels.
struct Map {
    frame: Frame,
    x: Resolved,
    y: Resolved,
}

impl Map {
    fn px_x(&self, x: f64) -> Option<f64> {
        self.x.place(x).map(|place| self.frame.left + place * self.frame.width)
    }

    fn px_y(&self, y: f64) -> Option<f64> {
        self.y.place(y).map(|place| self.frame.top + (1.0 - place) * self.frame.height)
    }

    fn point(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.px_x(x)?, self.px_y(y)?))
    }

    fn holds_x(&self, x: f64) -> bool {
        x >= self.frame.left - 0.5 && x <= self.frame.left + self.frame.width + 0.5
    }

    fn holds_y(&self, y: f64) -> bool {
        y >= self.frame.top - 0.5 && y <= self.frame.top + self.frame.height + 0.5
    }
}

/// Draws a panel. `id` names its clip path, `series` gives a series' number in the legend.
pub(super) fn panel(
    out: &mut String,
    panel: &Panel,
    frame: Frame,
    id: &str,
    column_px: f64,
    series: &dyn Fn(&str) -> Option<usize>,
) {
    let (extent_x, extent_y) = extents(panel);
    let resolved = panel.x.resolve(extent_x, 0.0, frame.width).zip(panel.y.resolve(extent_y, 0.06, frame.height * 1.4));
    let Some((x, y)) = resolved else { return empty(out, panel, frame) };
    let mut map = Map { frame, x, y };
    if panel.equal_scales {
        map.frame = equal_scales(&map);
    }
    open(out, panel, &map);
    grid(out, panel, &map);
    let f = map.frame;
    let _ = write!(
        out,
        "<clipPath id=\"{0}\"><rect x=\"{1}\" y=\"{2}\" width=\"{3}\" height=\"{4}\"/></clipPath><g class=\"marks\" clip-path=\"url(#{0})\"><g class=\"zoom\">",
        escape(id),
        px(f.left),
        px(f.top),
        px(f.width),
        px(f.height)
    );
    for mark in &panel.marks {
        let tag = series(mark.series()).map(|index| format!("data-series=\"{index}\"")).unwrap_or_default();
        match mark {
            Mark::Line(value) => line(out, value, &map, column_px, &tag),
            Mark::Band(value) => band(out, value, &map, column_px, &tag),
            Mark::Points(value) => points(out, value, &map, &tag),
            Mark::Ellipse(value) => ellipse(out, value, &map, &tag),
            Mark::Rule(_) => {}
        }
    }
    out.push_str("</g></g>");
    out.push_str("<g class=\"rules\">");
    rules(out, panel, &map);
    out.push_str("</g></g>");
}

fn open(out: &mut String, panel: &Panel, map: &Map) {
    let f = map.frame;
    let axis = |axis: &Axis, resolved: &Resolved| {
        let style = match axis.style {
            TickStyle::Plain => "plain",
            TickStyle::Prefixed => "prefixed",
            TickStyle::Degrees => "degrees",
            TickStyle::Whole => "whole",
        };
        let unit = if axis.style == TickStyle::Prefixed { &axis.unit } else { &resolved.unit };
        serde_json::json!({
            "label": printable(&axis.label), "unit": printable(unit), "factor": resolved.factor, "style": style, "bare": axis.hide_labels,
            "log": resolved.log, "low": resolved.low, "high": resolved.high,
        })
    };
    let data = serde_json::json!({
        "left": f.left, "top": f.top, "width": f.width, "height": f.height,
        "x": axis(&panel.x, &map.x), "y": axis(&panel.y, &map.y),
    });
    let _ = write!(out, "<g class=\"panel\" data-panel=\"{}\">", escape(&data.to_string()));
    title(out, panel, f);
    let _ = write!(
        out,
        "<rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
        px(f.left),
        px(f.top),
        px(f.width),
        px(f.height)
    );
}

fn title(out: &mut String, panel: &Panel, f: Frame) {
    if !panel.title.is_empty() {
        let _ = write!(
            out,
            "<text class=\"title\" x=\"{}\" y=\"{}\">{}</text>",
            px(f.left),
            px(f.top - 10.0),
            escape(&panel.title)
        );
    }
}

/// A panel that has nothing to show says so.
fn empty(out: &mut String, panel: &Panel, f: Frame) {
    out.push_str("<g class=\"panel\">");
    title(out, panel, f);
    let _ = write!(
        out,
        "<rect class=\"frame\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/><text class=\"none\" x=\"{}\" y=\"{}\">no finite values</text></g>",
        px(f.left),
        px(f.top),
        px(f.width),
        px(f.height),
        px(f.left + 0.5 * f.width),
        px(f.top + 0.5 * f.height)
    );
}

/// From the least to the greatest value, if there is any.
type Extent = Option<(f64, f64)>;

/// Limits of what can be drawn: pairs of finite values, positive on logarithmic axes.
fn extents(panel: &Panel) -> (Extent, Extent) {
    let fits = |axis: &Axis, value: f64| value.is_finite() && (!axis.log || value > 0.0);
    let inside = |axis: &Axis, value: f64| axis.limits.is_none_or(|(low, high)| value >= low && value <= high);
    let grow = |range: &mut Option<(f64, f64)>, value: f64| {
        *range = Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))));
    };
    let (mut x_range, mut y_range) = (None, None);
    for (xs, ys) in panel.marks.iter().flat_map(Mark::extents) {
        for (&x, &y) in xs.iter().zip(ys) {
            if fits(&panel.x, x) && fits(&panel.y, y) && inside(&panel.x, x) {
                grow(&mut x_range, x);
                grow(&mut y_range, y);
            }
        }
    }
    (x_range, y_range)
}

fn equal_scales(map: &Map) -> Frame {
    let f = map.frame;
    let (span_x, span_y) = (map.x.high - map.x.low, map.y.high - map.y.low);
    let scale = (f.width / span_x).min(f.height / span_y);
    let (width, height) = (scale * span_x, scale * span_y);
    Frame { left: f.left, top: f.top, width, height }
}

fn grid(out: &mut String, panel: &Panel, map: &Map) {
    let f = map.frame;
    let (bottom, right) = (f.top + f.height, f.left + f.width);
    out.push_str("<g class=\"axes\">");
    for tick in &map.x.ticks {
        let Some(x) = map.px_x(tick.value).filter(|x| map.holds_x(*x)) else { continue };
        let class = if tick.label.is_some() { "major" } else { "minor" };
        let _ = write!(out, "<path class=\"{class}\" d=\"M{0},{1} {0},{2}\"/>", px(x), px(bottom), px(f.top));
        if let Some(label) = tick.label.as_ref().filter(|_| !panel.x.hide_labels) {
            let _ = write!(
                out,
                "<text class=\"tick x\" x=\"{}\" y=\"{}\">{}</text>",
                px(x),
                px(bottom + 17.0),
                escape(label)
            );
        }
    }
    for tick in &map.y.ticks {
        let Some(y) = map.px_y(tick.value).filter(|y| map.holds_y(*y)) else { continue };
        let class = if tick.label.is_some() { "major" } else { "minor" };
        let _ = write!(out, "<path class=\"{class}\" d=\"M{0},{1} {2},{1}\"/>", px(f.left), px(y), px(right));
        if let Some(label) = &tick.label {
            let _ = write!(
                out,
                "<text class=\"tick y\" x=\"{}\" y=\"{}\">{}</text>",
                px(f.left - 8.0),
                px(y + 4.0),
                escape(label)
            );
        }
    }
    if !panel.x.hide_labels {
        let (x, y) = (px(f.left + 0.5 * f.width), px(bottom + 38.0));
        let _ = write!(out, "<text class=\"label\" x=\"{x}\" y=\"{y}\">{}</text>", label(&panel.x, &map.x));
    }
    let (x, y) = (px(f.left - 58.0), px(f.top + 0.5 * f.height));
    let _ = write!(
        out,
        "<text class=\"label\" transform=\"translate({x} {y}) rotate(-90)\">{}</text></g>",
        label(&panel.y, &map.y)
    );
}

fn label(axis: &Axis, resolved: &Resolved) -> String {
    let unit = if resolved.unit.is_empty() { String::new() } else { format!(" ({})", resolved.unit) };
    escape(&format!("{}{unit}", axis.label))
}

/// Attributes of a stroked path.
pub(super) fn stroke(stroke: Stroke) -> String {
    let dash = if stroke.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
    format!("class=\"line {}\" stroke-width=\"{}\"{dash}", stroke.colour.class(), px(stroke.width))
}

fn line(out: &mut String, line: &Line, map: &Map, column_px: f64, tag: &str) {
    let runs = decimate(line.x.iter().zip(&line.y).map(|(&x, &y)| map.point(x, y)), column_px);
    if runs.is_empty() {
        return;
    }
    let _ = write!(out, "<path {} {tag} d=\"", stroke(line.stroke));
    for run in runs {
        out.push('M');
        path(out, run.iter());
        if run.len() == 1 {
            // a lone point between gaps: round caps make it a dot
            out.push_str("h0");
        }
    }
    out.push_str("\"/>");
}

fn path<'a>(out: &mut String, points: impl Iterator<Item = &'a (f64, f64)>) {
    for (k, (x, y)) in points.enumerate() {
        let _ = write!(out, "{}{},{}", if k == 0 { "" } else { " " }, px(*x), px(*y));
    }
}

fn band(out: &mut String, band: &Band, map: &Map, column_px: f64, tag: &str) {
    // an edge without a place on a logarithmic axis runs along the panel's bottom
    let bottom = map.frame.top + map.frame.height + 1.0;
    let mut d = String::new();
    let mut columns: Vec<(f64, f64, f64)> = Vec::new();
    let mut flush = |columns: &mut Vec<(f64, f64, f64)>| {
        if columns.len() > 1 {
            d.push('M');
            path(&mut d, columns.iter().map(|(x, low, _)| (*x, *low)).collect::<Vec<_>>().iter());
            d.push(' ');
            path(&mut d, columns.iter().rev().map(|(x, _, high)| (*x, *high)).collect::<Vec<_>>().iter());
            d.push('Z');
        }
        columns.clear();
    };
    let mut column = None;
    for ((&x, &low), &high) in band.x.iter().zip(&band.low).zip(&band.high) {
        let edges = if low.is_finite() { map.px_x(x).zip(map.px_y(high)) } else { None };
        let Some((x, high)) = edges else {
            flush(&mut columns);
            column = None;
            continue;
        };
        let low = map.px_y(low).unwrap_or(bottom);
        let index = (x / column_px).floor() as i64;
        match columns.last_mut() {
            // pixels grow downwards: the band's low edge is the larger one
            Some(last) if column == Some(index) => *last = (last.0, last.1.max(low), last.2.min(high)),
            _ => columns.push((x, low, high)),
        }
        column = Some(index);
    }
    flush(&mut columns);
    if !d.is_empty() {
        let _ = write!(out, "<path class=\"band {}\" {tag} d=\"{d}\"/>", band.colour.class());
    }
}

/// A marker at a place; `attributes` go on its element.
pub(super) fn marker(marker: Marker, class: &str, (x, y): (f64, f64), title: &str) -> String {
    let title = if title.is_empty() { String::new() } else { format!("<title>{}</title>", escape(title)) };
    match marker {
        Marker::Cross => {
            let (l, r, t, b) = (px(x - 4.5), px(x + 4.5), px(y - 4.5), px(y + 4.5));
            format!("<path class=\"mark {class}\" d=\"M{l},{t} {r},{b}M{l},{b} {r},{t}\">{title}</path>")
        }
        Marker::Ring => {
            format!("<circle class=\"mark {class}\" cx=\"{}\" cy=\"{}\" r=\"5\">{title}</circle>", px(x), px(y))
        }
        Marker::Dot => {
            format!("<circle class=\"dot {class}\" cx=\"{}\" cy=\"{}\" r=\"3\">{title}</circle>", px(x), px(y))
        }
    }
}

fn points(out: &mut String, points: &Points, map: &Map, tag: &str) {
    let many = points.x.len() > MOST_MARKERS;
    let mut taken = std::collections::BTreeSet::new();
    let class = points.colour.class();
    let _ = write!(out, "<g {tag}>");
    for (k, (&x, &y)) in points.x.iter().zip(&points.y).enumerate() {
        let Some(place) = map.point(x, y) else { continue };
        if many && !taken.insert(((place.0 / CELL_PX) as i64, (place.1 / CELL_PX) as i64)) {
            continue;
        }
        if let Some(error) = points.y_error.get(k).filter(|error| **error > 0.0)
            && let Some((top, bottom)) = map.px_y(y + error).zip(map.px_y(y - error))
        {
            let (left, right) = (px(place.0 - 3.0), px(place.0 + 3.0));
            let (x, top, bottom) = (px(place.0), px(top), px(bottom));
            let _ = write!(
                out,
                "<path class=\"whisker {class}\" d=\"M{x},{top} {x},{bottom}M{left},{top} {right},{top}M{left},{bottom} {right},{bottom}\"/>"
            );
        }
        out.push_str(&marker(points.marker, class, place, points.titles.get(k).map_or("", String::as_str)));
    }
    out.push_str("</g>");
}

fn ellipse(out: &mut String, ellipse: &Ellipse, map: &Map, tag: &str) {
    let Some((x, y)) = map.point(ellipse.centre.0, ellipse.centre.1) else { return };
    let rx = ellipse.radii.0 * map.frame.width / (map.x.high - map.x.low);
    let ry = ellipse.radii.1 * map.frame.height / (map.y.high - map.y.low);
    if !(rx.is_finite() && ry.is_finite() && rx >= 0.0 && ry >= 0.0 && ellipse.angle_rad.is_finite()) {
        return;
    }
    let class = if ellipse.filled { "band" } else { "outline" };
    let (x, y) = (px(x), px(y));
    let _ = write!(
        out,
        "<ellipse class=\"{class} {}\" {tag} cx=\"{x}\" cy=\"{y}\" rx=\"{}\" ry=\"{}\" transform=\"rotate({} {x} {y})\"/>",
        ellipse.colour.class(),
        px(rx),
        px(ry),
        px(-ellipse.angle_rad.to_degrees())
    );
}

/// Rules, with their words on alternating heights where they would touch.
fn rules(out: &mut String, panel: &Panel, map: &Map) {
    let f = map.frame;
    let mut words: Vec<(usize, f64, f64)> = Vec::new();
    let mut verticals: Vec<&Rule> = Vec::new();
    for mark in &panel.marks {
        let Mark::Rule(rule) = mark else { continue };
        if rule.vertical {
            verticals.push(rule);
        } else if let Some(y) = map.px_y(rule.at).filter(|y| map.holds_y(*y)) {
            let (y_px, right) = (px(y), f.left + f.width);
            let _ = write!(out, "<path class=\"rule\" d=\"M{},{y_px} {},{y_px}\"/>", px(f.left), px(right));
            let _ = write!(
                out,
                "<text class=\"rule-label end\" x=\"{}\" y=\"{}\">{}</text>",
                px(right - 6.0),
                px(y - 5.0),
                escape(&rule.label)
            );
        }
    }
    verticals.sort_by(|a, b| a.at.total_cmp(&b.at));
    for rule in verticals {
        let Some(x) = map.px_x(rule.at).filter(|x| map.holds_x(*x)) else { continue };
        let _ = write!(out, "<path class=\"rule\" d=\"M{0},{1} {0},{2}\"/>", px(x), px(f.top + f.height), px(f.top));
        let width = 6.3 * rule.label.chars().count() as f64 + 8.0;
        let flip = x + width > f.left + f.width;
        let (from, to) = if flip { (x - width, x) } else { (x, x + width) };
        let free = |level: &usize| words.iter().all(|(at, left, right)| at != level || to < *left || from > *right);
        let level = (0..4).find(free).unwrap_or(0);
        words.push((level, from, to));
        let (class, at) = if flip { ("rule-label end", x - 4.0) } else { ("rule-label", x + 4.0) };
        let _ = write!(
            out,
            "<text class=\"{class}\" x=\"{}\" y=\"{}\">{}</text>",
            px(at),
            px(f.top + 14.0 + 14.0 * level as f64),
            escape(&rule.label)
        );
    }
}
