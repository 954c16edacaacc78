//! Other people's crates are what deny.toml allows, and no newer than the Rust that we ask for.

#![cfg(feature = "lab")]

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

/// What cargo knows of this workspace, all features.
fn metadata() -> Value {
    let mut command = Command::new(std::env::var("CARGO").unwrap_or("cargo".into()));
    command.args(["metadata", "--format-version", "1", "--locked", "--offline"]);
    command.args(["--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")]);
    let mut output = command.output().unwrap();
    if !output.status.success() {
        // Crates of other systems are fetched by nobody before.
        command.args(["--filter-platform", "x86_64-unknown-linux-gnu"]);
        output = command.output().unwrap();
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn deny() -> toml::Table {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/deny.toml");
    toml::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn packages(metadata: &Value) -> impl Iterator<Item = &Value> {
    metadata["packages"].as_array().unwrap().iter()
}

/// Whether an expression of SPDX holds with these licences: OR of ANDs of names and parentheses.
fn is_allowed(expression: &str, allowed: &dyn Fn(&str) -> bool) -> bool {
    // Split where no parenthesis is open.
    let split = |text: &str, by: &str| {
        let (mut parts, mut depth) = (vec![String::new()], 0);
        for word in
            text.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ").split_whitespace()
        {
            depth += i32::from(word == "(") - i32::from(word == ")");
            if word == by && depth == 0 {
                parts.push(String::new());
            } else {
                let part = parts.last_mut().unwrap();
                part.push_str(if part.is_empty() { "" } else { " " });
                part.push_str(word);
            }
        }
        parts
    };
    let ors = split(expression, "OR");
    if ors.len() > 1 {
        return ors.iter().any(|part| is_allowed(part, allowed));
    }
    let ands = split(expression, "AND");
    if ands.len() > 1 {
        return ands.iter().all(|part| is_allowed(part, allowed));
    }
    let bare = ors[0].strip_prefix("( ").and_then(|inner| inner.strip_suffix(" )"));
    bare.map_or_else(|| allowed(&ors[0]), |inner| is_allowed(inner, allowed))
}

#[test]
fn expressions_are_read_as_they_are_meant() {
    let allowed = |name: &str| ["MIT", "A WITH B", "U"].contains(&name);
    for (expression, expected) in [
        ("MIT", true),
        ("GPL", false),
        ("GPL OR MIT", true),
        ("GPL/MIT", true),
        ("GPL AND MIT", false),
        ("A WITH B OR GPL", true),
        ("A OR GPL", false),
        ("(MIT OR GPL) AND U", true),
        ("(MIT OR GPL) AND V", false),
        ("MIT AND (GPL OR (U AND MIT))", true),
    ] {
        assert_eq!(is_allowed(expression, &allowed), expected, "{expression}");
    }
}

#[test]
fn licences_and_sources_are_allowed() {
    let (metadata, deny) = (metadata(), deny());
    let names = |value: &toml::Value| -> Vec<String> {
        let all = value.as_array().unwrap().iter();
        all.map(|v| v.as_str().unwrap_or_else(|| v["crate"].as_str().unwrap()).to_owned()).collect()
    };
    let allow = names(&deny["licenses"]["allow"]);
    let exceptions: BTreeMap<String, Vec<String>> = deny["licenses"]["exceptions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| (e["crate"].as_str().unwrap().to_owned(), names(&e["allow"])))
        .collect();
    let banned = names(&deny["bans"]["deny"]);
    let mut seen = 0;
    for package in packages(&metadata) {
        let name = package["name"].as_str().unwrap();
        let licence = package["license"].as_str().unwrap_or("none");
        let more = exceptions.get(name);
        let allowed = |l: &str| allow.iter().chain(more.into_iter().flatten()).any(|a| a == l);
        assert!(is_allowed(licence, &allowed), "{name}: {licence} is not allowed by deny.toml");
        assert!(!banned.iter().any(|b| b == name), "{name} is banned by deny.toml");
        let crates_io = "registry+https://github.com/rust-lang/crates.io-index";
        assert!(
            package["source"].is_null() || package["source"] == crates_io,
            "{name} comes from {}",
            package["source"]
        );
        seen += 1;
    }
    assert!(seen > 100, "{seen} crates");
}

/// The `rust-version` of Cargo.toml is true of what we use, too.
#[test]
fn no_crate_asks_for_a_newer_rust() {
    let metadata = metadata();
    let version = |package: &Value| -> Vec<u32> {
        let text = package["rust_version"].as_str().unwrap_or("1");
        text.split('.').map(|part| part.parse().unwrap()).collect()
    };
    let ours = version(packages(&metadata).find(|p| p["name"] == "n3p").unwrap());
    for package in packages(&metadata) {
        let theirs = version(package);
        assert!(
            theirs[..2.min(theirs.len())] <= ours[..2],
            "{} asks for {theirs:?}",
            package["name"]
        );
    }
}
