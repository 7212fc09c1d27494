//! Many runs: sweeps, the reproduction of the paper, reports.
