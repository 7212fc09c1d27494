//! Statistics of runs: rolling success, interquartile mean, bootstrap intervals.
