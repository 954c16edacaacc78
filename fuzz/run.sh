#!/usr/bin/env bash
# Fuzzes on stable Rust, without cargo-fuzz: libFuzzer from libfuzzer-sys, coverage by the compiler's own
# passes. `cargo fuzz run TARGET` does the same with a nightly toolchain and AddressSanitizer.
#
#   fuzz/run.sh build                 builds the targets
#   fuzz/run.sh list                  their names
#   fuzz/run.sh TARGET SECONDS [...]  fuzzes one, from its corpus; what is found lies in target/found/
#   fuzz/run.sh all SECONDS           each, as many at once as there are processors
#   fuzz/run.sh replay [TARGET]       runs the corpora once
#   fuzz/run.sh seeds                 adds to the corpora what they began with
#   fuzz/run.sh minimise TARGET       keeps of its corpus and of what it learnt what adds coverage
#
# N3P_FUZZ_LAB=1 adds the targets of the laboratory, which build for minutes. N3P_FUZZ_ASAN=1 builds with
# AddressSanitizer: for the C interface, where there is `unsafe`. N3P_FUZZ_LIGHT=1 builds without looking into
# comparisons: twice as many inputs a second of what plans, whose inputs are structured anyway.
set -euo pipefail
cd "$(dirname "$0")"
target="${CARGO_TARGET_DIR:-target}"
triple="$(rustc -vV | sed -n 's/^host: //p')"
features=()
kind=plain
if [ -n "${N3P_FUZZ_LAB:-}" ]; then features=(--features lab); fi
# Coverage of the code under test and of what it calls. The compiler calls these unstable, hence BOOTSTRAP.
flags="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4"
flags+=" -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table"
flags+=" -Ccodegen-units=1"
if [ -n "${N3P_FUZZ_LIGHT:-}" ]; then
  kind=light
else
  flags+=" -Cllvm-args=-sanitizer-coverage-trace-compares"
fi
if [ -n "${N3P_FUZZ_ASAN:-}" ]; then
  flags+=" -Zsanitizer=address"
  kind=asan
fi
bin="$target/$kind/$triple/release"

names() {
  sed -n 's|^path = "fuzz_targets/\(.*\)\.rs"$|\1|p' Cargo.toml | while read -r name; do
    case "$name" in
      seeds) ;;
      lab_files | oracle) if [ -n "${N3P_FUZZ_LAB:-}" ]; then echo "$name"; fi ;;
      *) echo "$name" ;;
    esac
  done
}
build() {
  # With --target the flags are those of the targets alone, not of build scripts.
  RUSTC_BOOTSTRAP=1 RUSTFLAGS="$flags" cargo build --release --locked --quiet --target "$triple" \
    --target-dir "$target/$kind" "${features[@]}" $(names | sed 's/^/--bin /') "$@"
}
# A plan takes milliseconds; what takes half a minute, on a busy machine too, is a bug. Memory in megabytes.
fuzz() {
  local name="$1"
  shift
  mkdir -p "$target/learnt/$name" "$target/found/$name"
  "$bin/$name" -artifact_prefix="$target/found/$name/" -timeout=30 -rss_limit_mb=2048 \
    -max_len=4096 -print_final_stats=1 -verbosity=0 "$@"
}
# In a line; in full where something is found.
logged() {
  local name="$1" log="$target/$1.log"
  if fuzz "$@" >"$log" 2>&1; then
    echo "$name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs"
  else
    grep -v NEW_FUNC "$log" | tail -n 40
    exit 1
  fi
}

case "${1:-}" in
  build) build ;;
  list) names ;;
  replay)
    for name in $(if [ -n "${2:-}" ]; then echo "$2"; else names; fi); do
      [ -x "$bin/$name" ] || build
      logged "$name" -runs=0 "corpus/$name"
    done
    ;;
  all)
    seconds="${2:?seconds}"
    names | xargs -P "$(getconf _NPROCESSORS_ONLN)" -I NAME ./run.sh logged NAME "$seconds"
    ;;
  logged)
    logged "$2" -max_total_time="$3" "$target/learnt/$2" "corpus/$2"
    ;;
  seeds)
    build --bin seeds
    "$bin/seeds" >/dev/null 2>&1
    ;;
  minimise)
    name="${2:?a target}"
    mkdir -p "$target/minimal/$name"
    rm -f "$target/minimal/$name"/*
      "$bin/$name" -merge=1 -verbosity=0 -max_len=4096 "$target/minimal/$name" "corpus/$name" "$target/learnt/$name"
    ;;
  "")
    sed -n '2,/^set/p' "$0" | grep '^#'
    exit 2
    ;;
  *)
    name="$1"
    seconds="${2:?seconds}"
    shift 2
    [ -x "$bin/$name" ] || build
    echo "== $name, $seconds s"
    fuzz "$name" -max_total_time="$seconds" "$@" "$target/learnt/$name" "corpus/$name"
    ;;
esac
