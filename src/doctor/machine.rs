//! Program, processor, library, environment.

use afmid_pipeline::Registry;
use afmid_pipeline::hdf5_files::library_version;

use super::Finding;

/// Version and stages.
pub fn program(registry: &Registry) -> Finding {
    let (version, system) = (env!("CARGO_PKG_VERSION"), std::env::consts::OS);
    let stages = registry.entries().len();
    Finding::good("program", format!("afmid {version}, {stages} stages, {system} {}", std::env::consts::ARCH))
}

/// Processors, and whether they have the vector units that the arithmetic is written for.
pub fn processor() -> Finding {
    let count = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let processors = if count == 1 { "1 processor".to_owned() } else { format!("{count} processors") };
    if vector_units() {
        return Finding::good("processor", format!("{processors}, vector units"));
    }
    Finding::warning(
        "processor",
        format!("{processors}, without AVX2 and FMA"),
        "fits take up to twice as long, and last bits of numbers may differ from other machines'",
    )
}

#[cfg(target_arch = "x86_64")]
fn vector_units() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

/// Elsewhere they belong to the architecture, or there is nothing to detect.
#[cfg(not(target_arch = "x86_64"))]
fn vector_units() -> bool {
    true
}

/// The HDF5 library.
pub fn library() -> Finding {
    let (major, minor, release) = library_version();
    Finding::good("HDF5", format!("{major}.{minor}.{release}"))
}

/// Variables that change what runs do.
pub fn environment() -> Vec<Finding> {
    let set = |name: &str| std::env::var_os(name).map(|value| value.to_string_lossy().into_owned());
    let mut findings = Vec::new();
    if let Some(threads) = set("RAYON_NUM_THREADS") {
        let help = "unset it to use all processors; `-j N` goes before it";
        findings.push(Finding::warning("threads", format!("RAYON_NUM_THREADS is {threads}"), help));
    }
    if let Some(locking) = set("HDF5_USE_FILE_LOCKING") {
        findings.push(Finding::good("file locks", format!("HDF5_USE_FILE_LOCKING is {locking}")));
    }
    findings
}
