//! Publication figures on plotters: pure functions from data to pixels.
