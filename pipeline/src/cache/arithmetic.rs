//! What of processor and build may change the last bits of a result.
//!
//! Sums and products are the same everywhere: the compiler contracts nothing. Two things are not: which vector units the FFT, linear algebra and
//! loops of this program choose at run time (other orders of summation, fused multiply-add), and the C library's functions (`exp`, `sin`, ...),
//! which choose by processor and differ between releases. The first is stated by name, the second by what the functions return.

use blake3::Hasher;

/// The arithmetic of this process, in words: part of every key. The same text, the same bits.
///
/// Architecture, vector units in use, compiler, optimised or not, and a hash of the C library's functions at fixed arguments.
pub fn arithmetic() -> String {
    let optimised = if cfg!(debug_assertions) { "checked" } else { "optimised" };
    format!(
        "{} [{}], {}, {optimised}, functions {}",
        std::env::consts::ARCH,
        vector_units().join(" "),
        env!("AFMID_COMPILER"),
        functions()
    )
}

/// The vector units that FFTs, linear algebra and loops choose among.
fn vector_units() -> Vec<&'static str> {
    #[cfg(target_arch = "x86_64")]
    {
        let known = [
            ("sse4.1", std::arch::is_x86_feature_detected!("sse4.1")),
            ("avx", std::arch::is_x86_feature_detected!("avx")),
            ("avx2", std::arch::is_x86_feature_detected!("avx2")),
            ("fma", std::arch::is_x86_feature_detected!("fma")),
            ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
        ];
        known.into_iter().filter_map(|(name, there)| there.then_some(name)).collect()
    }
    // other architectures have one set, chosen when the program is built
    #[cfg(not(target_arch = "x86_64"))]
    Vec::new()
}

/// Sixteen digits of a hash of what elementary functions return at fixed arguments of many magnitudes.
fn functions() -> String {
    let mut hasher = Hasher::new();
    for step in 0..64 {
        let x = 0.37 * 1.61_f64.powi(step - 24);
        let values = [
            x.exp_m1(),
            x.min(600.0).exp(),
            x.ln(),
            x.sin(),
            x.cos(),
            x.atan2(1.7),
            x.powf(0.731),
            x.hypot(0.9),
            x.tanh(),
        ];
        for value in values {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    }
    hasher.finalize().to_hex()[..16].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_process_states_the_same_arithmetic() {
        assert_eq!(arithmetic(), arithmetic());
        assert!(arithmetic().starts_with(std::env::consts::ARCH));
    }
}
