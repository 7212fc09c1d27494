//! Task-agnostic dynamics models: launches, graphs, the network, training, prediction.
