//! The header is what cbindgen makes of the sources now.

use std::path::Path;
use std::{env, fs};

/// `N3P_HEADER=write` renews the header instead.
#[test]
fn the_header_is_up_to_date() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml")).unwrap();
    // In the order in which a reader wants them.
    let files = ["status", "types", "memory", "lot", "scene", "parker", "plan"];
    let builder = files.iter().fold(cbindgen::Builder::new().with_config(config), |b, file| {
        b.with_src(here.join(format!("src/{file}.rs")))
    });
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let header = here.join("include/n3p.h");
    if env::var_os("N3P_HEADER").is_some_and(|v| v == "write") {
        fs::write(&header, &made).unwrap();
    }
    let kept = fs::read_to_string(&header).unwrap_or_default();
    let differs = kept.lines().zip(made.lines()).position(|(kept, made)| kept != made);
    assert!(
        kept == made,
        "include/n3p.h differs from the sources (line {:?}); renew it: N3P_HEADER=write cargo test \
         --release -p n3p-c --test header",
        differs.map(|i| i + 1)
    );
}
