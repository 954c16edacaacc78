//! Which lattice states a search has reached, and how cheaply.
//!
//! The lattice (x, y, heading) is stored in tiles, and the table of tiles in pages, both allocated
//! where the search goes: neither a large lot nor a reset costs more than the states visited.

use std::f64::consts::TAU;

use crate::geometry::{Aabb, Pose};

/// Cells per side of a tile.
const TILE: usize = 8;
/// Tiles per side of a page.
const PAGE: usize = 64;

/// No tile, or no cost yet.
const NONE: u32 = u32::MAX;
/// Costs that are kept allocated from one search to the next: 64 MB. A search that went everywhere in fine steps
/// may have taken gigabytes.
const KEPT: usize = 16 << 20;

/// The cheapest cost-to-come found for every lattice state.
#[derive(Debug, Default)]
pub(super) struct Lattice {
    origin: (f64, f64),
    inverse_cell: f64,
    headings: usize,
    size: (usize, usize),
    pages_x: usize,
    /// Page index per page position; `NONE` where the search has not been.
    page_of: Vec<u32>,
    /// Tile index per tile position of all pages, `PAGE × PAGE` each.
    tile_of: Vec<u32>,
    /// Costs of all tiles, `TILE × TILE × headings` each.
    costs: Vec<f32>,
}

/// Index of a state in the lattice's storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StateIndex(usize);

impl Lattice {
    /// Forgets everything and covers `domain` with square cells of `cell` metres and
    /// `headings` headings.
    pub fn reset(&mut self, domain: &Aabb, cell: f64, headings: usize) {
        let extent = domain.max - domain.min;
        let count = |length: f64| (length / cell).ceil().max(1.0) as usize;
        self.origin = (domain.min.x, domain.min.y);
        self.inverse_cell = 1.0 / cell;
        self.headings = headings;
        self.size = (count(extent.x), count(extent.y));
        self.pages_x = self.size.0.div_ceil(PAGE * TILE);
        self.page_of.clear();
        self.page_of.resize(self.pages_x * self.size.1.div_ceil(PAGE * TILE), NONE);
        self.tile_of.clear();
        self.costs.clear();
        self.costs.shrink_to(KEPT);
    }

    /// The state of a pose; `None` outside the domain. Allocates its tile.
    ///
    /// The heading must lie in [−2π, 2π].
    pub fn state(&mut self, pose: Pose) -> Option<StateIndex> {
        let x = (pose.x - self.origin.0) * self.inverse_cell;
        let y = (pose.y - self.origin.1) * self.inverse_cell;
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (x, y) = (x as usize, y as usize);
        if x >= self.size.0 || y >= self.size.1 {
            return None;
        }
        debug_assert!(pose.heading.abs() <= TAU);
        let turn = pose.heading / TAU + 1.0;
        let heading = (turn * self.headings as f64 + 0.5) as usize % self.headings;
        let (tile_x, tile_y) = (x / TILE, y / TILE);
        let page = &mut self.page_of[tile_y / PAGE * self.pages_x + tile_x / PAGE];
        if *page == NONE {
            *page = (self.tile_of.len() / (PAGE * PAGE)) as u32;
            self.tile_of.resize(self.tile_of.len() + PAGE * PAGE, NONE);
        }
        let in_page = tile_y % PAGE * PAGE + tile_x % PAGE;
        let tile = &mut self.tile_of[*page as usize * PAGE * PAGE + in_page];
        let states = TILE * TILE * self.headings;
        if *tile == NONE {
            *tile = (self.costs.len() / states) as u32;
            self.costs.resize(self.costs.len() + states, f32::INFINITY);
        }
        let in_tile = (y % TILE * TILE + x % TILE) * self.headings + heading;
        Some(StateIndex(*tile as usize * states + in_tile))
    }

    /// The cheapest cost recorded for a state; infinite when new.
    pub fn cost(&self, state: StateIndex) -> f32 {
        self.costs[state.0]
    }

    /// Records a cost.
    pub fn set_cost(&mut self, state: StateIndex, cost: f32) {
        self.costs[state.0] = cost;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_wrap_and_states_differ() {
        let mut l = Lattice::default();
        l.reset(&Aabb::new(-10.0, -10.0, 10.0, 10.0), 0.5, 72);
        let at = |l: &mut Lattice, x, y, h| l.state(Pose::new(x, y, h));
        let a = at(&mut l, 0.1, 0.1, 0.0).unwrap();
        assert_eq!(Some(a), at(&mut l, 0.2, 0.2, TAU - 0.01));
        assert_ne!(Some(a), at(&mut l, 0.2, 0.2, 0.1));
        assert_ne!(Some(a), at(&mut l, 0.6, 0.2, 0.0));
        assert_eq!(None, at(&mut l, 10.1, 0.0, 0.0));
        l.set_cost(a, 1.0);
        assert_eq!(l.cost(a), 1.0);
        l.reset(&Aabb::new(-10.0, -10.0, 10.0, 10.0), 0.5, 72);
        let again = at(&mut l, 0.1, 0.1, 0.0).unwrap();
        assert_eq!(l.cost(again), f32::INFINITY);
    }

    #[test]
    fn what_one_search_took_is_not_kept_for_ever() {
        let mut l = Lattice::default();
        let domain = Aabb::new(0.0, 0.0, 40.0, 40.0);
        l.reset(&domain, 0.05, 1440);
        for x in 0..80 {
            l.state(Pose::new(0.45 * f64::from(x) + 0.01, 20.0, 0.0));
            l.state(Pose::new(0.45 * f64::from(x) + 0.01, 30.0, 0.0));
            l.state(Pose::new(0.45 * f64::from(x) + 0.01, 35.0, 0.0));
        }
        assert!(l.costs.len() > KEPT, "{}", l.costs.len());
        l.reset(&domain, 0.05, 1440);
        assert!(l.costs.capacity() <= KEPT, "{}", l.costs.capacity());
    }

    #[test]
    fn a_large_domain_takes_the_memory_of_the_states_visited() {
        let mut l = Lattice::default();
        l.reset(&Aabb::new(0.0, 0.0, 1e4, 1e4), 0.02, 720);
        let corners = [(0.0, 0.0), (9999.9, 0.0), (0.0, 9999.9), (9999.9, 9999.9)];
        let states = corners.map(|(x, y)| l.state(Pose::new(x, y, 0.0)).unwrap());
        assert!(states.windows(2).all(|w| w[0] != w[1]));
        let bytes = 4 * (l.page_of.len() + l.tile_of.len() + l.costs.len());
        assert!(bytes < 8 << 20, "{bytes}");
    }
}
