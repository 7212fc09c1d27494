//! Tests of the pages and of the command line as a whole.

mod documentation;
