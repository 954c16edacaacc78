//! Pieces of neural networks that candle lacks, or does slowly on the CPU.

mod ops;
mod optimiser;

pub use ops::{attention, layer_norm};
pub use optimiser::AdamW;
