//! `mode-shapes`: complex shapes over the channels, and modes with their shapes as `show` gives them.

use afmid_kernels::ringdown::{ModeEstimate, ModeShape, ShapePoint};
use afmid_pipeline::{Array, Axis};
use num_complex::Complex64;
use serde_json::{Value, json};

use super::mode_document;

/// Shapes relative to their largest channel, and the modal assurance criterion between them.
pub(crate) fn shape_array(shapes: &[&ModeShape], channels: &[&str]) -> Array {
    let numbers = |count: usize| (1..=count).map(|k| k as f64).collect();
    let points = || shapes.iter().flat_map(|shape| &shape.points);
    let (over, pairs) = (&["mode", "channel"], &["mode", "other_mode"]);
    let mac: Vec<f64> = shapes.iter().flat_map(|one| shapes.iter().map(|other| one.mac(other))).collect();
    let std = |of: fn(&ShapePoint) -> f64| points().map(of).collect::<Vec<f64>>();
    Array::over(vec![
        Axis::new("mode", "1", "number of the mode", numbers(shapes.len())),
        Axis::new("channel", "1", "number of the channel", numbers(channels.len())),
        Axis::new("other_mode", "1", "number of the other mode", numbers(shapes.len())),
    ])
    .with(
        "shape",
        "1",
        "amplitude and phase relative to the largest channel",
        over,
        points().map(|point| Complex64::new(point.value.re, point.value.im)).collect::<Vec<_>>(),
    )
    .with("re_std", "1", "standard error of its real part", over, std(ShapePoint::re_std))
    .with("im_std", "1", "standard error of its imaginary part", over, std(ShapePoint::im_std))
    .with("mac", "1", "modal assurance criterion: 1 for shapes that are alike", pairs, mac)
    .attribute("channels", channels.join("\n"))
}

/// A mode as `show --json` gives it; its shape where there are several channels.
pub(crate) fn shaped_mode(mode: &ModeEstimate, shape: &ModeShape, channels: &[&str]) -> Value {
    let mut document = mode_document(mode);
    if channels.len() > 1 {
        let point = |(channel, point): (&&str, &ShapePoint)| {
            json!({
                "channel": channel,
                "re": point.value.re,
                "im": point.value.im,
                "re_std": point.re_std(),
                "im_std": point.im_std(),
            })
        };
        document["shape"] = channels.iter().zip(&shape.points).map(point).collect::<Vec<Value>>().into();
    }
    document
}
