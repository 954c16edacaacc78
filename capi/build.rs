//! Gives the shared library the name that programs look for when they start.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        // Versions 0.x may change the interface with every x.
        let version = |part| env::var(format!("CARGO_PKG_VERSION_{part}")).expect("cargo sets it");
        let number = match (version("MAJOR"), version("MINOR")) {
            (major, minor) if major == "0" => format!("0.{minor}"),
            (major, _) => major,
        };
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libn3p.so.{number}");
    }
}
