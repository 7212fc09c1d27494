//! Settings without effect, contradictions and defaults are never silent.
