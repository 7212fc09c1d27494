//! The terminal: panes, widgets, key map, theme.
