#!/usr/bin/env bash
# Builds the C library and installs it: libraries, header, and what pkg-config and CMake look for.
# The folder may be moved afterwards.
#
#   capi/install.sh FOLDER
set -euo pipefail
if [ $# -ne 1 ]; then
  echo "usage: $0 FOLDER, such as ~/.local or target/n3p" >&2
  exit 2
fi
mkdir -p "$1"
folder="$(cd "$1" && pwd)"
cd "$(dirname "$0")"
cargo build --release --locked --package n3p-c
built="${CARGO_TARGET_DIR:-../target}/release"
version="$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)"
# Versions 0.x may change the interface with every x, as build.rs has it.
number="$(echo "$version" | sed -E 's/^(0\.[0-9]+|[1-9][0-9]*)\..*/\1/')"

mkdir -p "$folder"/{include,lib/pkgconfig,lib/cmake/n3p}
install -m 644 include/n3p.h "$folder/include/"
case "$(uname -s)" in
  Darwin)
    install -m 755 "$built/libn3p_c.dylib" "$folder/lib/libn3p.$number.dylib"
    install_name_tool -id "@rpath/libn3p.$number.dylib" "$folder/lib/libn3p.$number.dylib"
    ln -sf "libn3p.$number.dylib" "$folder/lib/libn3p.dylib"
    shared="libn3p.$number.dylib"
    private="-lm"
    ;;
  *)
    install -m 755 "$built/libn3p_c.so" "$folder/lib/libn3p.so.$version"
    strip --strip-unneeded "$folder/lib/libn3p.so.$version"
    ln -sf "libn3p.so.$version" "$folder/lib/libn3p.so.$number"
    ln -sf "libn3p.so.$number" "$folder/lib/libn3p.so"
    shared="libn3p.so.$number"
    # What `cargo rustc --crate-type staticlib -- --print native-static-libs` says.
    private="-lgcc_s -lutil -lrt -lpthread -lm -ldl"
    ;;
esac
install -m 644 "$built/libn3p_c.a" "$folder/lib/libn3p.a"
strip --strip-debug "$folder/lib/libn3p.a" 2>/dev/null || true

fill() {
  sed -e "s|@VERSION@|$version|g" -e "s|@SHARED@|$shared|g" -e "s|@PRIVATE@|$private|g" "$1" >"$2"
}
fill n3p.pc.in "$folder/lib/pkgconfig/n3p.pc"
fill n3pConfig.cmake.in "$folder/lib/cmake/n3p/n3pConfig.cmake"
fill n3pConfigVersion.cmake.in "$folder/lib/cmake/n3p/n3pConfigVersion.cmake"
echo "installed n3p $version in $folder"
