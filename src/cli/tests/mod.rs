//! Tests of the documentation and of the command line as a whole.

mod documentation;
