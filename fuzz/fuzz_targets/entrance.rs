//! The one program of all fuzz targets: the entrance that the variable `AFMID_ENTRANCE` names.
#![no_main]

use std::sync::LazyLock;

static NAME: LazyLock<String> = LazyLock::new(|| {
    std::env::var("AFMID_ENTRANCE").expect("AFMID_ENTRANCE names an entrance: a folder of fuzz/corpus")
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| afmid_fuzz::enter(&NAME, bytes));
