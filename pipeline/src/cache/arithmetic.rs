//! What of processor and build may change the last bits of a result.
//!
//! Sums and products are the same everywhere: the compiler contracts nothing. Four things are not:
//!
//! - which vector units the FFT, linear algebra and loops of this program choose at run time (other orders of
//!   summation, fused multiply-add): stated by name;
//! - the C library's functions (`exp`, `sin`, ...), which choose by processor and differ between releases: stated by
//!   what they return;
//! - the build: compiler, target and its features, level of optimisation (what is computed when the program is built
//!   may be rounded otherwise), checks;
//! - where there is no AVX2 with fused multiply-add, products of large matrices are summed in blocks that fit the
//!   processor's caches: stated by size.
//!
//! Threads, memory and the order in which stages end change nothing (`tests/commands/threads.rs`).

use blake3::Hasher;

/// The arithmetic of this process, in words: part of every key. The same text, the same bits.
pub fn arithmetic() -> String {
    let units = vector_units();
    let blocks = if ["avx2", "fma"].iter().all(|unit| units.contains(unit)) { String::new() } else { caches() };
    let units = units.join(" ");
    format!("{} [{units}]{blocks}, {}, functions {}", std::env::consts::ARCH, env!("AFMID_BUILD"), functions())
}

/// Sizes of the first processor's caches: the faer and gemm crates choose blocks by them.
fn caches() -> String {
    let size = |index: usize| {
        let folder = format!("/sys/devices/system/cpu/cpu0/cache/index{index}");
        let read =
            |name: &str| std::fs::read_to_string(format!("{folder}/{name}")).unwrap_or_default().trim().to_owned();
        format!("{}/{}/{}", read("size"), read("ways_of_associativity"), read("coherency_line_size"))
    };
    let sizes: Vec<String> = (0..4).map(size).collect();
    format!(" caches {}", sizes.join(" "))
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
            ("avx512bw", std::arch::is_x86_feature_detected!("avx512bw")),
            ("avx512cd", std::arch::is_x86_feature_detected!("avx512cd")),
            ("avx512dq", std::arch::is_x86_feature_detected!("avx512dq")),
            ("avx512vl", std::arch::is_x86_feature_detected!("avx512vl")),
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
        let found = arithmetic();
        let checked = if cfg!(debug_assertions) { ", checked," } else { ", unchecked," };
        assert!(
            found.starts_with(std::env::consts::ARCH) && found.contains("opt-level ") && found.contains(checked),
            "{found}"
        );
        assert!(found.contains("rustc 1.") && !found.contains("unknown version"), "{found}");
    }
}
