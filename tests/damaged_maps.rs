//! Damaged maps: exit code 2 and one line or two, never a panic or a hang.
#![cfg(feature = "scene")]

use std::fs;
use std::path::Path;
use std::time::Duration;

use assert_cmd::Command;
use n3p::world::Map;
use tempfile::TempDir;

fn fixture(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/maps");
    fs::read(folder.join(name)).unwrap()
}

fn text(name: &str) -> String {
    String::from_utf8(fixture(name)).unwrap()
}

/// Files of one kind: each is refused by the program in one or two lines that have its part.
fn refused(ending: &str, files: Vec<(Vec<u8>, &str)>) {
    assert!(files.len() >= 20, "{} files", files.len());
    let folder = TempDir::new().unwrap();
    for image in ["lot.pgm", "lot.png"] {
        fs::write(folder.path().join(image), fixture(image)).unwrap();
    }
    for (i, (bytes, part)) in files.into_iter().enumerate() {
        let file = folder.path().join(format!("damaged-{i}.{ending}"));
        fs::write(&file, &bytes).unwrap();
        refuses(&file, part);
    }
}

fn refuses(file: &Path, part: &str) {
    let mut command = Command::cargo_bin("n3p-scene").unwrap();
    let output = command.arg("check").arg(file).timeout(Duration::from_secs(10)).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let name = file.file_name().unwrap().to_string_lossy();
    assert_eq!(output.status.code(), Some(2), "{name}: {said}");
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && said.lines().count() <= 2, "{name}: {said}");
    assert!(errors[0].contains(part) && errors[0].contains(&name[..]), "{part:?}: {said}");
    assert!(errors[0].len() < 500, "{said}");
}

/// Every text that begins as `bytes` does, and many with one bit flipped: read or refused.
fn survives(ending: &str, bytes: &[u8]) {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("lot.pgm"), fixture("lot.pgm")).unwrap();
    let file = folder.path().join(format!("damaged.{ending}"));
    let step = 1 + bytes.len() / 300;
    for end in (0..bytes.len()).step_by(step) {
        fs::write(&file, &bytes[..end]).unwrap();
        let _ = Map::read(&file);
        let mut flipped = bytes.to_vec();
        flipped[end] ^= 1 << (end % 8);
        fs::write(&file, flipped).unwrap();
        let _ = Map::read(&file);
    }
}

/// A text with a part replaced, which must be there.
fn with(text: &str, from: &str, to: &str) -> Vec<u8> {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn descriptions_of_grids() {
    let lot = text("lot.yaml");
    let changed = |from: &str, to: &str| with(&lot, from, to);
    refused(
        "yaml",
        vec![
            (vec![], "empty"),
            (b"\n \n".to_vec(), "empty"),
            (vec![0xFF, 0xFE, 0x00], "not text"),
            (b"- a\n- b\n".to_vec(), "KEY: VALUE"),
            (b"just words\n".to_vec(), "KEY: VALUE"),
            (b"image: [a, b\n".to_vec(), "not valid YAML"),
            (b"image: a: b\n".to_vec(), "not valid YAML"),
            (b"a: &a [1]\nb: *a\n".to_vec(), "anchor"),
            (changed("image: lot.pgm\n", ""), "image is missing"),
            (changed("lot.pgm", "none.pgm"), "no such file"),
            (changed("lot.pgm", "damaged-0.yaml"), "neither PGM"),
            (changed("lot.pgm", "."), "cannot be read"),
            (changed("resolution: 0.5\n", ""), "resolution is missing"),
            (changed("0.5", "-0.5"), "resolution is -0.5"),
            (changed("0.5", "0"), "resolution is 0"),
            (changed("0.5", ".nan"), "resolution is"),
            (changed("0.5", "NaN"), "resolution is"),
            (changed("0.5", "[0.5]x"), "YAML"),
            (changed("0.5", "[0.5, 1]"), "resolution is a list"),
            (changed("-3.0, -2.0, 0.3", "-3.0, -2.0"), "origin is"),
            (changed("-3.0, -2.0, 0.3", "a, b, c"), "origin is"),
            (changed("-3.0, -2.0, 0.3", "1e300, 0, 0"), "origin is"),
            (changed("negate: 0", "negate: 2"), "negate is"),
            (changed("0.65", "1.65"), "occupied_thresh is"),
            (changed("0.65", "0.1"), "free_thresh is"),
            (changed("trinary", "binary"), "mode is"),
            (changed("mode: trinary", "image: again"), "twice"),
            (format!("a: {}", "[".repeat(20_000)).into_bytes(), "YAML"),
        ],
    );
    survives("yaml", lot.as_bytes());
}

#[test]
fn images_of_grids() {
    let folder = TempDir::new().unwrap();
    let (pgm, png) = (fixture("lot.pgm"), fixture("lot.png"));
    let changed = |from: &str, to: &str| -> Vec<u8> {
        let at = pgm.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&pgm[..at], to.as_bytes(), &pgm[at + from.len()..]].concat()
    };
    let mut bad_crc = png.clone();
    bad_crc[20] ^= 1;
    let mut bad_data = png.clone();
    let end = bad_data.len();
    bad_data[end - 25] ^= 0xFF;
    // A head alone that claims 60000 × 60000 pixels, with a checksum that is right.
    let huge = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\0\0\0\0\xa5\xb9\x2a\x9e";
    let files: Vec<Vec<u8>> = vec![
        vec![],
        b"P5".to_vec(),
        b"P6\n1 1\n255\n...".to_vec(),
        b"P5\n12".to_vec(),
        changed("12 8", "12 -8"),
        changed("12 8", "0 8"),
        changed("12 8", "4000000000 4000000000"),
        changed("12 8", "99999999999999999999999 8"),
        changed("12 8", "12 9"),
        changed("255", "0"),
        changed("255", "65536"),
        changed("255", "65535"),
        changed("255", "x"),
        pgm[..pgm.len() - 1].to_vec(),
        pgm[..8].to_vec(),
        b"P2\n2 2\n255\n1 2 3".to_vec(),
        b"P2\n2 2\n255\n1 2 3 256".to_vec(),
        b"P2\n2 2\n255\n1 2 3 x".to_vec(),
        b"P5\n# a comment without end".to_vec(),
        png[..8].to_vec(),
        png[..30].to_vec(),
        png[..png.len() - 20].to_vec(),
        bad_crc,
        bad_data,
        huge.to_vec(),
        b"\x89PNG\r\n\x1a\n garbage".to_vec(),
        b"\x89PXG\r\n\x1a\n".to_vec(),
    ];
    assert!(files.len() >= 20);
    for (i, bytes) in files.into_iter().enumerate() {
        fs::write(folder.path().join("image"), bytes).unwrap();
        let file = folder.path().join(format!("grid-{i}.yaml"));
        fs::write(&file, text("lot.yaml").replace("lot.pgm", "image")).unwrap();
        refuses(&file, "image image ");
    }
    let grid = folder.path().join("grid.yaml");
    fs::write(&grid, text("lot.yaml").replace("lot.pgm", "image")).unwrap();
    for name in
        ["lot.pgm", "lot-ascii.pgm", "lot.png", "lot-rgba.png", "lot-1.png", "lot-palette.png"]
    {
        let bytes = fixture(name);
        for end in 0..bytes.len() {
            fs::write(folder.path().join("image"), &bytes[..end]).unwrap();
            let _ = Map::read(&grid);
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[end] ^= 1 << bit;
                fs::write(folder.path().join("image"), flipped).unwrap();
                let _ = Map::read(&grid);
            }
        }
    }
}

#[test]
fn clouds_as_tables() {
    let files = [
        ("", "empty"),
        ("\n\n", "empty"),
        ("x,y\n", "no point"),
        ("x,y\nnan,nan\n", "no point"),
        ("x,y\n1\n", "line 2 has 1 fields"),
        ("x,y\n1,2,3\n", "line 2 has 3 fields"),
        ("x,y\n1,two\n", "line 2 has \"two\""),
        ("x,y\n1,\n", "line 2 has \"\""),
        ("x,y\n1;2\n", "line 2 has"),
        ("x,y\n1,2\n3,4 5\n", "line 3 has"),
        ("x,y\n1,2e\n", "line 2 has"),
        ("x,z\n1,2\n", "y is no column"),
        ("a,b,c\n1,2,3\n", "x is no column"),
        ("lat,lon\n52.5,13.4\n", "x is no column"),
        ("1,2\n3,4\n5,6\n7,8\n9\n", "line 5 has 1 fields"),
        ("1,2\n3,4\n5,6\n7,8\nx,y\n", "line 5 has"),
        ("1,2,3\n4,5\n", "ends after 5"),
        ("0,0,0,1,1,1\n", "ends after 6"),
        ("0,0,0,1,1,1,1,4,0,0\n", "ends after"),
        ("0,0,0,1,1,x,0\n", "value 6"),
        ("{\"start\": 1}\n", "expected"),
    ];
    let mut files: Vec<(Vec<u8>, &str)> = files.map(|(text, part)| (text.into(), part)).into();
    files.push((vec![0xFF, 0xFE, b'1'], "not text"));
    refused("csv", files);
    survives("csv", &fixture("cloud.csv"));
}

#[test]
fn clouds_of_pcd() {
    let ascii = text("cloud-ascii.pcd");
    let binary = fixture("cloud-binary.pcd");
    let packed = fixture("cloud-compressed.pcd");
    let changed = |from: &str, to: &str| with(&ascii, from, to);
    let change = |bytes: &[u8], from: &str, to: &str| -> Vec<u8> {
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
    };
    let head = packed.windows(10).position(|w| w == b"compressed").unwrap() + 11;
    let mut unpacks_to_more = packed.clone();
    unpacks_to_more[head + 4] += 4;
    let mut damaged = packed.clone();
    damaged[head + 8] = 0xFF;
    let mut long = packed.clone();
    long[head] = 0xFF;
    refused(
        "pcd",
        vec![
            (vec![], "no line DATA"),
            (b"# .PCD v0.7\n".to_vec(), "no line DATA"),
            (vec![0; 5000], "no line DATA"),
            (changed("FIELDS x y z rgb\n", ""), "FIELDS is missing"),
            (changed("x y z rgb", "a y z rgb"), "expected x and y"),
            (changed("SIZE 4 4 4 4", "SIZE 4 4 4"), "SIZE has 3 entries"),
            (changed("SIZE 4 4 4 4", "SIZE 4 4 4 -4"), "SIZE is"),
            (changed("SIZE 4 4 4 4", "SIZE 3 4 4 4"), "TYPE of x"),
            (changed("TYPE F F F U", "TYPE F F F Q"), "TYPE of rgb"),
            (changed("COUNT 1 1 1 1", "COUNT 2 1 1 1"), "COUNT of x"),
            (changed("COUNT 1 1 1 1", "COUNT 1 1 1 99999999"), "COUNT is"),
            (changed("POINTS 5", "POINTS 6"), "it has 5 of 6"),
            (changed("POINTS 5", "POINTS many"), "POINTS is"),
            (changed("POINTS 5", "POINTS 18446744073709551615"), "cut short"),
            (changed("DATA ascii", "DATA text"), "DATA is"),
            (changed("1.2 255", "1.2"), "point 2 has 3 values"),
            (changed("1.2 255", "high 255"), "point 2 has \"high\""),
            (binary[..binary.len() - 1].to_vec(), "it has 4 of 5"),
            (change(&binary, "POINTS 5", "POINTS 4000000000"), "cut short"),
            (change(&binary, "POINTS 5", "POINTS 1844674407370955161"), "cut short"),
            (packed[..packed.len() - 1].to_vec(), "cut short"),
            (packed[..head + 6].to_vec(), "cut short"),
            (unpacks_to_more, "unpacks to 84 bytes"),
            (damaged, "cannot be unpacked"),
            (long, "cut short"),
            (change(&binary, "POINTS 5", "POINTS 0"), "no point"),
        ],
    );
    for bytes in [ascii.into_bytes(), binary, packed] {
        survives("pcd", &bytes);
    }
}

#[test]
fn geojson() {
    let lot = text("lot.geojson");
    let changed = |from: &str, to: &str| with(&lot, from, to);
    refused(
        "geojson",
        vec![
            (vec![], "empty"),
            (b"[]".to_vec(), "no object"),
            (b"{}".to_vec(), "type is"),
            (b"{\"type\": \"FeatureCollection\"}".to_vec(), "features is missing"),
            (b"{\"type\": \"FeatureCollection\", \"features\": []}".to_vec(), "no geometry"),
            (
                b"{\"type\": \"FeatureCollection\", \"features\": [1]}".to_vec(),
                "features[0] is no object",
            ),
            (lot.as_bytes()[..lot.len() / 2].to_vec(), "not valid JSON"),
            (lot.as_bytes()[..lot.len() - 4].to_vec(), "not valid JSON"),
            (changed("13.4000", "NaN"), "not valid JSON"),
            (changed("13.4000", "\"13.4\""), "expected a position"),
            (changed("13.4000, 52.5000", "13.4000"), "expected a position"),
            (changed("13.4000, 52.5000", "392000, 5817000"), "no longitude and latitude"),
            (changed("13.4000, 52.5000", "103.4000, 52.5000"), "degrees from"),
            (changed("\"Polygon\"", "\"Circle\""), "type is"),
            (changed("\"LineString\"", "\"Polygon\""), "features[1]"),
            (
                changed("[[13.3999, 52.4999], [13.4007, 52.4999]]", "[[13.3999, 52.4999]]"),
                "fewer than 2",
            ),
            (changed("\"role\": \"low\"", "\"role\": \"lwo\""), "expected one of obstacle"),
            (changed("\"heading_deg\": 90", "\"note\": 90"), "heading is missing"),
            (changed("\"heading_deg\": 90", "\"heading\": \"north\""), "expected a number"),
            (changed("\"role\": \"goal\"", "\"role\": \"start\""), "second start"),
            (changed("\"name\": \"lot\"", "\"units\": \"feet\""), "units is"),
            (changed("\"name\": \"lot\"", "\"origin\": [13.4]"), "origin is"),
            (changed("\"name\": \"lot\"", "\"origin\": [13.4, 91]"), "origin is"),
            (
                changed(
                    "\"name\": \"lot\"",
                    "\"crs\": {\"properties\": {\"name\": \"EPSG:25833\"}}",
                ),
                "crs is",
            ),
            (changed("\"length\": 4.69", "\"length\": -4.69"), "vehicle.length"),
            (changed("\"length\": 4.69", "\"lenght\": 4.69"), "vehicle is"),
            (changed("\"position_m\": 0.1", "\"position_m\": 10"), "goal_tolerance"),
            (
                format!("{{\"type\": \"Feature\", \"geometry\": {}", "[".repeat(100_000)).into(),
                "not valid JSON",
            ),
        ],
    );
    survives("geojson", lot.as_bytes());
    survives("json", lot.as_bytes());
}

#[test]
fn commonroad() {
    let lot = text("lot-2020a.xml");
    let changed = |from: &str, to: &str| with(&lot, from, to);
    let bomb = "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;\">]><commonRoad>&b;</commonRoad>";
    refused(
        "xml",
        vec![
            (vec![], "empty"),
            (b"no xml".to_vec(), "not valid XML"),
            (b"<other/>".to_vec(), "expected <commonRoad>"),
            (bomb.into(), "not valid XML"),
            (lot.as_bytes()[..lot.len() / 2].to_vec(), "not valid XML"),
            (lot.as_bytes()[..lot.len() - 5].to_vec(), "not valid XML"),
            (changed("</shape>", ""), "not valid XML"),
            (changed("<x>-2.7</x>", ""), "has no <x>"),
            (changed("<x>-2.7</x>", "<x>left</x>"), "\"left\""),
            (changed("<x>-2.7</x>", "<x>NaN</x>"), "\"NaN\""),
            (changed("<x>-2.7</x>", "<x>1e999</x>"), "\"1e999\""),
            (changed("<x>-2.7</x>", "<x/>"), "expected a finite number"),
            (changed("<length>4.5</length>", ""), "has no <length>"),
            (changed("<length>4.5</length>", "<length>-4.5</length>"), "length -4.5"),
            (changed("<radius>0.3</radius>", "<radius>0</radius>"), "radius 0"),
            (changed("<point><x>1</x><y>0</y></point>", ""), "has 2 points"),
            (
                changed("<rectangle><length>4.5</length><width>1.8</width></rectangle>", ""),
                "expected one",
            ),
            (
                changed("<orientation><exact>1.5707963267948966</exact></orientation>", ""),
                "has no <orientation>",
            ),
            (
                changed(
                    "<orientation><exact>1.5707963267948966</exact></orientation>",
                    "<orientation/>",
                ),
                "intervalStart",
            ),
            (changed("<intervalEnd>1.67</intervalEnd>", ""), "intervalEnd"),
            (
                changed("<position><point><x>-8</x><y>5.2</y></point></position>", ""),
                "has no <position>",
            ),
            (
                changed(
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>",
                    &format!("<commonRoad>{}", "<a>".repeat(100_000)),
                ),
                "not valid XML",
            ),
        ],
    );
    survives("xml", lot.as_bytes());
}

#[test]
fn opendrive() {
    let lot = text("lot.xodr");
    let changed = |from: &str, to: &str| with(&lot, from, to);
    refused(
        "xodr",
        vec![
            (vec![], "empty"),
            (b"<openDRIVE/>".to_vec(), "expected <commonRoad>"),
            (b"{}".to_vec(), "not valid XML"),
            (lot.as_bytes()[..lot.len() / 2].to_vec(), "not valid XML"),
            (changed("</road>", ""), "not valid XML"),
            (changed("s=\"8\" t=\"6\"", "t=\"6\""), "has no s"),
            (changed("s=\"8\" t=\"6\"", "s=\"8\""), "has no t"),
            (changed("s=\"8\" t=\"6\"", "s=\"eight\" t=\"6\""), "\"eight\""),
            (changed("s=\"8\" t=\"6\"", "s=\"NaN\" t=\"6\""), "\"NaN\""),
            (changed("s=\"8\" t=\"6\"", "s=\"inf\" t=\"6\""), "\"inf\""),
            (changed("hdg=\"1.5707963267948966\" pitch", "hdg=\"\" pitch"), "hdg"),
            (changed("length=\"5.0\" width=\"2.6\" height=\"0\"", "length=\"5.0\""), "no outline"),
            (
                changed("length=\"5.0\" width=\"2.6\" height=\"0\"", "length=\"x\" width=\"2.6\""),
                "length \"x\"",
            ),
            (changed("<cornerLocal u=\"-2.5\"", "<cornerLocal"), "has no u"),
            (changed("<cornerRoad s=\"18\"", "<cornerRoad s=\"\""), "s \"\""),
            (changed("<line/>", "<wave/>"), "shape wave"),
            (changed("<line/>", ""), "has no shape"),
            (changed("curvature=\"0.05\"", "radius=\"20\""), "has no curvature"),
            (changed("curvEnd=\"0.05\"", "curvEnd=\"5e9\""), "turns more"),
            (changed("length=\"30\"", "length=\"-30\""), "length -30"),
            (changed("length=\"30\"", "length=\"1e300\""), "length"),
            (changed("aU=\"0\"", "aU=\"zero\""), "\"zero\""),
            (lot.replace("geometry", "geography").into(), "no planView"),
        ],
    );
    survives("xodr", lot.as_bytes());
    let rows = text("rows.xodr");
    let changed = |from: &str, to: &str| with(&rows, from, to);
    refused(
        "xodr",
        vec![
            (changed("s=\"10\" length=\"25\"", "length=\"25\""), "<repeat> in line 11 has no s"),
            (changed("length=\"25\" dist", "dist"), "has no length"),
            (changed(" distance=\"2.5\"", ""), "has no distance"),
            (changed("length=\"25\"", "length=\"-25\""), "length -25"),
            (changed("length=\"25\"", "length=\"1e300\""), "expected at most 10000"),
            (changed("length=\"25\"", "length=\"NaN\""), "\"NaN\""),
            (changed("length=\"25\"", "length=\"\""), "length \"\""),
            (changed("distance=\"2.5\"", "distance=\"-2.5\""), "distance -2.5"),
            (changed("distance=\"2.5\"", "distance=\"1e-9\""), "expected at most 10000"),
            (changed("distance=\"2.5\"", "distance=\"1e-320\""), "expected at most 10000"),
            (changed("distance=\"2.5\"", "distance=\"two\""), "\"two\""),
            (changed("tStart=\"-6.5\"", "tStart=\"left\""), "\"left\""),
            (changed("tEnd=\"-6.5\"", "tEnd=\"inf\""), "\"inf\""),
            (changed("lengthStart=\"5\"", "lengthStart=\"long\""), "\"long\""),
            (changed("lengthEnd=\"5\"", "lengthEnd=\"long\""), "\"long\""),
            (changed("widthStart=\"2.5\"", "widthStart=\"wide\""), "\"wide\""),
            (changed("widthEnd=\"2.5\"", "widthEnd=\"wide\""), "\"wide\""),
            (changed("radius=\"0.15\"", "radius=\"thin\""), "\"thin\""),
            (changed("<cornerLocal u=\"0\" v=\"0\"", "<cornerLocal u=\"0\""), "has no v"),
            (changed("type=\"railing\"", "type=\"parkingSpace\""), "without a width"),
            (changed("<cornerRoad s=\"19\"", "<cornerRoad"), "has no s"),
        ],
    );
    survives("xodr", rows.as_bytes());
}

#[test]
fn what_is_no_map_at_all() {
    let folder = TempDir::new().unwrap();
    for (name, part) in
        [("map.txt", "is no map"), ("map", "is no map"), ("map.pgm", "expected its .yaml")]
    {
        let file = folder.path().join(name);
        fs::write(&file, "x").unwrap();
        refuses(&file, part);
    }
    refuses(&folder.path().join("none.yaml"), "no such file");
    let of_yaml = folder.path().join("folder.yaml");
    fs::create_dir(&of_yaml).unwrap();
    refuses(&of_yaml, "a folder");
}
