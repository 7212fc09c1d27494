//! What a result depends on is identified by its content, not by its path.
