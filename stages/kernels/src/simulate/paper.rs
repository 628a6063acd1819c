//! The paper's instrument, for tests.

use super::{Adc, Contact, Detector, Microscope, ModalLever, Mode, PiezoMonitor, ReadoutNoise, TriangleRamp};
use crate::fixture::Lever as ClosedForm;

/// The contact that the paper's snap-offs come from.
pub(crate) const PAPER_CONTACT: Contact = Contact {
    stiffness_n_per_m: 60.0,
    damping_n_s_per_m: 8e-6,
    snap_in_gap_m: 4e-9,
    adhesion_n: 330e-9,
    adhesion_scatter: 0.06,
};

/// The piezo's motion.
pub(crate) const PAPER_RAMP: TriangleRamp = TriangleRamp { frequency_hz: 5.58, range_m: 200e-9, phase: 0.0 };

/// Lever, contact, detector and recorder as the paper has them.
pub(crate) fn paper_microscope(temperature_k: f64) -> Microscope {
    let closed = ClosedForm::paper();
    let tip_shares = [0.9713, 0.0247, 0.0032, 0.0008];
    let modes = (0..4)
        .map(|i| Mode {
            frequency_hz: closed.frequency_hz[i],
            quality_factor: closed.quality_factor[i],
            tip_share: tip_shares[i],
            detector_share: closed.static_share[i],
        })
        .collect();
    Microscope {
        lever: ModalLever { stiffness_n_per_m: 3.8, modes },
        contact: PAPER_CONTACT,
        detector: Detector { sensitivity_v_per_m: 1e7, pole_hz: closed.detector_pole_hz, delay_s: 0.0 },
        noise: ReadoutNoise { white_v: 1.2e-3, pink_v: 0.3e-3, drift_v: 4e-3 },
        adc: Adc { bits: 12, lsb_v: 0.977e-3 },
        monitor: PiezoMonitor { m_per_v: 25e-9, lsb_v: 4.88e-3, white_v: 5e-4 },
        ramp: PAPER_RAMP,
        temperature_k,
        sample_rate_hz: 5e6,
    }
}
