//! The libraries together: recorded data of CREATE, its rules and levels, invalid files, memory.

mod bad_input;
mod create;
mod levels;
mod memory;
