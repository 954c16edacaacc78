//! What there is to choose from.

use n3p::{Method, Vehicle};
use serde_json::{Value, json};

/// Methods in words, ours first.
const METHODS: [(Method, &str, &str); 7] = [
    (Method::N3P, "N3P", "known manoeuvres first, a search only where none fits"),
    (Method::KNN_N3P, "N3P of the paper", "one learned preparatory pose, then two short searches"),
    (
        Method::HA_RS,
        "Hybrid A* + curves",
        "a search that tries Reeds-Shepp curves to the goal on its way",
    ),
    (Method::HA, "Hybrid A*", "a plain search"),
    (Method::HA_HOLD, "Hybrid A*, best of 5", "a search that compares its first five solutions"),
    (
        Method::MHHA,
        "Multi-heuristic A*",
        "a search with several estimates of what is left to drive",
    ),
    (Method::SHA, "Exit first", "for parallel spots: a search to where the way out ends"),
];

/// Length, width, wheelbase, rear overhang, metres; steering limit, radians.
const VEHICLES: [(&str, [f64; 5]); 4] = [
    ("Small car", [3.60, 1.65, 2.42, 0.48, 0.62]),
    ("Wide car", [4.69, 1.942, 2.8, 0.93, 0.75]),
    ("Van", [5.93, 2.02, 3.67, 1.25, 0.63]),
    ("Bus", [12.0, 2.55, 5.90, 3.40, 0.80]),
];

/// Scenes of the project's own generators (`n3p-scene generate`, worlds `home` and `lots`), rounded to the
/// millimetre.
const EXAMPLES: [(&str, &str); 10] = [
    ("Reverse into a bay", include_str!("../examples/reverse.json")),
    ("Forward into a bay", include_str!("../examples/forward.json")),
    ("Parallel parking", include_str!("../examples/parallel.json")),
    ("An angled bay", include_str!("../examples/angled.json")),
    ("A tight parallel gap", include_str!("../examples/tight-parallel.json")),
    ("A car park", include_str!("../examples/car-park.json")),
    ("A curved street", include_str!("../examples/curved-street.json")),
    ("Angled bays in a lot", include_str!("../examples/angled-lot.json")),
    ("A corner of a car park", include_str!("../examples/corner.json")),
    ("As a range sensor sees it", include_str!("../examples/scan.json")),
];

/// Methods, vehicles and examples.
pub fn catalogue() -> Value {
    let method = |(method, title, words): &(Method, &str, &str)| json!({ "name": method.name(), "title": title, "words": words });
    let usual = [("Car", Vehicle::default())];
    let others = VEHICLES.map(|(name, [length, width, wheelbase, rear_overhang, max_steer])| {
        let sizes = Vehicle { length, width, wheelbase, rear_overhang, ..Vehicle::default() };
        (name, Vehicle { max_steer, ..sizes })
    });
    let vehicle = |(name, vehicle): (&str, Vehicle)| json!({ "name": name, "vehicle": vehicle });
    let example = |(title, scene): &(&str, &str)| {
        let scene: Value = serde_json::from_str(scene).expect("it was written by the generator");
        json!({ "title": title, "scene": scene })
    };
    json!({
        "methods": METHODS.iter().map(method).collect::<Value>(),
        "vehicles": usual.into_iter().chain(others).map(vehicle).collect::<Value>(),
        "examples": EXAMPLES.iter().map(example).collect::<Value>(),
        "version": env!("CARGO_PKG_VERSION"),
    })
}
