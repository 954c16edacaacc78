//! One seed, many named streams of random numbers.
//!
//! A stream is picked by purpose and index, never by thread or by time, so that
//! results depend on the seed alone.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What random numbers are for. The discriminants are part of the data format:
/// never renumber them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// A generated scene.
    Scene = 1,
    /// A sampled start pose of the data collection.
    Start = 2,
    /// Initial network weights.
    Weights = 3,
    /// Order of the training rows.
    Shuffle = 4,
    /// Which cells validate.
    Split = 5,
    /// Bootstrap resampling of the tables.
    Bootstrap = 6,
    /// Starts and trials in the choice of what a network learns.
    Targets = 7,
    /// An abstracted environment to learn parking in.
    Course = 8,
    /// Which kind of environment comes next in reinforcement learning.
    Strata = 9,
    /// What a policy draws: its actions' noise.
    Policy = 10,
    /// Which transitions a step of reinforcement learning looks at, and its noise.
    Replay = 11,
    /// Errors of sensors, where they are simulated.
    Noise = 12,
    /// A scene of clutter.
    Clutter = 13,
    /// An unusual bay.
    Bay = 14,
    /// A whole car park.
    Lot = 15,
    /// A generated scene of an angled bay.
    Angled = 16,
    /// Where in the world a scene of a volume run is put.
    Place = 17,
    /// A world to learn manoeuvres in.
    World = 20,
    /// Errors that a driven car meets.
    Drive = 22,
    /// Where on the way a car begins, to learn what is foreseen from there.
    Foresight = 21,
}

/// The generator of `(seed, stream, index)`.
pub fn rng(seed: u64, stream: Stream, index: u64) -> ChaCha8Rng {
    let mut key = [0u8; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(stream as u64).to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(index);
    rng
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn streams_differ_and_repeat() {
        let draw = |seed, stream, i| rng(seed, stream, i).next_u64();
        assert_eq!(draw(7, Stream::Scene, 3), draw(7, Stream::Scene, 3));
        assert_ne!(draw(7, Stream::Scene, 3), draw(7, Stream::Scene, 4));
        assert_ne!(draw(7, Stream::Scene, 3), draw(7, Stream::Start, 3));
        assert_ne!(draw(7, Stream::Scene, 3), draw(8, Stream::Scene, 3));
    }
}
