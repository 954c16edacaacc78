//! A* cost-to-go.
