//! The address space that the system leaves to the program (`ulimit -v`), and how little of it is asked for.
//!
//! Memory that is reserved counts there, used or not: the C library keeps 64 MiB for each thread that allocates, and
//! products of matrices (faer's gemm) twice the largest cache for each thread that makes one. A failed reservation ends
//! a program at once. Under a limit the program starts itself again with one arena for all threads and as many threads
//! as there is room for; where there is none for a single product, commands that make some are refused. Results do not
//! depend on the number of threads.

use std::fs;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// Asks the C library for one arena; also the sign that the program was started again, or that its user decides.
const ARENAS: &str = "MALLOC_ARENA_MAX";

/// The number of threads of every pool that is not given one.
const THREADS: &str = "RAYON_NUM_THREADS";

/// Program, libraries and the data of a small run: what a run of the paper's archive takes on one thread.
const PROGRAM_BYTES: u64 = 192 << 20;

/// Stack and data of a thread beside what products of matrices reserve.
const THREAD_BYTES: u64 = 16 << 20;

/// The largest cache where the system does not say: that of a server's core complex.
const CACHE_BYTES: u64 = 32 << 20;

/// Starts the program again, if the address space is limited and nobody has decided on arenas. Returns where it goes on
/// as it is: where there is no limit, or it cannot be started again.
pub fn fit() {
    let Some(limit) = limit_bytes(&fs::read_to_string("/proc/self/limits").unwrap_or_default()) else { return };
    if std::env::var_os(ARENAS).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = arguments.next() {
        command.arg0(name);
    }
    command.args(arguments).env(ARENAS, "1");
    if std::env::var_os(THREADS).is_none() {
        let processors = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
        command.env(THREADS, threads(limit, largest_cache_bytes()).min(processors).to_string());
    }
    // it comes back only if that fails: then what is there has to do
    let _ = command.exec();
}

/// That there is a limit which has no room for a product of matrices, and what has; none where it has.
pub fn too_little() -> Option<(String, String)> {
    let limit = limit_bytes(&fs::read_to_string("/proc/self/limits").unwrap_or_default())?;
    lacking(limit, largest_cache_bytes())
}

/// That a limit has no room for a product of matrices, and what has; none where it has.
fn lacking(limit_bytes: u64, cache_bytes: u64) -> Option<(String, String)> {
    let (product, mb) = (cache_bytes.saturating_mul(2), |bytes: u64| bytes / 1_000_000);
    (limit_bytes < product.saturating_add(THREAD_BYTES)).then(|| {
        let problem = format!(
            "the address space is limited to {} MB, and products of matrices reserve {} MB, twice this machine's largest \
             cache, whatever the size of the data",
            mb(limit_bytes),
            mb(product)
        );
        let wanted = product.saturating_add(PROGRAM_BYTES).saturating_add(THREAD_BYTES) >> 10;
        (problem, format!("`ulimit -v {wanted}` has room for one thread; little of it is used"))
    })
}

/// Threads that a limit has room for, one at least.
fn threads(limit_bytes: u64, cache_bytes: u64) -> u64 {
    (limit_bytes.saturating_sub(PROGRAM_BYTES) / cache_bytes.saturating_mul(2).saturating_add(THREAD_BYTES)).max(1)
}

/// The soft limit of the address space in Linux's table of limits; none where there is none.
fn limit_bytes(table: &str) -> Option<u64> {
    table.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

fn largest_cache_bytes() -> u64 {
    let text = fs::read_to_string("/sys/devices/system/cpu/cpu0/cache/index3/size").unwrap_or_default();
    let kib = text.trim().strip_suffix('K').and_then(|kib| kib.parse::<u64>().ok());
    kib.map_or(CACHE_BYTES, |kib| kib.saturating_mul(1 << 10))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_read_and_divided_among_threads() {
        let table = |soft: &str| {
            format!("Limit   Soft Limit   Hard Limit   Units\nMax address space         {soft}   unlimited   bytes\n")
        };
        assert_eq!(limit_bytes(&table("512000000")), Some(512_000_000));
        assert_eq!(limit_bytes(&table("unlimited")), None);
        assert_eq!(limit_bytes(""), None);
        let mib = 1 << 20;
        assert_eq!([100, 300, 500, 2000].map(|limit| threads(limit * mib, 32 * mib)), [1, 1, 3, 22]);
        // a cache larger than the limit
        assert_eq!(threads(500 * mib, u64::MAX / 4), 1);
        assert!(lacking(500 * mib, 32 * mib).is_none() && lacking(500 * mib, u64::MAX / 4).is_some());
        let (problem, help) = lacking(500 * mib, 480 * mib).expect("too little");
        assert!(problem.contains("limited to 524 MB") && problem.contains("reserve 1006 MB"), "{problem}");
        assert!(help.contains("ulimit -v 1196032`"), "{help}");
    }
}
