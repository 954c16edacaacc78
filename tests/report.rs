//! `report.html` in a browser: what it shows, and that its paths end at the goal.
//!
//! The second test needs Chromium on the PATH, so it runs only where it is asked for:
//! `cargo test --release --test report -- --ignored`.

#![cfg(feature = "lab")]

use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Writes the results of a small evaluation with failures into `dir`, with `others` among its arguments.
fn evaluate(dir: &Path, others: &[&str]) -> String {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/knn.bin");
    assert_cmd::Command::cargo_bin("n3p-eval")
        .unwrap()
        .current_dir(dir)
        .args(["--model", model.to_str().unwrap(), "--methods", "ha-rs,sha,knn-n3p,n3p"])
        .args(["--count", "2", "--seed", "77", "--max-expansions", "100", "--out", "out"])
        .args(others)
        .assert()
        .success();
    std::fs::read_to_string(dir.join("out/report.html")).unwrap()
}

/// Two worlds: nine settings at home and three away.
const WORLDS: [&str; 4] = ["--world", "home", "--world", "lots"];

#[test]
fn a_report_lies_beside_the_rows() {
    let dir = tempfile::tempdir().unwrap();
    let html = evaluate(dir.path(), &[]);
    let traces = std::fs::read_to_string(dir.path().join("out/traces.jsonl")).unwrap();
    assert_eq!(traces.lines().count(), 18 * 4);
    assert!(html.contains("easy-forward-0000") && html.contains("budget spent"));
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
    // One world: nothing to hold against each other, and no world to choose.
    assert!(!html.contains("id=\"away\"") && !html.contains("id=\"filter-world\""));
    assert!(html.contains("id=\"filter-type\"") && html.contains("id=\"filter-level\""));
    assert!(!html.contains("id=\"drive-table\""));
}

/// The parts of `text` that follow `before`, each up to `after`.
fn parts<'a>(text: &'a str, before: &str, after: &str) -> impl Iterator<Item = &'a str> {
    text.split(before).skip(1).map(move |rest| rest.split(after).next().unwrap())
}

/// The value of an attribute in the text of an element.
fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    parts(element, &format!("{name}=\""), "\"")
        .next()
        .unwrap_or_else(|| panic!("no {name}: {element}"))
}

#[test]
fn every_scene_is_a_point_of_each_method_in_its_own_panel() {
    let dir = tempfile::tempdir().unwrap();
    let html = evaluate(dir.path(), &WORLDS);
    let data = parts(&html, "id=\"data\">", "</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    let (methods, scenes) =
        (data["methods"].as_array().unwrap(), data["scenes"].as_array().unwrap());
    assert_eq!(scenes.len(), 9 * 2 + 3 * 2);
    let plot = parts(&html, "id=\"plot-points\"", "</figure>").next().unwrap();
    let mut points = Vec::new();
    for panel in parts(plot, "<div data-world", "</div>") {
        let panel = format!("data-world{panel}");
        let setting =
            ["world", "type", "level"].map(|name| attribute(&panel, &format!("data-{name}")));
        for group in parts(&panel, "<g class", "</g>") {
            let method: usize = attribute(group, "data-method").parse().unwrap();
            assert_eq!(methods[method], attribute(group, "data-name"));
            for path in parts(group, "<path", "/>") {
                let listed: Vec<usize> =
                    attribute(path, "data-scenes").split(',').map(|n| n.parse().unwrap()).collect();
                assert_eq!(attribute(path, " d").matches('M').count(), listed.len());
                let is_failed = attribute(path, "class") == "failed";
                for scene in listed {
                    let of = ["world", "type", "level"]
                        .map(|name| scenes[scene][name].as_str().unwrap());
                    assert_eq!(of, setting);
                    points.push((scene, method, is_failed));
                }
            }
        }
    }
    points.sort();
    let run = |(scene, method): (usize, usize)| {
        let runs = scenes[scene]["runs"].as_array().unwrap();
        runs.iter().find(|r| r["method"] == method).unwrap()
    };
    let mut expected = Vec::new();
    for scene in 0..scenes.len() {
        for method in 0..methods.len() {
            let run = run((scene, method));
            if run["applies"] != false {
                expected.push((scene, method, run["ok"] == false));
            }
        }
    }
    assert_eq!(points, expected, "each once");
    assert!(points.iter().any(|p| p.2) && points.iter().any(|p| !p.2));
}

#[test]
fn home_against_away_comes_first_and_drives_have_their_tables() {
    let dir = tempfile::tempdir().unwrap();
    let driven = ["--drive", "--standstill-steering", "at-changes", "--margin", "0.1"];
    let html = evaluate(dir.path(), &[&WORLDS[..], &driven[..]].concat());
    let sections: Vec<&str> = parts(&html, "<section", ">").collect();
    assert_eq!(sections[1], " id=\"away\"", "{sections:?}");
    let away = parts(&html, "<section id=\"away\"", "</section>").next().unwrap();
    let headings: Vec<&str> = parts(away, "<h3>", "</h3>").collect();
    assert_eq!(headings[..3], ["Speed, all types", "Quality, all types", "Failures, all types"]);
    assert!(away.contains("Away from home, n3p is") && away.contains("times as fast as ha-rs"));
    let markdown = std::fs::read_to_string(dir.path().join("out/report.md")).unwrap();
    let tables: Vec<&str> = markdown.lines().filter(|l| l.starts_with("## ")).collect();
    assert_eq!(tables[0], "## Home against away", "{tables:?}");
    assert!(tables.last().unwrap().starts_with("## Driven"), "{tables:?}");
    // Median and P95 of every setting, also of continuous paths.
    let header = markdown.lines().find(|l| l.contains("| median T | P95 T |")).unwrap();
    let column = header.split('|').position(|cell| cell.trim() == "P95 T").unwrap();
    let lines: Vec<&str> = markdown.lines().filter(|l| l.contains("| n3p | this run |")).collect();
    assert_eq!(lines.len(), 9 + 3);
    for line in lines {
        let cells: Vec<f64> = [column - 1, column]
            .map(|i| line.split('|').nth(i).unwrap().trim().parse().unwrap())
            .to_vec();
        assert!(0.0 < cells[0] && cells[0] <= cells[1], "{line}");
    }
    // One line for each method and setting that anything was driven of; they add up to drives.csv.
    let csv = std::fs::read_to_string(dir.path().join("out/drives.csv")).unwrap();
    let parked = csv.lines().filter(|l| l.split(',').nth(5) == Some("true")).count();
    let table = parts(&html, "id=\"drive-table\"", "</table>").next().unwrap();
    let (mut driven, mut in_time) = (0, 0);
    for line in parts(table, "data-method", "</tr>") {
        assert!(line.contains("data-world=") && line.contains("data-type="), "{line}");
        let cells: Vec<&str> = parts(line, "<td>", "</td>").collect();
        assert_eq!(cells.len(), 10);
        driven += cells[0].parse::<usize>().unwrap();
        in_time += cells[1].parse::<usize>().unwrap();
    }
    assert_eq!((driven, in_time), (csv.lines().count() - 1, parked));
    assert!(parked > 0);
    let told = markdown.split("## Driven").nth(1).unwrap();
    assert_eq!(told.matches("| n3p |").count(), table.matches("data-method=\"n3p\"").count());
}

/// A browser that starts.
fn chromium() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let starts = |name: &&str| {
        Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success())
    };
    names.into_iter().find(starts)
}

/// Added to a copy of the page: tries everything and leaves the findings as attributes.
const PROBE: &str = r##"<script>
{
  const at = (id) => document.getElementById(id);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const found = document.documentElement.dataset;
  const data = JSON.parse(at("data").textContent);
  const problems = [];
  const expect = (holds, what) => { if (!holds) problems.push(what); };
  const choose = (id, value) => {
    at(id).value = value;
    at(id).dispatchEvent(new Event("change", { bubbles: true }));
  };
  const isSeen = (element) => element.getClientRects().length > 0;
  const runOf = (scene, method) => scene.runs.find((run) => run.method === method);
  // Browsers write down only so many addresses a minute.
  let address = "";
  const { pushState } = history;
  history.pushState = history.replaceState = (state, title, url) => { address = url; };
  const listed = () => [...at("scene").options].map((option) => Number(option.value));

  // Every method in every scene.
  let ends = 0, worst = 0;
  data.scenes.forEach((scene, s) => scene.runs.forEach((run) => {
    choose("scene", s);
    const radio = document.querySelector(`#runs input[value="${run.method}"]`);
    radio.click();
    expect(radio.checked, `${scene.name}: method ${run.method} not chosen`);
    expect(address === `#play-${s}-${run.method}`, `${scene.name}: the address is ${address}`);
    expect(at("verdict").hidden === (run.ok ?? true), `${scene.name}: verdict`);
    if (!run.start) return;
    choose("time", at("time").max);
    at("time").dispatchEvent(new Event("input"));
    const matrix = document.querySelector("#map .car").transform.baseVal.consolidate().matrix;
    worst = Math.max(worst, Math.hypot(matrix.e - scene.goal[0], matrix.f - scene.goal[1]));
    ends += 1;
  }));
  found.ends = ends;
  found.worst = worst;

  // In every order the greatest come first, and the first is shown.
  const failures = (scene) => scene.runs.filter((run) => run.ok === false && run.applies !== false).length;
  const orders = {
    quality: (run) => run.over,
    slowest: (run) => run.applies === false ? undefined : run.time,
    changes: (run) => run.changes,
    clearance: (run) => run.clearance === undefined ? undefined : -run.clearance,
    failures: (run, scene) => (run.ok === false && run.applies !== false ? 100 : 0) + failures(scene),
    run: () => 0,
  };
  expect([...at("order").options].map((o) => o.value).sort().join() === Object.keys(orders).sort().join(), "orders");
  data.methods.forEach((name, method) => {
    document.querySelector(`#runs input[value="${method}"]`).click();
    for (const [order, value] of Object.entries(orders)) {
      choose("order", order);
      const list = listed();
      expect(list.length === data.scenes.length && new Set(list).size === list.length, `${order}: not every scene once`);
      const values = list.map((i) => value(runOf(data.scenes[i], method), data.scenes[i]) ?? -Infinity);
      expect(values.every((v, i) => i === 0 || v < values[i - 1] || (v === values[i - 1] && list[i] > list[i - 1])),
        `${order} of ${name}: ${values}`);
      expect(Number(at("scene").value) === list[0], `${order} of ${name}: the first is not shown`);
    }
  });

  // Each choice of the filter acts on plots, tables and gallery alike.
  const NAMES = ["world", "type", "level"];
  const about = ["#plot-points .panels > div", "#plot-time .panels > div", "#plot-speed .panels > div",
    "#tables tbody", "#quality-table tbody:not([data-slice])", "#failure-table tbody tr", "#drive-table tr[data-type]"];
  const tries = [["lots", "", ""], ["home", "", ""], ["", "parallel", ""], ["home", "reverse", "easy"], ["", "", "extreme"], ["", "", ""]];
  for (const wanted of tries) {
    NAMES.forEach((name) => { at(`filter-${name}`).value = ""; });
    NAMES.forEach((name, i) => choose(`filter-${name}`, wanted[i]));
    const fits = (setting) => wanted.every((value, i) => !value || value === setting[NAMES[i]]);
    const left = data.scenes.filter(fits);
    for (const selector of about) {
      const elements = all(selector);
      expect(elements.every((e) => !e.hidden === fits(e.dataset)), `${wanted}: ${selector}`);
    }
    expect(listed().length === left.length && listed().every((i) => fits(data.scenes[i])), `${wanted}: gallery`);
    expect(fits(data.scenes[at("scene").value]), `${wanted}: the scene shown`);
    const numbers = all("dl.tiles").filter(isSeen);
    expect(numbers.length === 1 && numbers[0].querySelector("dd").textContent === String(left.length), `${wanted}: tiles`);
    const lines = all("#methods tbody").filter(isSeen);
    const applies = left.filter((s) => runOf(s, 0).applies !== false).length;
    expect(lines.length === 1 && lines[0].rows[0].cells[2].textContent.endsWith(` of ${applies}`), `${wanted}: methods`);
    expect(isSeen(at("away")) === (!wanted[0] && !wanted[2]), `${wanted}: home against away`);
  }
  // What would leave nothing cannot be chosen.
  choose("filter-world", "lots");
  expect([...at("filter-level").options].find((o) => o.value === "easy").disabled, "easy in lots");
  at("filter-none").click();
  expect(at("filter-world").value === "" && at("filter-none").hidden, "all again");

  // Every point of every plot leads to its scene and method: by key to each, by a click where none is within a few pixels.
  const key = (target, name) => target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  let reached = 0, clicked = 0;
  for (const svg of all(".plot svg:has([data-scenes])")) {
    expect(svg.tabIndex === 0, "a plot that Tab does not reach");
    const points = [];
    for (const path of svg.querySelectorAll("[data-scenes]")) {
      const starts = [...path.getAttribute("d").matchAll(/M([\d.-]+) ([\d.-]+)/g)];
      const scenes = path.dataset.scenes.split(",");
      starts.forEach(([, x, y], i) => points.push({ x: +x, y: +y, method: data.methods.indexOf(path.parentNode.dataset.name), scene: scenes[i] }));
    }
    const hash = (p) => `#play-${p.scene}-${p.method}`;
    const shows = (p) => at("scene").value === p.scene && document.querySelector("#runs input:checked").value === String(p.method);
    const rows = new Map();
    for (const p of points) rows.set(p.method, [...(rows.get(p.method) ?? []), p].sort((a, b) => a.x - b.x || a.scene - b.scene));
    svg.focus();
    key(svg, "Home");
    [...rows.values()].forEach((row, i) => {
      if (i) key(svg, "ArrowDown");
      key(svg, "Home");
      for (const point of row) {
        key(svg, "Enter");
        expect(address === hash(point), `Enter on ${hash(point)} leads to ${address}`);
        expect(shows(point), `Enter on ${hash(point)} shows another`);
        reached += 1;
        svg.focus();
        key(svg, "ArrowRight");
      }
    });
    expect(reached > 0 && isSeen(at("point")) && at("point").textContent.includes(data.methods[[...rows.keys()].at(-1)]), "what is told of a point");
    for (const point of points) {
      if (points.some((p) => p !== point && Math.hypot(p.x - point.x, p.y - point.y) < 3)) continue;
      // What is opened is scrolled to.
      const { x, y } = new DOMPoint(point.x, point.y).matrixTransform(svg.getScreenCTM());
      svg.dispatchEvent(new MouseEvent("click", { clientX: x, clientY: y, bubbles: true }));
      expect(address === hash(point) && shows(point), `a click on ${hash(point)} leads to ${address}`);
      clicked += 1;
    }
    key(svg, "Escape");
    expect(at("point").hidden, "Escape");
  }
  found.reached = reached;
  found.clicked = clicked;
  const one = document.querySelector("#point-methods button:last-child");
  one.click();
  expect(all("#plot-points g[data-method]:not(.faint)").every((g) => g.dataset.method === one.value), "one method alone");
  one.click();
  expect(all("#plot-points .faint").length === 0, "all methods again");

  choose("order", "run");
  const press = (name) => key(at("gallery"), name);
  key(at("map"), "ArrowLeft");
  const before = at("scene").value;
  press("n");
  found.moved = before !== at("scene").value;
  press("z");
  found.zoomed = at("zoom").getAttribute("aria-pressed");
  at("copy").click();
  expect(address === `#play-${at("scene").value}-${document.querySelector("#runs input:checked").value}`, "the link to copy");
  expect(document.documentElement.scrollWidth <= innerWidth, `${document.documentElement.scrollWidth} wide in a window of ${innerWidth}`);
  at("theme").click();
  at("show-paper").click();
  // A link shows its scene though the filter hides it.
  choose("filter-world", "lots");
  found.problems = problems.slice(0, 20).join("; ");
  addEventListener("hashchange", () => {
    if (location.hash === "#play-0-0") found.followed = `${at("scene").value} ${at("filter-world").value}`;
  });
  pushState.call(history, null, "", "#play-1-1");
  location.hash = "#play-0-0";
}
</script>"##;

#[test]
#[ignore = "needs Chromium on the PATH"]
fn the_page_works_in_a_browser() {
    let chromium = chromium().expect("Chromium on the PATH");
    let dir = tempfile::tempdir().unwrap();
    let html = evaluate(dir.path(), &[&WORLDS[..], &["--drive"]].concat());
    let page = dir.path().join("out/report.html");
    std::fs::write(&page, html.replace("</body>", &format!("{PROBE}</body>"))).unwrap();
    for size in ["1280,900", "500,740"] {
        let dom = dom_of(chromium, &page, size, &dir.path().join(size));
        let root = dom.split("<head>").next().unwrap();
        let attribute = |name: &str| -> Option<&str> {
            root.split_once(&format!("data-{name}=\"")).and_then(|(_, rest)| rest.split('"').next())
        };
        assert_eq!(attribute("error"), None, "{root}");
        assert_eq!(attribute("problems"), Some(""), "{root}");
        assert_eq!(attribute("ready"), Some("24"), "{root}");
        // All of n3p's, and what the others found within their budget.
        let ends: usize = attribute("ends").unwrap().parse().unwrap();
        assert!((24..=80).contains(&ends), "{root}");
        let worst: f64 = attribute("worst").unwrap().parse().unwrap();
        assert!(worst < 2e-3, "a path ends {worst} m from the goal");
        // Three plots of 24 scenes, each by three methods and in the parallel ones by sha, too.
        let points = 3 * (24 * 3 + 8);
        assert_eq!(attribute("reached"), Some(&points.to_string()[..]), "{root}");
        let clicked: usize = attribute("clicked").unwrap().parse().unwrap();
        assert!(clicked > points / 2, "{root}");
        assert_eq!(attribute("moved"), Some("true"), "{root}");
        assert_eq!(attribute("zoomed"), Some("true"), "{root}");
        assert_eq!(attribute("theme"), Some("light"), "{root}");
        assert_eq!(attribute("paper"), Some("off"), "{root}");
        assert_eq!(attribute("followed"), Some("0 "), "{root}");
        // Four methods in three types of three levels and once more away.
        assert_eq!(dom.matches("<table class=\"results\"").count(), 4);
        let tables = parts(&dom, "id=\"tables\"", "</section>").next().unwrap();
        assert_eq!(tables.matches("data-method=").count(), 48);
        let map = dom.split("id=\"map\"").nth(1).unwrap().split("</svg>").next().unwrap();
        for class in ["obstacle", "goal", "car", "wheel"] {
            assert!(map.contains(&format!("class=\"{class}")), "no {class} in the map");
        }
        assert_eq!(dom.split("id=\"runs\"").nth(1).unwrap().matches("type=\"radio\"").count(), 4);
    }
}

/// The page after its scripts ran, in a window of some size.
fn dom_of(chromium: &str, page: &Path, size: &str, profile: &Path) -> String {
    let output = assert_cmd::Command::new(chromium)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000"])
        .arg(format!("--window-size={size}"))
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .timeout(Duration::from_secs(120))
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).into_owned()
}
