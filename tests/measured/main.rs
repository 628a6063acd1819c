//! The shipped pipelines on recordings, measured or simulated: what they find is what is there.

#[path = "../common/mod.rs"]
mod common;

mod daisy;
mod diagnosis;
mod exam;
mod formats;
mod frf;
mod lever;
mod paper;
mod ringdown;
mod shapes;
mod spectra;
mod system;
