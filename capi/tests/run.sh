#!/usr/bin/env bash
# Installs the C library into a folder of its own, compiles against it as others would, and runs what
# must hold: misuse gives codes (also under valgrind, where there is one), the examples plan, and ten
# scenes come to the bytes of n3p-plan. Run from anywhere.
set -euo pipefail
cd "$(dirname "$0")/../.."
target="${CARGO_TARGET_DIR:-$PWD/target}"
mkdir -p "$target"
target="$(cd "$target" && pwd)"
installed="$target/n3p-installed"
work="$target/n3p-programs"
rm -rf "$installed" "$work"
mkdir -p "$work"/ten/{plan,c,rust}
capi/install.sh "$installed"

if command -v pkg-config >/dev/null 2>&1; then
  export PKG_CONFIG_PATH="$installed/lib/pkgconfig"
  read -ra library <<<"$(pkg-config --cflags --libs n3p)"
  read -ra static <<<"$(pkg-config --cflags n3p) $installed/lib/libn3p.a $(sed -n 's/^Libs.private: //p' \
    "$PKG_CONFIG_PATH/n3p.pc")"
else
  echo "no pkg-config: compiled without"
  library=("-I$installed/include" "-L$installed/lib" -ln3p)
  static=("-I$installed/include" "$installed/lib/libn3p.a" -lgcc_s -lutil -lrt -lpthread -lm -ldl)
fi
library+=("-Wl,-rpath,$installed/lib")
warnings=(-Wall -Wextra -Wpedantic -Werror -O1 -g)

echo "-- C"
gcc -std=c11 "${warnings[@]}" capi/tests/misuse.c "${library[@]}" -pthread -lm -o "$work/misuse"
gcc -std=c11 "${warnings[@]}" capi/tests/misuse.c "${static[@]}" -pthread -o "$work/misuse-static"
gcc -std=c11 "${warnings[@]}" examples/c/smallest.c "${library[@]}" -o "$work/smallest"
# The program in the guide.
awk '/^```$/ { inside = 0 } inside; /^```c$/ { inside = 1 }' docs/c.md >"$work/guide.c"
gcc -std=c11 "${warnings[@]}" "$work/guide.c" "${library[@]}" -o "$work/guide"
"$work/guide"
"$work/misuse"
"$work/misuse-static"
"$work/smallest" >/dev/null
if command -v valgrind >/dev/null 2>&1; then
  # What is possibly lost are 48 bytes by which Rust knows the main thread, kept until it ends.
  valgrind --quiet --leak-check=full --show-leak-kinds=definite,indirect \
    --errors-for-leak-kinds=definite,indirect --error-exitcode=9 "$work/misuse"
else
  echo "no valgrind: memory is not looked at"
fi
if [ "$(uname -s)" = Linux ] && gcc -std=c11 "${warnings[@]}" capi/tests/allocations.c \
  "${library[@]}" -o "$work/allocations" 2>/dev/null; then
  "$work/allocations" 75
else
  echo "no glibc: allocations are not counted"
fi

echo "-- C++"
if command -v cmake >/dev/null 2>&1; then
  cmake -S examples/c -B "$work/cmake" -DCMAKE_PREFIX_PATH="$installed" >/dev/null
  cmake --build "$work/cmake" >/dev/null
  cp "$work/cmake"/{park,ten_scenes} "$work/"
  "$work/cmake/smallest" >/dev/null
else
  echo "no cmake: compiled by g++ alone"
  for program in park ten_scenes; do
    g++ -std=c++17 -O2 -Wall -Wextra -Wpedantic -Werror "examples/c/$program.cpp" "${library[@]}" \
      -o "$work/$program"
  done
fi
"$work/park"
"$work/ten_scenes" examples/ten-scenes.txt "$work/ten/c"

echo "-- a crate of somebody else's"
embed=(cargo run --release --locked --quiet --manifest-path examples/embed/Cargo.toml --)
CARGO_TARGET_DIR="$target" "${embed[@]}"
CARGO_TARGET_DIR="$target" "${embed[@]}" examples/ten-scenes.txt "$work/ten/rust"

echo "-- the same bytes as n3p-plan"
# With what is given, such as --workspace: in CI n3p-plan is already built that way.
cargo build --release --locked --bin n3p-plan "$@"
while read -r file; do
  name="$(basename "${file%.*}")"
  N3P_LOG=off "$target/release/n3p-plan" --scene "$file" --out "$work/ten/plan/$name.json" >/dev/null
done <examples/ten-scenes.txt
diff -r "$work/ten/plan" "$work/ten/c"
diff -r "$work/ten/plan" "$work/ten/rust"
echo "$(find "$work/ten/plan" -name '*.json' | wc -l) scenes: C, Rust and n3p-plan agree"
