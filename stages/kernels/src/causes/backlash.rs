//! A drive train with play.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// What acts follows the input at a distance of at most `width`, and rests while the play is crossed.
pub struct Backlash;

const ABOUT: About = About {
    id: "backlash",
    physics: "gears, screws or joints have play: after each reversal of the input nothing acts on until the play is crossed",
    part: Part::Input,
    needs: &[Need::Input, Need::ShortRun],
    parameters: &[Parameter { name: "width", unit: "input", meaning: "half width of the play", low: 0.0, high: 1e6 }],
    class: &["backlash"],
    resembles: "input-dead-zone: loses small inputs around zero, not after each reversal; coulomb-friction: resists the \
                motion, not the input",
    next_measurement: "turn the drive to and fro slowly and measure behind it: a loop of constant width, whatever the speed",
    identifiable: Identifiable::Shape,
    source: "M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633",
};

/// What follows the input at a distance of at most `width`: the play operator, from the middle of the play.
fn play(width: f64, input: &mut [f64]) {
    let mut follows = 0.0;
    for u in input {
        follows = f64::max(*u - width, f64::min(*u + width, follows));
        *u = follows;
    }
}

impl Cause for Backlash {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let width = values[0].abs();
        effects.input.push(Passage::path(move |_, input| play(width, input)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.003, 0.02, 0.1].iter().map(|part| vec![part * scene.input_level]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::pass;

    fn through(width: f64, input: &[f64]) -> Vec<f64> {
        let mut effects = Effects::default();
        Backlash.add(&[width], &mut effects);
        let mut values = input.to_vec();
        pass(&effects.input, |k| k as f64, &mut values);
        values
    }

    #[test]
    fn nothing_acts_on_while_the_play_is_crossed() {
        let acting = through(0.5, &[0.0, 0.4, 1.0, 2.0, 1.5, 1.0, 0.5, -1.0]);
        assert_eq!(acting, [0.0, 0.0, 0.5, 1.5, 1.5, 1.5, 1.0, -0.5]);
    }

    #[test]
    fn without_play_the_input_acts_as_it_is() {
        let input = [0.3, -0.2, 0.9];
        assert_eq!(through(0.0, &input), input);
    }

    #[test]
    fn the_loop_does_not_depend_on_how_finely_the_input_is_followed() {
        let at = |t: f64| (3.0 * t).sin() + 0.5 * (7.0 * t).sin();
        let fine: Vec<f64> = (0..8000).map(|k| at(f64::from(k) * 1e-3)).collect();
        let coarse: Vec<f64> = fine.iter().step_by(8).copied().collect();
        let kept: Vec<f64> = through(0.2, &fine).into_iter().step_by(8).collect();
        for (a, b) in kept.iter().zip(through(0.2, &coarse)) {
            // an extreme between two samples is missed by half its bend: 0.5 * 33 * (4e-3)^2
            assert!((a - b).abs() < 3e-4, "{a} {b}");
        }
    }
}
