#![no_main]

use std::path::Path;
use std::process::exit;

// No fuzzing: with the flags of the targets only libFuzzer can be linked, so its start does the work.
libfuzzer_sys::fuzz_target!(
    init: {
        n3p_fuzz::write_seeds(Path::new("corpus")).expect("a folder to write to");
        exit(0)
    },
    |_data: &[u8]| {}
);
