//! Whether a run is finished, damaged or the best is judged by all of its files.
