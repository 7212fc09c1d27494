//! Bookkeeping of the recorded transitions that belong to segments that reached their stage.

use std::collections::VecDeque;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use mge_base::streams::index;

/// Segments of episodes by the stage that they reached. A segment consists of the transitions from one
/// reached stage, or the start of the episode, to the next; transitions are numbered from 0 in the order
/// of recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Segments {
    /// First transition after the latest reached stage.
    start: u64,
    /// First transition and length of the segments of each stage, the oldest first.
    by_stage: Vec<VecDeque<(u64, u64)>>,
}

impl Segments {
    /// Begins an episode at transition number `next`.
    pub fn begin(&mut self, next: u64) {
        self.start = next;
    }

    /// Records that the transition before number `next` reached `stage`.
    pub fn reach(&mut self, stage: usize, next: u64) {
        if self.by_stage.len() <= stage {
            self.by_stage.resize(stage + 1, VecDeque::new());
        }
        if next > self.start {
            self.by_stage[stage].push_back((self.start, next - self.start));
        }
        self.start = next;
    }

    /// Removes segments that begin before transition number `oldest`.
    pub fn forget_before(&mut self, oldest: u64) {
        for segments in &mut self.by_stage {
            while segments.front().is_some_and(|(start, _)| *start < oldest) {
                segments.pop_front();
            }
        }
    }

    /// Whether no episode has started.
    pub fn is_unused(&self) -> bool {
        *self == Self::default()
    }

    /// Whether this state is possible after `recorded` transitions.
    pub fn is_possible(&self, recorded: u64) -> bool {
        let is_before =
            |&(start, length): &(u64, u64)| length > 0 && start.checked_add(length).is_some_and(|end| end <= recorded);
        let is_possible = |segments: &VecDeque<_>| segments.iter().is_sorted() && segments.iter().all(is_before);
        self.start <= recorded && self.by_stage.iter().all(is_possible)
    }

    /// Whether there is no segment.
    pub fn is_empty(&self) -> bool {
        self.by_stage.iter().all(VecDeque::is_empty)
    }

    /// The number of a random transition: first a reached stage is drawn, then one of its segments, then a
    /// transition of that, each uniformly.
    ///
    /// # Panics
    /// If there is no segment.
    pub fn sample(&self, rng: &mut ChaCha8Rng) -> u64 {
        let stages = self.by_stage.iter().filter(|segments| !segments.is_empty());
        let stage = index(rng, stages.clone().count());
        let segments = stages.clone().nth(stage).expect("the index is below the count");
        let (start, length) = segments[index(rng, segments.len())];
        start + rng.gen_range(0..length)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    /// Two episodes: transitions 0 to 4 reach stages 0 and 1 after 3 and 5 steps; transitions 5 to 8
    /// reach stage 0 after one step and no other stage.
    fn segments() -> Segments {
        let mut segments = Segments::default();
        segments.begin(0);
        segments.reach(0, 3);
        segments.reach(1, 5);
        segments.begin(5);
        segments.reach(0, 6);
        segments.begin(9);
        segments
    }

    fn counts(segments: &Segments) -> [u32; 9] {
        let (mut rng, mut counts) = (ChaCha8Rng::seed_from_u64(1), [0; 9]);
        (0..12_000).for_each(|_| counts[segments.sample(&mut rng) as usize] += 1);
        counts
    }

    #[test]
    fn stages_and_their_segments_are_drawn_uniformly() {
        let expected = [1000, 1000, 1000, 3000, 3000, 3000, 0, 0, 0];
        for (transition, (found, expected)) in counts(&segments()).into_iter().zip(expected).enumerate() {
            assert!(found.abs_diff(expected) <= expected / 10, "transition {transition}: {found}, not {expected}");
        }
    }

    #[test]
    fn damage_is_detected() {
        let read = |text: &str| serde_json::from_str::<Segments>(text).unwrap();
        for (text, possible) in [
            (r#"{"start": 9, "by_stage": [[[0, 3], [5, 1]], [[3, 2]]]}"#, true),
            (r#"{"start": 10, "by_stage": []}"#, false),
            (r#"{"start": 9, "by_stage": [[[5, 1], [0, 3]]]}"#, false),
            (r#"{"start": 9, "by_stage": [[], [[5, 0]]]}"#, false),
            (r#"{"start": 9, "by_stage": [[[5, 5]]]}"#, false),
            (r#"{"start": 9, "by_stage": [[[5, 18446744073709551615]]]}"#, false),
        ] {
            assert_eq!(read(text).is_possible(9), possible, "{text}");
        }
    }

    #[test]
    fn overwritten_segments_are_removed() {
        let mut segments = segments();
        segments.forget_before(1);
        let found = counts(&segments);
        assert_eq!((found[..3].to_vec(), &found[6..]), (vec![0; 3], &[0; 3][..]));
        assert!(found[3..6].iter().all(|count| *count > 2500), "{found:?}");
        segments.forget_before(6);
        assert!(segments.is_empty());
    }
}
