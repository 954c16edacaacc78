//! What waves of the cost-to-go spread over: square cells, and who waits at the wave's front.

use crate::geometry::{Aabb, Vec2};

/// Cells per side of a page.
pub(super) const PAGE: usize = 64;
/// Cells of a page.
pub(super) const PAGE_CELLS: usize = PAGE * PAGE;
/// No page yet.
const NONE: u32 = u32::MAX;

/// Column and row of a cell.
pub(super) type Cell = (i32, i32);

/// Square cells over a domain, in pages that are made where the wave goes.
#[derive(Debug, Default)]
pub(super) struct Raster {
    origin: Vec2,
    /// Side of a cell, metres.
    pub cell: f64,
    size: Cell,
    pages_x: usize,
    /// Page number by page position; [`NONE`] where the wave has not been.
    page_of: Vec<u32>,
    pages: u32,
}

impl Raster {
    /// Cells of side `cell` over `domain`, without any page.
    pub fn reset(&mut self, domain: &Aabb, cell: f64) {
        let extent = domain.max - domain.min;
        self.origin = domain.min;
        self.cell = cell;
        self.size = ((extent.x / cell).ceil() as i32 + 1, (extent.y / cell).ceil() as i32 + 1);
        let pages = |cells: i32| (cells.max(0) as usize).div_ceil(PAGE);
        self.pages_x = pages(self.size.0);
        self.page_of.clear();
        self.page_of.resize(self.pages_x * pages(self.size.1), NONE);
        self.pages = 0;
    }

    /// Pages made.
    pub fn pages(&self) -> usize {
        self.pages as usize
    }

    /// The cell around `p`.
    pub fn cell_of(&self, p: Vec2) -> Option<Cell> {
        let c = (p - self.origin) / self.cell;
        let (x, y) = (c.x.round(), c.y.round());
        let inside =
            x >= 0.0 && y >= 0.0 && x < f64::from(self.size.0) && y < f64::from(self.size.1);
        inside.then_some((x as i32, y as i32))
    }

    /// The middle of a cell.
    pub fn middle(&self, (x, y): Cell) -> Vec2 {
        self.origin + Vec2::new(f64::from(x), f64::from(y)) * self.cell
    }

    /// Whether there is such a cell.
    #[inline]
    pub fn has(&self, (x, y): Cell) -> bool {
        x >= 0 && y >= 0 && x < self.size.0 && y < self.size.1
    }

    /// The number of a cell among those of all pages; `None` where its page is still to be made.
    #[inline]
    pub fn index(&self, (x, y): Cell) -> Option<usize> {
        let (x, y) = (x as usize, y as usize);
        let page = self.page_of[y / PAGE * self.pages_x + x / PAGE];
        (page != NONE).then_some(page as usize * PAGE_CELLS + y % PAGE * PAGE + x % PAGE)
    }

    /// Makes the page of a cell, the last of all; its first cell.
    pub fn make_page(&mut self, (x, y): Cell) -> Cell {
        let (page_x, page_y) = (x as usize / PAGE, y as usize / PAGE);
        self.page_of[page_y * self.pages_x + page_x] = self.pages;
        self.pages += 1;
        ((page_x * PAGE) as i32, (page_y * PAGE) as i32)
    }
}

/// Who waits at the front of a wave, by cost: Dial's buckets, since costs are small integers.
#[derive(Debug, Default)]
pub(super) struct Front<T> {
    /// By cost; the costs of all that wait lie no further apart than there are buckets.
    buckets: Vec<Vec<T>>,
    /// The least cost that still may wait.
    pub cost: u32,
    waiting: usize,
}

impl<T> Front<T> {
    /// `first` alone waits, at cost 0. No step costs as much as there are `buckets`.
    pub fn reset(&mut self, buckets: usize, first: Option<T>) {
        self.buckets.resize_with(buckets, Vec::new);
        self.buckets.iter_mut().for_each(Vec::clear);
        (self.cost, self.waiting) = (0, 0);
        if let Some(first) = first {
            self.push(0, first);
        }
    }

    /// Whether nobody waits.
    pub fn is_empty(&self) -> bool {
        self.waiting == 0
    }

    #[inline]
    pub fn push(&mut self, cost: u32, who: T) {
        let slot = cost as usize % self.buckets.len();
        self.buckets[slot].push(who);
        self.waiting += 1;
    }

    /// One of those at the front's cost; when there is none left the front moves on.
    #[inline]
    pub fn pop(&mut self) -> Option<T> {
        let slot = self.cost as usize % self.buckets.len();
        let who = self.buckets[slot].pop();
        match who {
            Some(_) => self.waiting -= 1,
            None => self.cost += 1,
        }
        who
    }
}
