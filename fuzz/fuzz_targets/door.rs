#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| n3p_fuzz::door(data));
