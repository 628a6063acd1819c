#!/usr/bin/env bash
# faer 0.24.4 (private-gemm-x86 0.1.22): the first product of two 64 x 64 matrices in a thread reserves twice the size of the
# processor's last-level cache of address space, for each thread that makes one.
#
# Expected: scratch space of the size of what is multiplied (100 kB), or none.
# Seen: the size of the process grows by twice the cache (64 MB where it is 32 MB, 1 GB where it is 480 MB), again for a
# second thread. Little of it is touched, so resident memory stays small; where the address space is limited (`ulimit -v`,
# clusters that count virtual memory) a program has room for few threads, or for none, whatever its data are.
#
# Needs cargo, x86-64 with AVX2 and Linux. Exit code 0: as stated here. 1: faer behaves otherwise now.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/src"
cat > "$work/Cargo.toml" <<'TOML'
[package]
name = "reserves"
version = "0.1.0"
edition = "2024"

[dependencies]
faer = { version = "=0.24.4", default-features = false, features = ["std", "linalg"] }
private-gemm-x86 = "=0.1.22"
TOML
cat > "$work/src/main.rs" <<'RS'
use faer::Mat;

/// Address space of the process, kB.
fn size_kb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmSize:")).expect("a size");
    line.split_whitespace().next().expect("a number").parse().expect("a number")
}

/// By how much it grows with a product of two 64 x 64 matrices, kB.
fn growth_kb() -> f64 {
    let a = Mat::<f64>::from_fn(64, 64, |i, j| (i + 2 * j) as f64);
    let b = Mat::<f64>::from_fn(64, 64, |i, j| (3 * i) as f64 - j as f64);
    let before = size_kb();
    let product = &a * &b;
    let after = size_kb();
    assert!(product[(3, 3)].is_finite());
    after - before
}

fn main() {
    let text = std::fs::read_to_string("/sys/devices/system/cpu/cpu0/cache/index3/size").expect("a third cache");
    let cache_kb: f64 = text.trim().trim_end_matches('K').parse().expect("its size in K");
    let (first, again) = (growth_kb(), growth_kb());
    let second = std::thread::spawn(growth_kb).join().expect("a thread");
    println!("cache {cache_kb} kB; first product {first} kB, the next one {again} kB, first of another thread {second} kB");
    // pages, and what the allocator adds
    let twice = |grown: f64| (grown / (2.0 * cache_kb) - 1.0).abs() < 0.05;
    std::process::exit(i32::from(!(twice(first) && again < 0.05 * cache_kb && twice(second))));
}
RS
cd "$work"
CARGO_TARGET_DIR="$work/target" cargo run --quiet
