//! How the terminal shows pictures, and whether its background is light. Terminals that are known to answer are asked,
//! once, before the workbench reads keys.

use std::time::Duration;

use ratatui_image::picker::cap_parser::QueryStdioOptions;
use ratatui_image::picker::{Capability, Picker, ProtocolType};

/// Longest wait for the answers.
const TIMEOUT: Duration = Duration::from_millis(200);
/// Variables of the environment that are set by terminals which answer.
const VARIABLES: [&str; 8] = [
    "ALACRITTY_WINDOW_ID",
    "KITTY_WINDOW_ID",
    "KONSOLE_VERSION",
    "TERM_PROGRAM",
    "VTE_VERSION",
    "WEZTERM_EXECUTABLE",
    "WT_SESSION",
    "XTERM_VERSION",
];
/// Values of `TERM` of such terminals, which programs on other machines see too.
const TERMS: [&str; 6] = ["xterm-kitty", "xterm-ghostty", "foot", "alacritty", "wezterm", "mlterm"];

/// How the terminal shows pictures, if it does, and whether its background is light, as far as it tells.
/// `MGE_GRAPHICS` (`kitty`, `sixel`, `iterm2`, `none`) takes precedence.
pub fn ask(variable: impl Fn(&str) -> Option<String>) -> (Option<Picker>, Option<bool>) {
    let value = |name: &str| variable(name).unwrap_or_default();
    let wanted = match value("MGE_GRAPHICS").as_str() {
        "kitty" => Some(ProtocolType::Kitty),
        "sixel" => Some(ProtocolType::Sixel),
        "iterm2" => Some(ProtocolType::Iterm2),
        "none" => Some(ProtocolType::Halfblocks),
        _ => None,
    };
    if !is_known(value) && wanted.is_none_or(|wanted| wanted == ProtocolType::Halfblocks) {
        return (None, None);
    }
    let options = QueryStdioOptions { timeout: TIMEOUT, terminal_background_color_osc: true, ..Default::default() };
    let Ok(mut picker) = Picker::from_query_stdio_with_options(options) else { return (None, None) };
    if let Some(wanted) = wanted {
        picker.set_protocol_type(wanted);
    }
    let background = picker.capabilities().iter().find_map(|capability| match capability {
        Capability::Background(r, g, b) => Some(u32::from(*r) + u32::from(*g) + u32::from(*b) > 3 * 128),
        _ => None,
    });
    (Some(picker).filter(|picker| picker.protocol_type() != ProtocolType::Halfblocks), background)
}

/// Whether the terminal answers at once. A multiplexer inherits the variables of the terminal it was started in.
fn is_known(value: impl Fn(&str) -> String) -> bool {
    let term = value("TERM");
    let inside = term.starts_with("screen") || term.starts_with("tmux") || !value("TMUX").is_empty();
    !inside && (TERMS.contains(&term.as_str()) || VARIABLES.iter().any(|name| !value(name).is_empty()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_terminals_that_answer_are_asked() {
        let known = |variables: &[(&str, &str)]| {
            let of = |name: &str| variables.iter().find(|(key, _)| *key == name).map_or("", |(_, value)| *value);
            is_known(|name| of(name).to_owned())
        };
        assert!(known(&[("TERM", "xterm-kitty")]));
        assert!(known(&[("TERM", "xterm-256color"), ("TERM_PROGRAM", "iTerm.app")]));
        assert!(!known(&[("TERM", "tmux-256color"), ("KITTY_WINDOW_ID", "1")]));
        assert!(!known(&[("TERM", "xterm-256color")]) && !known(&[("TERM", "linux")]));
    }
}
