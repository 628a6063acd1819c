//! A release at a given instant against the closed form.

use super::Afm;
use crate::fixture::Lever as ClosedForm;
use afmid_kernels::effects::{Effects, Instant};
use afmid_kernels::simulate::{Cut, Release};

const AT: Instant = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
const CUT: Cut = Cut { before: 16, samples: 4000 };

#[test]
fn a_release_between_two_samples_is_the_closed_form() {
    let (microscope, closed) = (Afm::default().microscope(), ClosedForm::paper());
    for (amplitude_v, lead) in [(0.9, 0.0), (0.9, 0.37), (-0.4, 0.8), (1.3, -1.6), (0.9, 2.25)] {
        let release = Release { amplitude_v, lead_s: 0.2e-6 * lead, at: AT };
        let found = microscope.released(&release, &Effects::default(), CUT);
        let truth = closed.release(CUT.samples, 16.0 - lead, -amplitude_v);
        let worst = found.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // exact propagation; the closed form's residues are good to 1e-9
        assert!(worst < 1e-7, "{amplitude_v} {lead} {worst:e}");
    }
}
