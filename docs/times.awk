# The tables of docs/performance.md from the rows of an n3p-eval run:
#   awk -f docs/times.awk target/results/rows.csv
# First median / P95 / mean of the planning time in µs, then mean length in m and mean direction
# changes. P95 is the smallest time that at least 95 % of the episodes do not exceed.
BEGIN {
  FS = ","
  count = split("ha ha-rs ha-hold mhha sha rl-simple rl-eval mlp-n3p knn-n3p n3p", methods, " ")
  kinds = split("forward parallel reverse", kind, " ")
  levels = split("easy complex extreme", level, " ")
}
NR == 1 { for (i = 1; i <= NF; i++) column[$i] = i; next }
$column["ok"] == "true" {
  key = $column["type"] SUBSEP $column["level"] SUBSEP $column["method"]
  n[key]++
  time[key, n[key]] = $column["plan_time_s"] * 1e6
  length_sum[key] += $column["length_m"]
  change_sum[key] += $column["direction_changes"]
}
function times(key,   i, j, v, sum) {
  if (!(key in n)) return "–"
  for (i = 1; i <= n[key]; i++) {
    v = time[key, i]
    sum += v
    for (j = i - 1; j > 0 && sorted[j] > v; j--) sorted[j + 1] = sorted[j]
    sorted[j + 1] = v
  }
  v = n[key]
  i = (sorted[int((v + 1) / 2)] + sorted[int(v / 2) + 1]) / 2
  j = int(v * 0.95); if (j < v * 0.95) j++
  return sprintf("%.0f / %.0f / %.0f", i, sorted[j], sum / v)
}
function quality(key) {
  if (!(key in n)) return "–"
  return sprintf("%.1f m, %.2f", length_sum[key] / n[key], change_sum[key] / n[key])
}
function table(what,   k, l, m, key, line) {
  line = "| type | level |"
  for (m = 1; m <= count; m++) line = line " `" methods[m] "` |"
  print line
  line = "|---|---|"
  for (m = 1; m <= count; m++) line = line "---|"
  print line
  for (k = 1; k <= kinds; k++) for (l = 1; l <= levels; l++) {
    line = "| " kind[k] " | " level[l] " |"
    for (m = 1; m <= count; m++) {
      key = kind[k] SUBSEP level[l] SUBSEP methods[m]
      line = line " " (what == "times" ? times(key) : quality(key)) " |"
    }
    print line
  }
}
END { table("times"); print ""; table("quality") }
