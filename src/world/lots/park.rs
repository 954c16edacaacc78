//! A car park or a street in the making: rows, ends, what else stands there, goal and start.

use std::f64::consts::{FRAC_PI_6, PI};

use super::draw::Draw;
use super::furniture;
use super::road::Road;
use super::row::{Row, Style};
use super::things::Things;
use crate::geometry::{Polygon, Pose, Vec2, wrap_angle};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// How far rows reach, metres to either side of the target.
const EXTENT: f64 = 26.0;
/// How far along the road starts lie, metres to either side of the target.
const START: f64 = 18.0;
/// Clearance of the start, metres.
const START_CLEARANCE: f64 = 0.2;
/// Clearance of the goal, metres.
const GOAL_CLEARANCE: f64 = 0.1;

/// A finished car park, in the frame of its road.
pub(super) struct Park {
    pub things: Things,
    pub start: Pose,
    pub goal: Pose,
    /// Where a sensor has been.
    pub eyes: Vec<Vec2>,
}

/// How the lane ends on one side.
#[derive(Clone, Copy)]
struct End {
    /// Station where its rows end.
    rows: f64,
    /// Station where the lane itself does; it may go on forever.
    lane: f64,
}

/// What is drawn before anything is laid out.
pub(super) struct Plan<'a> {
    pub vehicle: &'a Vehicle,
    pub road: Road,
    /// The row of the target, whose mouth is at station 0.
    pub row: Row,
    /// Width of the lane, metres.
    pub lane: f64,
    /// How much wider the lane is than parking asks for, metres.
    pub spare: f64,
    /// Whether kerbs line it, with pavements behind.
    pub is_street: bool,
}

impl Park {
    /// `None` where no free spot or start is left.
    pub fn new(vehicle: &Vehicle, kind: ParkingType, draw: &mut Draw) -> Option<Park> {
        let plan = Plan::draw(vehicle, kind, draw)?;
        let mut things = Things::default();
        let ends = plan.ends(draw, &mut things);
        plan.target_side(ends, draw, &mut things);
        plan.far_side(ends, draw, &mut things);
        furniture::strew(&plan, ends.map(|e| e.rows), draw, &mut things);
        let goal = plan.goal(kind, draw, &things)?;
        let along = match kind {
            // To turn round there is rarely the room.
            ParkingType::Parallel => Some(goal.heading.cos() > 0.0),
            ParkingType::Forward | ParkingType::Reverse => None,
            // Tail in one passes the bay first, nose in one comes from where it opens to; now and then
            // from the other side.
            ParkingType::Angled => Some((goal.heading.cos() > 0.0) != draw.chance(0.25)),
        };
        let start = plan.start(ends, along, draw, &things)?;
        let stations = [-16.0, -8.0, 0.0, 8.0, 16.0].into_iter();
        let seen = stations.filter(|&s| ends[0].lane + 1.0 < s && s < ends[1].lane - 1.0);
        let mut eyes: Vec<Vec2> = seen.map(|s| plan.road.point(s, plan.lane / 2.0)).collect();
        eyes.push(start.position());
        Some(Park { things, start, goal, eyes })
    }
}

impl<'a> Plan<'a> {
    /// Dimensions that go together: the narrower the bays, the wider the lane.
    fn draw(vehicle: &'a Vehicle, kind: ParkingType, draw: &mut Draw) -> Option<Self> {
        let style = match kind {
            ParkingType::Forward | ParkingType::Reverse => Style::SQUARE,
            ParkingType::Parallel => Style::Parallel,
            ParkingType::Angled => Style::Bays { slant: draw.between(FRAC_PI_6, 1.3) },
        };
        let is_street = draw.chance(if style == Style::Parallel { 0.6 } else { 0.15 });
        let bends = if style == Style::Parallel { 0.45 } else { 0.1 };
        let radius = draw.between(35.0, 150.0) * if style == Style::Parallel { 1.0 } else { 3.0 };
        let curvature = if draw.chance(bends) { draw.sign() / radius } else { 0.0 };
        let (width, depth) = match style {
            Style::Bays { .. } => {
                (draw.between(2.3_f64.max(vehicle.width + 0.44), 3.2), draw.between(4.8, 5.8))
            }
            Style::Parallel => {
                (vehicle.length + draw.between(0.8, 2.5), vehicle.width + draw.between(0.25, 0.6))
            }
        };
        let lane = draw.between(4.0, 9.0);
        let needed = match kind {
            // More than most angled bays ask for.
            ParkingType::Reverse | ParkingType::Angled => lane_to_back_into(vehicle, width),
            // Nose in the car swings out at its front: it needs more, or more moves.
            ParkingType::Forward => lane_to_back_into(vehicle, width) + 0.5,
            ParkingType::Parallel => vehicle.width + 2.0,
        };
        let pillars = style != Style::Parallel && !is_street && draw.chance(0.2);
        let row = Row {
            style,
            edge: 0.0,
            away: -1.0,
            width,
            depth,
            occupancy: draw.between(0.5, 1.0),
            stick_out: (lane - needed).clamp(0.0, 0.3),
            pillars: pillars.then(|| (draw.number(1..4), draw.between(0.3, 0.6))),
        };
        let road = Road { curvature };
        let spare = lane - needed;
        (spare >= 0.0).then_some(Self { vehicle, road, row, lane, spare, is_street })
    }

    /// Half of the target, along the road, metres.
    pub fn half(&self) -> f64 {
        self.row.step() / 2.0
    }

    /// How far things may reach into the lane, metres, for it to stay passable.
    pub fn passable(&self) -> f64 {
        ((self.lane - self.vehicle.width - 1.3) / 2.0).clamp(0.0, 0.9)
    }

    /// Where rows and lane end on both sides, and walls that close the lane.
    fn ends(&self, draw: &mut Draw, things: &mut Things) -> [End; 2] {
        let dead = draw.chance(0.35).then(|| draw.sign());
        [-1.0, 1.0].map(|side| {
            if dead == Some(side) {
                return self.dead_end(side, draw, things);
            }
            let rows = side * draw.between(14.0, EXTENT);
            if draw.chance(0.3) {
                // A lane across, with a wall on its other side.
                let lane = rows + side * draw.between(5.5, 8.0);
                let wall = self.road.strip([lane, lane + side * 0.3], [-EXTENT, EXTENT]);
                things.solids.push(wall);
                return End { rows, lane };
            }
            End { rows, lane: side * f64::INFINITY }
        })
    }

    /// A wall across the lane and its rows, square or inclined.
    fn dead_end(&self, side: f64, draw: &mut Draw, things: &mut Things) -> End {
        // Close to the target only where there is room for more moves.
        let is_close = self.spare > 0.8 && draw.chance(0.4);
        let least = self.half() + if is_close { 0.3 } else { 6.0 };
        let nearest = side * draw.between(least, if is_close { 8.0 } else { 18.0 });
        let incline: f64 = if draw.chance(0.4) { draw.about(0.3).tan() } else { 0.0 };
        let (low, high) = (self.row.back() - 0.2, self.lane + 6.0);
        let station = |d: f64| {
            let from = if incline > 0.0 { low } else { high };
            nearest + side * (d - from) * incline
        };
        let corner = |d, thick| self.road.point(station(d) + side * thick, d);
        let wall = vec![corner(low, 0.0), corner(low, 0.3), corner(high, 0.3), corner(high, 0.0)];
        things.solids.push(Polygon::new(wall).expect("four vertices"));
        End { rows: nearest - side * 0.1, lane: nearest }
    }

    /// The target's row, what ends it, and what is behind it.
    fn target_side(&self, ends: [End; 2], draw: &mut Draw, things: &mut Things) {
        let last = draw.chance(0.25).then(|| draw.sign());
        self.behind(&self.row, ends, draw, things);
        for (side, end) in [-1.0, 1.0].into_iter().zip(ends) {
            let from = side * self.half();
            let to = if last == Some(side) { from } else { end.rows };
            let next = self.row.fill(&self.road, from, to, draw, things);
            let reach = self.spare.min(self.passable()).min(0.8);
            if (end.rows - next) * side > 0.5 {
                furniture::end_row(self, next, end.rows, reach, draw, things);
            }
        }
    }

    /// What lies across the lane: another row, or its border.
    fn far_side(&self, ends: [End; 2], draw: &mut Draw, things: &mut Things) {
        let style = match draw.number(0..10) {
            0..4 if !self.is_street => Style::SQUARE,
            4..6 => Style::Bays { slant: draw.between(0.8, 1.3) },
            0..8 => Style::Parallel,
            _ => {
                let d = self.lane + draw.between(0.0, 0.5);
                return self.border(d, 1.0, ends, draw, things);
            }
        };
        let row = self.other_row(style, self.lane, 1.0, draw);
        let [from, to] = ends.map(|e| e.rows);
        row.fill(&self.road, from + draw.between(0.0, 2.5), to, draw, things);
        self.behind(&row, ends, draw, things);
    }

    fn other_row(&self, style: Style, edge: f64, away: f64, draw: &mut Draw) -> Row {
        let (width, depth) = match style {
            Style::Bays { .. } => (draw.between(2.4, 2.8), draw.between(4.9, 5.6)),
            Style::Parallel => (6.0, draw.between(2.0, 2.4)),
        };
        let stick_out = self.spare.min(self.passable()).clamp(0.0, 0.3);
        let occupancy = draw.between(0.3, 1.0);
        Row { style, edge, away, width, depth, occupancy, stick_out, pillars: None }
    }

    /// What is behind a row: a border, or the back of another row at another lane.
    fn behind(&self, row: &Row, ends: [End; 2], draw: &mut Draw, things: &mut Things) {
        let back = row.back();
        let is_bays = row.style != Style::Parallel;
        if !is_bays || self.is_street || draw.chance(0.5) {
            return self.border(back, row.away, ends, draw, things);
        }
        let (from, to) = (ends[0].rows, ends[1].rows);
        if draw.chance(0.4) {
            // A fence or a kerb to stop at, between the two rows.
            things.line(&self.road.along(from, to, back));
        }
        let mut other = self.other_row(row.style, 0.0, -row.away, draw);
        other.edge = back + row.away * (other.across() + 0.1);
        other.fill(&self.road, from, to, draw, things);
        if draw.chance(0.5) {
            let beyond = other.edge + row.away * draw.between(5.0, 7.0);
            let third = self.other_row(row.style, beyond, row.away, draw);
            third.fill(&self.road, from, to, draw, things);
            self.border(third.back(), row.away, ends, draw, things);
        }
    }

    /// What ends the place at the offset `d`, seen from the lane: a wall, a hedge, or a kerb with
    /// things on the pavement.
    fn border(&self, d: f64, away: f64, ends: [End; 2], draw: &mut Draw, things: &mut Things) {
        let (from, to) = (ends[0].rows, ends[1].rows);
        if self.is_street || draw.chance(0.3) {
            things.line(&self.road.along(from, to, d));
            furniture::pavement(self, [from, to], d, away, draw, things);
        } else if draw.chance(0.2) {
            furniture::hedge(self, [from, to], d, away, draw, things);
        } else {
            things.solids.push(self.road.strip([from, to], [d, d + away * 0.25]));
        }
    }

    /// Somewhere in the target where the car fits.
    fn goal(&self, kind: ParkingType, draw: &mut Draw, things: &Things) -> Option<Pose> {
        let Vehicle { length, width, .. } = *self.vehicle;
        let spot = self.row.spot(&self.road, 0.0);
        let turn = match kind {
            ParkingType::Forward => PI,
            ParkingType::Reverse => 0.0,
            ParkingType::Parallel | ParkingType::Angled => f64::from(draw.number(0..2)) * PI,
        };
        let error = if draw.chance(0.7) { draw.about(PI / 180.0) } else { 0.0 };
        // From the spot's middle: in the direction in which there is room to choose, and across it.
        let depth = self.row.depth;
        let (slack, least, out) = match self.row.style {
            Style::Bays { .. } => {
                let slack = (depth - length) / 2.0;
                let out = draw.between(0.15 - slack, slack + self.row.stick_out.min(0.1));
                ((self.row.width - width) / 2.0, 0.2, out)
            }
            Style::Parallel => {
                let kerb = draw.between(0.16, 0.4).min(depth - width);
                let out = self.row.away * ((depth - width) / 2.0 - kerb);
                ((self.row.width - length) / 2.0, 0.55, out)
            }
        };
        let at = |shift| match self.row.style {
            Style::Bays { .. } => Pose::new(out, shift, turn + error),
            Style::Parallel => Pose::new(shift, out, turn + error),
        };
        let body = self.vehicle.footprint(GOAL_CLEARANCE);
        let pose = |shift| self.vehicle.rear_axle(spot.compose(at(shift)));
        let [low, high] = longest_run(slack, |shift| things.leave(pose(shift), &body))
            .filter(|[low, high]| high - low >= least)?;
        Some(pose(draw.between(low + 0.15 * (high - low), high - 0.15 * (high - low))))
    }

    /// A free pose in the lane; `ahead`: whether it must face the road's direction, or must not.
    fn start(
        &self,
        ends: [End; 2],
        ahead: Option<bool>,
        draw: &mut Draw,
        things: &Things,
    ) -> Option<Pose> {
        let Vehicle { length, width, .. } = *self.vehicle;
        let (low, high) = (ends[0].lane.max(-START), ends[1].lane.min(START));
        let body = self.vehicle.footprint(START_CLEARANCE);
        for _ in 0..100 {
            let s = draw.between(low, high);
            let turn = draw.about(FRAC_PI_6);
            let reach = (length * turn.sin().abs() + width * turn.cos()) / 2.0 + START_CLEARANCE;
            if 2.0 * reach > self.lane {
                continue;
            }
            let d = draw.between(reach, self.lane - reach);
            let is_ahead = ahead.unwrap_or_else(|| draw.chance(0.5));
            let along = if is_ahead { 0.0 } else { PI };
            let pose = self.vehicle.rear_axle(self.road.at(s, d, along + turn));
            let pose = Pose { heading: wrap_angle(pose.heading), ..pose };
            if things.leave(pose, &body) && self.can_straighten(pose, turn, things) {
                return Some(pose);
            }
        }
        None
    }

    /// Whether one arc, forward or backward, brings a car that is `turn` from the lane in line
    /// with it: then it is not wedged in.
    fn can_straighten(&self, start: Pose, turn: f64, things: &Things) -> bool {
        const STEP: f64 = 0.2;
        let body = self.vehicle.footprint(0.05);
        let steps = (turn.abs() / self.vehicle.max_curvature() / STEP).ceil();
        let swing = turn / steps.max(1.0);
        let is_free = |gear: f64| {
            let mut pose = start;
            (0..steps as u32).all(|_| {
                pose = Pose { heading: pose.heading - swing, ..pose.shifted(gear * STEP) };
                things.leave(pose, &body)
            })
        };
        is_free(1.0) || is_free(-1.0)
    }
}

/// How wide a lane lets a car back into a bay `width` wide in one go, metres: it turns about a
/// centre beside the bay so that its inner side passes the neighbour's corner.
fn lane_to_back_into(vehicle: &Vehicle, width: f64) -> f64 {
    let (radius, half) = (vehicle.turning_radius(), vehicle.width / 2.0);
    let outer = (radius + half).hypot(vehicle.front_extent());
    let (inner, corner) = (radius - half, radius - width / 2.0);
    outer - (inner.powi(2) - corner.powi(2)).max(0.0).sqrt()
}

/// The longest run of shifts within ± `most` that hold.
fn longest_run(most: f64, holds: impl Fn(f64) -> bool) -> Option<[f64; 2]> {
    const STEP: f64 = 0.02;
    let n = (most / STEP).floor().max(0.0) as i32;
    let mut best: Option<[f64; 2]> = None;
    let mut begin = None;
    for i in -n..=n + 1 {
        let shift = f64::from(i) * STEP;
        if i <= n && holds(shift) {
            begin.get_or_insert(shift);
        } else if let Some(begin) = begin.take() {
            let run = [begin, shift - STEP];
            if best.is_none_or(|[low, high]| run[1] - run[0] > high - low) {
                best = Some(run);
            }
        }
    }
    best
}
