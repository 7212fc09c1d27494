//! Nothing is removed or replaced except what the program wrote.
