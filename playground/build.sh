#!/usr/bin/env bash
# Builds target/playground/n3p.html: the playground as one file, which plans in the browser.
#
# Needs Rust's standard library for wasm32: `rustup target add wasm32-unknown-unknown`. Where it cannot be had,
# Debian's packages rustc-web, libstd-rust-web-dev, rust-web-src and lld have the sources that it is
# built from: `playground/build.sh --debian`.
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
build=(build --release --locked --package n3p-play --lib --target "$target")
if [ "${1:-}" = --debian ]; then
  # A compiler of a release builds the library of its own version alone, and this only if it is told to.
  export RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1
  export CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld
  /usr/bin/cargo -Zbuild-std=std,panic_abort "${build[@]}"
else
  if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
    rustup target add "$target"
  fi
  cargo "${build[@]}"
fi
out="${CARGO_TARGET_DIR:-target}"
mkdir -p "$out/playground"
python3 playground/bundle.py "$out/$target/release/n3p_play.wasm" "$out/playground/n3p.html"
