//! The libraries together: recorded data of CREATE, its rules and levels, invalid files, memory, packages.

mod bad_input;
mod create;
mod levels;
mod memory;
mod packages;
