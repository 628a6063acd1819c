#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| afmid_fuzz::enter("responses", bytes));
