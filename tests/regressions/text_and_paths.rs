//! Texts and paths as people write them: byte order marks, `~`, long names, suffixes.
