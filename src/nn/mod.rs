//! Networks on dfdx: fused multilayer perceptrons, resumable optimisers, weights on disk.
