//! States the build: results of programs that were built otherwise may differ in their last bits.

use std::env::var;

fn main() {
    // the compiler that builds, on the machine that builds: also where the program is for another one
    let compiler = var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let version = std::process::Command::new(compiler).arg("--version").output();
    let version = version.ok().and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let version = version.lines().next().unwrap_or("rustc of unknown version");
    let of = |name: &str| var(name).unwrap_or_default();
    let assertions = if var("CARGO_CFG_DEBUG_ASSERTIONS").is_ok() { "checked" } else { "unchecked" };
    let (target, features, level) = (of("TARGET"), of("CARGO_CFG_TARGET_FEATURE"), of("OPT_LEVEL"));
    println!("cargo::rustc-env=AFMID_BUILD={version}, {target} [{features}], opt-level {level}, {assertions}");
    println!("cargo::rerun-if-changed=build.rs");
}
