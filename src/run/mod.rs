//! What a run is on disk: config, event log, metrics, checkpoints, lock, TensorBoard.
