//! Figures as SVG text: panels with linear and logarithmic axes, lines, bands, markers and a legend.
//!
//! Colours are CSS classes, so that one picture follows the page into dark mode and onto paper; every panel carries its
//! axes as `data-` attributes and every mark its series, which is what the page's script needs for readouts and toggled
//! curves. Lines are decimated to what a screen can show, peaks kept.

mod axis;
mod decimate;
mod draw;
mod layout;
mod mark;
mod svg;
mod ticks;

pub(crate) use axis::{Axis, pretty_unit};
pub(crate) use layout::{Figure, Panel, Row, slug};
pub(crate) use mark::{Band, Colour, Ellipse, Line, Mark, Marker, Points, Stroke};
pub(crate) use svg::superscript;

#[cfg(test)]
pub(crate) mod tests;
