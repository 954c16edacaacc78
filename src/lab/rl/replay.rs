//! The replay memory: a ring of transitions, packed.

use crate::environment::lidar::RANGE;
use crate::environment::motion::PARTS;
use crate::environment::{Action, BEAMS, MASK, Observation, TARGET};

/// What one step taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// What was seen.
    pub before: Observation,
    /// What was done.
    pub action: Action,
    /// What it earned.
    pub reward: f32,
    /// Whether the episode went on, or ended for want of steps alone: what follows counts.
    pub goes_on: bool,
    /// What was seen then.
    pub after: Observation,
}

/// Bytes of a packed observation: beams as 16-bit shares of [`RANGE`], the target in single
/// precision, the mask in tenths.
const OBSERVATION: usize = 2 * BEAMS + 4 * TARGET + MASK;

/// Bytes of a packed transition.
const PACKED: usize = 2 * OBSERVATION + 4 * 3 + 1;

/// The last transitions, up to a capacity.
#[derive(Clone, Debug)]
pub struct Replay {
    bytes: Vec<u8>,
    capacity: usize,
    /// Where the next transition goes.
    next: usize,
}

impl Replay {
    /// A memory of at most `capacity` transitions.
    pub fn new(capacity: usize) -> Self {
        Self { bytes: Vec::new(), capacity, next: 0 }
    }

    /// Transitions kept.
    pub fn len(&self) -> usize {
        self.bytes.len() / PACKED
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Keeps a transition; of a full memory the oldest goes.
    pub fn push(&mut self, transition: &Transition) {
        if self.len() < self.capacity {
            self.bytes.extend(pack(transition));
        } else {
            self.bytes[self.next * PACKED..][..PACKED].copy_from_slice(&pack(transition));
        }
        self.next = (self.next + 1) % self.capacity;
    }

    /// The transition at `index`, below [`Replay::len`].
    pub fn get(&self, index: usize) -> Transition {
        unpack(&self.bytes[index * PACKED..][..PACKED])
    }

    /// The memory's bytes, and where the next transition goes.
    pub fn state(&self) -> (&[u8], usize) {
        (&self.bytes, self.next)
    }

    /// A memory with a [`Replay::state`]; `None` where that is of another capacity.
    pub fn restored(capacity: usize, bytes: Vec<u8>, next: usize) -> Option<Self> {
        let len = bytes.len() / PACKED;
        let fits = bytes.len().is_multiple_of(PACKED)
            && (next == len && len < capacity || len == capacity && next < capacity);
        fits.then_some(Self { bytes, capacity, next })
    }
}

fn pack(t: &Transition) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(PACKED);
    for o in [&t.before, &t.after] {
        let beams = o.lidar.iter().map(|v| (v / RANGE as f32 * f32::from(u16::MAX)).round() as u16);
        bytes.extend(beams.flat_map(u16::to_le_bytes));
        bytes.extend(o.target.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(o.mask.iter().map(|v| (v * PARTS as f32).round() as u8));
    }
    let numbers = [t.action.steer as f32, t.action.speed as f32, t.reward];
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    bytes.push(t.goes_on.into());
    bytes
}

fn unpack(bytes: &[u8]) -> Transition {
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let observation = |at: usize| {
        let beam = |i: usize| u16::from_le_bytes([bytes[at + 2 * i], bytes[at + 2 * i + 1]]);
        let (target, mask) = (at + 2 * BEAMS, at + 2 * BEAMS + 4 * TARGET);
        Observation {
            // Networks do not see the step.
            step: 0,
            lidar: std::array::from_fn(|i| f32::from(beam(i)) / f32::from(u16::MAX) * RANGE as f32),
            target: std::array::from_fn(|i| float(target + 4 * i)),
            mask: std::array::from_fn(|i| f32::from(bytes[mask + i]) / PARTS as f32),
        }
    };
    let at = 2 * OBSERVATION;
    Transition {
        before: observation(0),
        after: observation(OBSERVATION),
        action: Action { steer: float(at).into(), speed: float(at + 4).into() },
        reward: float(at + 8),
        goes_on: bytes[at + 12] != 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transition(i: usize) -> Transition {
        let f = i as f32;
        let observation = |offset: f32| Observation {
            step: 0,
            lidar: [(offset + f * 0.37) % 10.0; BEAMS],
            target: [f, 0.6, -0.8, offset, 0.0],
            mask: std::array::from_fn(|m| ((m + i) % 11) as f32 / 10.0),
        };
        Transition {
            before: observation(0.0),
            action: Action { steer: 0.5, speed: -1.0 },
            reward: -f,
            goes_on: i.is_multiple_of(2),
            after: observation(1.0),
        }
    }

    #[test]
    fn packs_all_but_rounding_of_the_lidar() {
        let mut memory = Replay::new(3);
        (0..8).for_each(|i| memory.push(&transition(i)));
        assert_eq!(memory.len(), 3);
        for (index, i) in [(0, 6), (1, 7), (2, 5)] {
            let (got, expected) = (memory.get(index), transition(i));
            let apart = (got.before.lidar[0] - expected.before.lidar[0]).abs();
            assert!(apart < 1e-4, "{apart}");
            assert_eq!(
                (got.before.target, got.after.mask),
                (expected.before.target, expected.after.mask)
            );
            assert_eq!(
                (got.action, got.reward, got.goes_on),
                (expected.action, expected.reward, expected.goes_on)
            );
        }
        let (bytes, next) = memory.state();
        let again = Replay::restored(3, bytes.to_vec(), next).unwrap();
        assert_eq!(again.get(2), memory.get(2));
        assert!(Replay::restored(4, bytes.to_vec(), next).is_none());
    }
}
