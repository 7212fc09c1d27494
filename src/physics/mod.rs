//! CREATE-like physics on rapier2d: units, tools, balls, the world and its step.
