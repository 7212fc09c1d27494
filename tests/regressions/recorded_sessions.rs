//! A recorded session can be replayed and gives the same files.
