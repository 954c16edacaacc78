//! Reeds-Shepp lengths against an independent implementation.

use n3p::curves::reeds_shepp::{shortest_length, words};
use n3p::geometry::Pose;

/// The generator of `fixtures/reeds_shepp_ompl.py`, uniform in [0, 1).
struct SplitMix64(u64);

impl SplitMix64 {
    fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

#[test]
fn shortest_lengths_equal_ompl_on_100_000_queries() {
    let fixture = include_bytes!("fixtures/reeds_shepp_ompl.bin");
    assert_eq!(fixture.len(), 4 * 100_000);
    let mut draw = SplitMix64(1);
    let mut out = Vec::new();
    for (i, bytes) in fixture.chunks_exact(4).enumerate() {
        let ompl = f64::from(u32::from_le_bytes(bytes.try_into().unwrap())) * 1e-8;
        let r = [1.5, 5.0, 12.0][i % 3];
        let x = (2.0 * draw.draw() - 1.0) * r;
        let y = (2.0 * draw.draw() - 1.0) * r;
        let goal = Pose::new(x, y, (2.0 * draw.draw() - 1.0) * std::f64::consts::PI);
        let ours = shortest_length(Pose::default(), goal, 1.0);
        assert!((ours - ompl).abs() < 1e-6, "query {i} {goal:?}: {ours} against {ompl}");
        out.clear();
        words(Pose::default(), goal, 1.0, &mut out);
        for word in &out {
            assert!(word.length() >= ompl - 1e-6, "query {i} {goal:?} {}", word.name());
            let end = word.segments().iter().fold(Pose::default(), |p, s| s.end(p));
            let turn = n3p::geometry::signed_angle(end.heading, goal.heading).abs();
            assert!(end.distance(goal) + turn < 1e-6, "query {i} {goal:?} {}", word.name());
        }
    }
}
