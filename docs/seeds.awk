# Rows of one training seed in each file -> a table of means over seeds, with 95 % intervals:
#   awk -f docs/seeds.awk SEED/rows.csv ...
# Mean time saved of ha-rs's of the same run, share of plans without a search, cost over ha-rs's (geometric mean).
BEGIN { FS = "," }
FNR == 1 {
    files++
    for (i = 1; i <= NF; i++) at[$i] = i
    next
}
{
    of = $at["set"] "," $at["type"] "," $at["method"]
    time[files, of] += $at["plan_time_s"]
    cost = $at["ok"] == "true" ? $at["length_m"] + 3 * $at["direction_changes"] : 0
    if ($at["method"] == "ha-rs") {
        reference[files, $at["scene"]] = cost
        next
    }
    if (!(of in seen)) { seen[of] = 1; order[++kinds] = of }
    count[files, of]++
    free[files, of] += $at["nodes"] == 0
    rows++
    file_of[rows] = files; row_of[rows] = of; scene_of[rows] = $at["scene"]; cost_of[rows] = cost
}
# Student's t for two-sided 95 % with n - 1 degrees of freedom.
function spread(values, n,    i, mean, sum, t) {
    split("12.706 4.303 3.182 2.776 2.571 2.447", table, " ")
    for (i = 1; i <= n; i++) mean += values[i] / n
    for (i = 1; i <= n; i++) sum += (values[i] - mean) ^ 2
    t = n > 1 ? table[n - 1] * sqrt(sum / (n - 1) / n) : 0
    return sprintf("%.1f ± %.1f", mean, t)
}
END {
    for (r = 1; r <= rows; r++) {
        other = reference[file_of[r], scene_of[r]]
        if (cost_of[r] <= 0 || other <= 0) continue
        ratio[file_of[r], row_of[r]] += log(cost_of[r] / other)
        solved[file_of[r], row_of[r]]++
    }
    print "| set | type | method | seeds | time saved, % | without a search, % | cost over `ha-rs`, % |"
    print "|---|---|---|--:|--:|--:|--:|"
    for (k = 1; k <= kinds; k++) {
        of = order[k]
        split(of, part, ",")
        n = 0
        for (f = 1; f <= files; f++) {
            if (!count[f, of]) continue
            n++
            saved[n] = 100 * (1 - time[f, of] / time[f, part[1] "," part[2] ",ha-rs"])
            none[n] = 100 * free[f, of] / count[f, of]
            dear[n] = 100 * (exp(ratio[f, of] / solved[f, of]) - 1)
        }
        printf "| %s | %s | `%s` | %d | %s | %s | %s |\n", part[1], part[2], part[3], n, \
            spread(saved, n), spread(none, n), spread(dear, n)
    }
}
