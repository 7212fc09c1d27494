//! Replies of the terminal are not typed as keys, and external text cannot control it.
