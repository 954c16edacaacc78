//! What the page asks, and what it must never be able to do to the planner.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use n3p_play::answer;
use serde_json::{Value, json};

fn ask(request: &Value) -> Value {
    serde_json::from_str(&answer(&request.to_string())).expect("answers are JSON")
}

fn message(answer: &Value) -> &str {
    answer["error"]["message"].as_str().unwrap_or_else(|| panic!("no error: {answer}"))
}

fn plan(scene: &Value, methods: &[&str], wish: Value) -> Value {
    ask(&json!({ "plan": { "scene": scene, "methods": methods, "wish": wish } }))
}

fn examples() -> Vec<(String, Value)> {
    let catalogue = ask(&json!({ "catalogue": {} }));
    let one = |e: &Value| (e["title"].as_str().unwrap().to_owned(), e["scene"].clone());
    catalogue["examples"].as_array().unwrap().iter().map(one).collect()
}

#[test]
fn every_example_is_planned_and_tells_all_that_the_page_shows() {
    let all = examples();
    assert!(all.len() >= 8, "{}", all.len());
    let mut by_known_manoeuvre = 0;
    for (title, scene) in all {
        let wish = json!({ "margin": 0.1, "motion": true, "explain": true });
        let answer = plan(&scene, &["n3p", "ha-rs"], wish);
        let plans = answer["plans"].as_array().unwrap_or_else(|| panic!("{title}: {answer}"));
        assert_eq!(plans.len(), 2, "{title}");
        for plan in plans {
            let poses = plan["path"]["poses"].as_array().unwrap();
            let apart = |i: usize, pose: &Value| {
                (poses[i][0].as_f64().unwrap() - pose[0].as_f64().unwrap())
                    .hypot(poses[i][1].as_f64().unwrap() - pose[1].as_f64().unwrap())
            };
            assert!(apart(0, &scene["start"]) < 1e-3, "{title}");
            assert!(apart(poses.len() - 1, &scene["goal"]) < 1e-3, "{title}");
            assert_eq!(plan["path"]["gears"].as_array().unwrap().len(), poses.len());
            assert!(
                plan["plan_us"].as_f64().unwrap() > 0.0 && plan["length_m"].as_f64().unwrap() > 1.0
            );
            let motion = &plan["motion"];
            let last = motion["time"].as_array().unwrap().last().unwrap().as_f64().unwrap();
            assert!((last - motion["duration_s"].as_f64().unwrap()).abs() < 0.02, "{title}");
            assert!(motion["duration_s"].as_f64().unwrap() > 3.0, "{title}");
        }
        let spot = &plans[0]["spot"];
        assert!(spot["lane_and_spot"][1].as_array().unwrap().len() == 4, "{title}: {spot}");
        let tried = plans[0]["tried"].as_array().unwrap();
        assert!(!tried.is_empty(), "{title}");
        if spot["route"] == "library" {
            by_known_manoeuvre += 1;
            let joined = tried.iter().filter(|t| t["fate"] == "joined");
            let prepared = |t: &Value| t["preparatory"] == rounded(&spot["preparatory"]);
            assert!(joined.into_iter().any(prepared), "{title}: the one taken was not told of");
        }
    }
    assert!(by_known_manoeuvre >= 5, "{by_known_manoeuvre}");
}

/// A pose as answers have it.
fn rounded(pose: &Value) -> Value {
    pose.as_array()
        .unwrap()
        .iter()
        .map(|v| json!((v.as_f64().unwrap() * 1e4).round() / 1e4))
        .collect()
}

#[test]
fn the_same_question_has_the_same_answer_whatever_came_before() {
    let all = examples();
    let ask = |scene: &Value| {
        let mut answer = plan(scene, &["n3p"], json!({ "explain": true }));
        let plan = answer["plans"][0].as_object_mut().unwrap();
        plan.remove("plan_us");
        plan.remove("timed");
        answer
    };
    let first: Vec<Value> = all.iter().map(|(_, scene)| ask(scene)).collect();
    let again: Vec<Value> = all.iter().rev().map(|(_, scene)| ask(scene)).collect();
    assert!(first.iter().eq(again.iter().rev()));
}

#[test]
fn continuous_steering_and_margins_are_kept() {
    let (_, scene) = &examples()[0];
    let wish = json!({ "margin": 0.3, "standstill_steering": "at-changes", "motion": true });
    let plan = &plan(scene, &["n3p"], wish)["plans"][0];
    assert!(plan["way_clearance_m"].as_f64().unwrap() > 0.2, "{plan}");
    // Wheels turn where the gear changes and at the start, and nowhere else.
    assert!(
        plan["motion"]["stops"].as_u64() <= Some(plan["direction_changes"].as_u64().unwrap() + 1)
    );
    let told = plan["path"]["poses"].as_array().unwrap().len();
    assert!(told > 100, "{told}");
}

#[test]
fn every_vehicle_is_planned_for() {
    let catalogue = ask(&json!({ "catalogue": {} }));
    for vehicle in catalogue["vehicles"].as_array().unwrap() {
        let v = &vehicle["vehicle"];
        // A way along a wall, wide enough for any of them.
        let scene = json!({ "vehicle": v, "start": [-30.0, 0.0, 0.0], "goal": [10.0, 3.0, 0.0],
            "obstacles": [[[-40.0, 12.0], [40.0, 12.0]]] });
        let answer = plan(&scene, &["n3p"], json!({}));
        assert!(answer["plans"][0]["path"].is_object(), "{}: {answer}", vehicle["name"]);
    }
}

#[test]
fn what_is_wrong_is_said_in_plain_words() {
    let (_, scene) = examples().remove(0);
    let with = |key: &str, value: Value| {
        let mut scene = scene.clone();
        scene[key] = value;
        plan(&scene, &["n3p"], json!({}))
    };
    // A corner of the first obstacle is where the car is to start.
    let corner = &scene["obstacles"][0][0];
    let answer = with("start", json!([corner[0], corner[1], 0.0]));
    assert_eq!(answer["error"]["field"], "start");
    assert_eq!(answer["error"]["touches"], "obstacles[0]");
    assert!(message(&answer).contains("deep in an obstacle"), "{answer}");
    let answer = with("goal", json!([corner[0], corner[1], 0.0]));
    assert_eq!(answer["error"]["field"], "goal");
    let answer = with("goal", json!([1e6, 0.0, 0.0]));
    assert!(
        message(&answer).contains("expected at most") || message(&answer).contains("plans up to"),
        "{answer}"
    );
    let answer = with("goal", json!([1500.0, 0.0, 0.0]));
    assert!(message(&answer).contains("plans up to"), "{answer}");
    let answer = with("vehicle", json!({ "length": 1 }));
    assert!(
        message(&answer).contains("wheelbase") || message(&answer).contains("width"),
        "{answer}"
    );
    assert!(message(&with("start", json!(["a", 1]))).contains("start"));
    assert!(message(&with("colour", json!("red"))).contains("colour"));
    let answer = plan(&scene, &["n3p"], json!({ "margin": -1.0 }));
    assert_eq!(answer["error"]["field"], "margin");
    let answer = plan(&scene, &["a-star"], json!({}));
    assert!(message(&answer).contains("a-star") && message(&answer).contains("n3p"), "{answer}");
    for method in ["rl-eval", "policy", "mlp-n3p"] {
        assert_eq!(plan(&scene, &[method], json!({}))["error"]["field"], "method", "{method}");
    }
    assert!(message(&plan(&scene, &[], json!({}))).contains("methods"));
    assert!(message(&plan(&scene, &["ha"; 5], json!({}))).contains("methods"));
    // The goal walled in: no path, and that is no error.
    let goal = [scene["goal"][0].as_f64().unwrap(), scene["goal"][1].as_f64().unwrap()];
    let [l, r, b, t] = [goal[0] - 6.0, goal[0] + 6.0, goal[1] - 6.0, goal[1] + 6.0];
    let walls = json!([[[l, b], [r, b]], [[r, b], [r, t]], [[r, t], [l, t]], [[l, t], [l, b]]]);
    let mut walled = scene.clone();
    walled["obstacles"] = walls;
    walled["start"] = json!([goal[0] - 20.0, goal[1], 0.0]);
    let answer = plan(&walled, &["n3p"], json!({}));
    assert!(answer["plans"][0]["no_path"].is_string(), "{answer}");
}

#[test]
fn what_is_no_request_is_an_answer_too() {
    let deep = "[".repeat(200_000);
    for request in [
        "",
        "{",
        "null",
        "[]",
        "\"plan\"",
        "{\"plan\":{}}",
        "{\"fly\":{}}",
        "{\"plan\":{\"scene\":1,\"methods\":[\"n3p\"]}}",
        "{\"load\":{\"name\":\"a.json\",\"bytes\":\"*\"}}",
        "{\"catalogue\":{\"x\":1}}",
        "\u{0}",
        &deep,
        "{\"plan\":{\"scene\":{\"vehicle\":null,\"start\":[NaN,0,0]},\"methods\":[\"n3p\"]}}",
    ] {
        let told: Value = serde_json::from_str(&answer(request)).unwrap();
        assert!(!message(&told).is_empty(), "{}", &request[..request.len().min(80)]);
        assert!(message(&told).len() < 500, "{told}");
    }
}

#[test]
fn numbers_without_sense_end_in_words() {
    let (_, scene) = examples().remove(0);
    for value in ["1e999", "-1e999", "1e308", "-0.0", "1e-320", "12345678901234567890"] {
        for key in ["start", "goal"] {
            let mut text = scene.to_string();
            let at = text.find(&format!("\"{key}\":[")).unwrap() + key.len() + 4;
            let end = at + text[at..].find(',').unwrap();
            text.replace_range(at..end, value);
            let request =
                format!("{{\"plan\":{{\"scene\":{text},\"methods\":[\"n3p\",\"ha-rs\"]}}}}");
            let told: Value = serde_json::from_str(&answer(&request)).unwrap();
            assert!(
                told["error"]["message"].is_string() || told["plans"].is_array(),
                "{value}: {told}"
            );
        }
    }
    // Many corners are refused before they cost anything.
    let mut scene = scene;
    scene["points"] = (0..200_001).map(|i| json!([i, 50])).collect();
    assert!(message(&plan(&scene, &["n3p"], json!({}))).contains("playground takes"));
}

#[test]
fn files_become_scenes() {
    let load = |name: &str, text: &str| {
        ask(&json!({ "load": { "name": name, "bytes": BASE64_STANDARD.encode(text) } }))
    };
    for (title, scene) in examples() {
        let loaded = load("mine.json", &scene.to_string());
        assert_eq!(loaded["scene"]["start"], scene["start"], "{title}");
        assert_eq!(loaded["scene"]["obstacles"], scene["obstacles"], "{title}");
        let again = load("mine.json", &loaded["scene"].to_string());
        assert_eq!(again, loaded, "{title}");
    }
    let case = "0,0,0,10,5,1.57,1,4,3,3,5,3,5,6,3,6";
    let loaded = load("Case1.csv", case);
    assert_eq!(loaded["scene"]["name"], "Case1");
    assert_eq!(loaded["scene"]["obstacles"].as_array().unwrap().len(), 1);
    assert!(message(&load("Case1.csv", "0,0,zero")).contains("zero"));
    assert!(message(&load("lot.pgm", "P5")).contains(".yaml"));
    assert!(message(&load("lot.json", "{}")).contains("vehicle"));
    assert!(message(&load("lot.json", "")).contains("empty"));
    // An occupancy grid needs its image, and gets a start and a goal to be moved.
    let yaml = "image: lot.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.2\n";
    assert!(message(&load("lot.yaml", yaml)).contains("lot.pgm"));
    let image = format!("P2 20 10 255 {} 0 {}", "254 ".repeat(19), "254 ".repeat(180));
    let [yaml, image] = [yaml, &image].map(|text| BASE64_STANDARD.encode(text));
    let others = json!([{ "name": "lot.pgm", "bytes": image }]);
    let load = json!({ "load": { "name": "lot.yaml", "bytes": yaml, "others": others } });
    let scene = &ask(&load)["scene"];
    assert_eq!(scene["obstacles"], json!([[[19.0, 9.0], [20.0, 9.0], [20.0, 10.0], [19.0, 10.0]]]));
    assert!(ask(&json!({ "plan": { "scene": scene, "methods": ["ha-rs"] } }))["plans"].is_array());
}
