#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| mge::fuzz::run("requests", input));
