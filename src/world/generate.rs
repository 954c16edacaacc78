//! Paper-style scene generator.
