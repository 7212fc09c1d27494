//! The training loop on its own thread: control in, events out.
