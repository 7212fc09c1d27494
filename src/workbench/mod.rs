//! Everything a person can do, as data: commands, session state, scripts.
