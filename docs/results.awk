# The short results table of README.md from an n3p-eval report:
#   awk -f docs/results.awk target/results/report.md
# Mean planning times in ms, the paper's in parentheses; the report has everything else.
function trim(s) { gsub(/^ +| +$/, "", s); return s }
function cell(method, paper,   ours) {
  ours = mean[level, kind, method]
  if (ours == "") return "–"
  paper = mean[level, kind, paper]
  return paper == "" ? ours : ours " (" paper ")"
}
BEGIN { FS = "|" }
/^## / { level = "" }
/^## Level / { level = $0; sub(/^## Level /, "", level); sub(/:.*/, "", level) }
level != "" && /^\| (forward|parallel|reverse) / {
  kind = trim($2); name = trim($3)
  if (!((level, kind) in seen)) { seen[level, kind] = 1; order[++n] = level SUBSEP kind }
  mean[level, kind, name] = trim($6)
  share = trim($11) + 0
  if (trim($4) == "this run" && share > 0) {
    failed[level, kind] = failed[level, kind] (failed[level, kind] == "" ? "" : ", ") "`" name "` " share " %"
  }
}
END {
  print "| level | type | `ha` (HA*) | `ha-rs` (HA* with RS) | `ha-hold` (HA* Hold) | `mhha` (MHHA*) | `sha` (SHA*) " \
    "| `rl-simple` (RL Simple) | `rl-eval` (RL Eval) | `mlp-n3p` (MLP-N3P) | `knn-n3p` (KNN-N3P) | `n3p` | failures |"
  print "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
  for (i = 1; i <= n; i++) {
    split(order[i], key, SUBSEP); level = key[1]; kind = key[2]
    printf "| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", level, kind, cell("ha", "HA*"),
      cell("ha-rs", "HA* with RS"), cell("ha-hold", "HA* Hold"), cell("mhha", "MHHA*"), cell("sha", "SHA*"),
      cell("rl-simple", "RL Simple"), cell("rl-eval", "RL Eval"),
      cell("mlp-n3p", "MLP-N3P"), cell("knn-n3p", "KNN-N3P"), cell("n3p", ""),
      failed[level, kind] == "" ? "none" : failed[level, kind]
  }
}
