//! MATLAB files of level 5, as far as a model needs them: real and complex matrices, text, cells, structs. Nothing is
//! compressed, and no time is kept: same model, same bytes.
//!
//! Source: MathWorks, MAT-File Format (R2024b), chapter "Level 5 MAT-File Format".

mod element;
mod layout;
mod value;

pub use layout::{TITLE, model_mat};
