//! `report.html` in a browser: what it shows, and that its paths end at the goal.
//!
//! The second test needs Chromium on the PATH, so it runs only where it is asked for:
//! `cargo test --release --test report -- --ignored`.

#![cfg(feature = "lab")]

use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Writes the results of a small evaluation with failures into `dir`.
fn evaluate(dir: &Path) {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/knn.bin");
    assert_cmd::Command::cargo_bin("n3p-eval")
        .unwrap()
        .current_dir(dir)
        .args(["--model", model.to_str().unwrap(), "--methods", "ha-rs,sha,knn-n3p,n3p"])
        .args(["--count", "2", "--seed", "77", "--max-expansions", "100", "--out", "out"])
        .assert()
        .success();
}

#[test]
fn a_report_lies_beside_the_rows() {
    let dir = tempfile::tempdir().unwrap();
    evaluate(dir.path());
    let traces = std::fs::read_to_string(dir.path().join("out/traces.jsonl")).unwrap();
    assert_eq!(traces.lines().count(), 18 * 4);
    let html = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    assert!(html.contains("easy-forward-0000") && html.contains("budget spent"));
    assert!(html.len() < 1_000_000, "{} bytes", html.len());
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
  const found = document.documentElement.dataset;
  const data = JSON.parse(at("data").textContent);
  const problems = [];
  let ends = 0, worst = 0;
  data.scenes.forEach((scene, s) => scene.runs.forEach((run) => {
    location.hash = "";
    at("kind").value = scene.type;
    at("kind").dispatchEvent(new Event("change"));
    at("level").value = scene.level;
    at("level").dispatchEvent(new Event("change"));
    at("scene").value = s;
    at("scene").dispatchEvent(new Event("change"));
    const radio = document.querySelector(`#runs input[value="${run.method}"]`);
    radio.click();
    if (!radio.checked) problems.push(`${scene.name}: method ${run.method} not chosen`);
    if (at("verdict").hidden !== run.ok) problems.push(`${scene.name}: verdict`);
    if (!run.start) return;
    at("time").value = at("time").max;
    at("time").dispatchEvent(new Event("input"));
    const matrix = document.querySelector("#map .car").transform.baseVal.consolidate().matrix;
    const goal = [scene.goal[0] - scene.view[0], scene.view[3] - scene.goal[1]];
    worst = Math.max(worst, Math.hypot(matrix.e - goal[0], matrix.f - goal[1]));
    ends += 1;
  }));
  found.ends = ends;
  found.worst = worst;
  const press = (key) => at("gallery").dispatchEvent(new KeyboardEvent("keydown", { key }));
  at("map").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft", bubbles: true }));
  const before = at("scene").value;
  press("n");
  found.moved = before !== at("scene").value;
  press("z");
  found.zoomed = at("zoom").getAttribute("aria-pressed");
  at("theme").click();
  at("show-paper").click();
  found.problems = problems.join("; ");
  location.hash = "#play-0-0";
  addEventListener("hashchange", () => { found.followed = at("scene").value; });
}
</script>"##;

#[test]
#[ignore = "needs Chromium on the PATH"]
fn the_page_works_in_a_browser() {
    let chromium = chromium().expect("Chromium on the PATH");
    let dir = tempfile::tempdir().unwrap();
    evaluate(dir.path());
    let page = dir.path().join("out/report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    std::fs::write(&page, html.replace("</body>", &format!("{PROBE}</body>"))).unwrap();
    let output = assert_cmd::Command::new(chromium)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=5000"])
        .arg(format!("--user-data-dir={}", dir.path().join("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .timeout(Duration::from_secs(120))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let root = dom.split("<head>").next().unwrap();
    let attribute = |name: &str| -> Option<&str> {
        root.split_once(&format!("data-{name}=\"")).and_then(|(_, rest)| rest.split('"').next())
    };
    assert_eq!(attribute("error"), None, "{root}");
    assert_eq!(attribute("problems"), Some(""), "{root}");
    assert_eq!(attribute("ready"), Some("18"), "{root}");
    // All of n3p's, and what the others found within their budget.
    let ends: usize = attribute("ends").unwrap().parse().unwrap();
    assert!((18..=60).contains(&ends), "{root}");
    let worst: f64 = attribute("worst").unwrap().parse().unwrap();
    assert!(worst < 2e-3, "a path ends {worst} m from the goal");
    assert_eq!(attribute("moved"), Some("true"), "{root}");
    assert_eq!(attribute("zoomed"), Some("true"), "{root}");
    assert_eq!(attribute("theme"), Some("light"), "{root}");
    assert_eq!(attribute("paper"), Some("off"), "{root}");
    assert_eq!(attribute("followed"), Some("0"), "{root}");
    // Four methods in three types of three levels, and the gallery's table of the scene shown.
    assert_eq!(dom.matches("<table class=\"results\"").count(), 3);
    assert_eq!(dom.split("id=\"tables\"").nth(1).unwrap().matches("data-method=").count(), 36);
    let map = dom.split("id=\"map\"").nth(1).unwrap().split("</svg>").next().unwrap();
    for class in ["obstacle", "goal", "car", "wheel"] {
        assert!(map.contains(&format!("class=\"{class}")), "no {class} in the map");
    }
    assert_eq!(dom.split("id=\"runs\"").nth(1).unwrap().matches("type=\"radio\"").count(), 4);
}
