//! The range of episodes that a chart shows.

/// The range of episodes to show.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Range {
    /// All of them.
    #[default]
    Whole,
    /// A fixed window.
    Part(Window),
}

/// A window of episodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// The first.
    pub from: f32,
    /// The last.
    pub to: f32,
}

/// The narrowest window.
const NARROWEST: f32 = 10.0;

impl Range {
    /// The window over `episodes` episodes, counted from 1.
    pub fn window(self, episodes: usize) -> Window {
        let last = (episodes as f32).max(NARROWEST);
        match self {
            Self::Whole => Window { from: 1.0, to: last },
            Self::Part(window) => window,
        }
    }

    /// A window `factor` times as wide around `centre`; the whole range if it is wider.
    pub fn zoom(self, factor: f32, centre: Option<f32>, episodes: usize) -> Self {
        let now = self.window(episodes);
        let centre = centre.unwrap_or(now.to).clamp(now.from, now.to);
        let width = (now.to - now.from) * factor;
        if width >= episodes as f32 - 1.0 {
            return Self::Whole;
        }
        let width = width.max(NARROWEST);
        let share = (centre - now.from) / (now.to - now.from).max(1.0);
        let from = centre - share * width;
        Self::Part(Window { from, to: from + width }.kept_within(episodes))
    }

    /// The window moved by a share of its width; the whole range stays.
    pub fn pan(self, share: f32, episodes: usize) -> Self {
        let now = self.window(episodes);
        let by = (now.to - now.from) * share;
        match self {
            Self::Whole => Self::Whole,
            _ => Self::Part(Window { from: now.from + by, to: now.to + by }.kept_within(episodes)),
        }
    }
}

impl Window {
    fn kept_within(self, episodes: usize) -> Self {
        let width = self.to - self.from;
        let from = self.from.min(episodes as f32 - width).max(1.0);
        Self { from, to: from + width }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zooming_in_keeps_the_centre_and_zooming_out_ends_in_the_whole_range() {
        let zoomed = Range::Whole.zoom(0.5, Some(500.5), 1000);
        let Range::Part(window) = zoomed else { panic!("{zoomed:?}") };
        assert!((window.from - 250.75).abs() < 0.1 && (window.to - 750.25).abs() < 0.1, "{window:?}");
        assert_eq!(zoomed.zoom(2.0, None, 1000), Range::Whole, "it follows the training again");
        assert_eq!(zoomed.zoom(4.0, None, 1000), Range::Whole);
        let narrow = (0..20).fold(Range::Whole, |range, _| range.zoom(0.5, Some(1.0), 1000)).window(1000);
        assert_eq!(narrow, Window { from: 1.0, to: 11.0 });
    }

    #[test]
    fn panning_stops_at_the_ends() {
        let part = Range::Whole.zoom(0.2, None, 1000);
        let right = part.pan(1.0, 1000).window(1000);
        assert_eq!(right.to, 1000.0);
        let left = (0..20).fold(part, |range, _| range.pan(-0.5, 1000)).window(1000);
        assert_eq!(left.from, 1.0);
    }

    #[test]
    fn few_episodes_still_have_a_width() {
        assert_eq!(Range::Whole.pan(1.0, 700), Range::Whole);
        for range in [Range::Whole, Range::Whole.zoom(0.5, None, 0), Range::Whole.pan(1.0, 3)] {
            let window = range.window(0);
            assert!(window.to > window.from, "{range:?}");
        }
    }
}
