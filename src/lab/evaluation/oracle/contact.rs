//! What a path touches where it may: at its start, and at its end.

use std::collections::BTreeMap;

use super::{PENETRATION_TOL, Violation};

/// Contacts along a path, footprint by footprint.
pub(super) struct Contacts {
    /// How deep a footprint may reach in, millimetres; with 0 the first contact is a violation.
    allowed_mm: f64,
    /// Footprints so far.
    footprints: usize,
    /// Of each obstacle: which footprints touch it, the exported pose at or before each, and how
    /// deep they reach in, millimetres.
    met: BTreeMap<String, Vec<Met>>,
}

/// One footprint in contact with one obstacle.
#[derive(Clone, Copy)]
struct Met {
    footprint: usize,
    pose: usize,
    mm: f64,
}

impl Contacts {
    /// Depths may differ by so much and count as equal, millimetres.
    const EQUAL_MM: f64 = 2e3 * PENETRATION_TOL;

    pub fn new(allowed_m: f64) -> Self {
        Self { allowed_mm: allowed_m * 1e3, footprints: 0, met: BTreeMap::new() }
    }

    /// The next footprint is looked at.
    pub fn next(&mut self) {
        self.footprints += 1;
    }

    /// It reaches `mm` into an edge of `obstacle`: a violation where that is deeper than allowed.
    pub fn met(&mut self, pose: usize, mm: f64, obstacle: String) -> Result<(), Violation> {
        if self.allowed_mm == 0.0 || mm > self.allowed_mm + Self::EQUAL_MM {
            return Err(Violation::Collision { pose, mm, obstacle });
        }
        let footprint = self.footprints - 1;
        let all = self.met.entry(obstacle).or_default();
        match all.last_mut().filter(|last| last.footprint == footprint) {
            Some(last) => last.mm = last.mm.max(mm),
            None => all.push(Met { footprint, pose, mm }),
        }
        Ok(())
    }

    /// Whether every obstacle is touched only from the start on, ever less deep, and up to the end,
    /// ever deeper.
    pub fn check(&self) -> Result<(), Violation> {
        for (obstacle, all) in &self.met {
            let leaving = run(all.iter(), |i| i);
            let entering = run(all[leaving..].iter().rev(), |i| self.footprints - 1 - i);
            if let Some(&Met { pose, mm, .. }) = all[leaving..].iter().rev().nth(entering) {
                return Err(Violation::Collision { pose, mm, obstacle: obstacle.clone() });
            }
        }
        Ok(())
    }
}

/// How many of `all` follow each other from the end of the path where footprint 0 is `number(0)`,
/// none of them deeper than any before it.
fn run<'a>(all: impl Iterator<Item = &'a Met>, number: impl Fn(usize) -> usize) -> usize {
    let mut least = f64::INFINITY;
    all.enumerate()
        .take_while(|(i, met)| {
            let goes_on = met.footprint == number(*i) && met.mm <= least + Contacts::EQUAL_MM;
            least = least.min(met.mm);
            goes_on
        })
        .count()
}
