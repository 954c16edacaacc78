//! The time, in microseconds since some moment; only differences mean something.

/// Where there is an operating system, its clock.
#[cfg(not(target_arch = "wasm32"))]
pub fn now_us() -> f64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static FIRST: OnceLock<Instant> = OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e6
}

/// In a browser, the page's clock, which is coarse: a tenth of a millisecond.
#[cfg(target_arch = "wasm32")]
pub fn now_us() -> f64 {
    #[link(wasm_import_module = "page")]
    unsafe extern "C" {
        /// Milliseconds.
        safe fn now() -> f64;
    }
    now() * 1e3
}
