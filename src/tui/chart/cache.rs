//! What was computed for the charts of a frame, for the next one.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::rc::{Rc, Weak};

use ratatui::buffer::Buffer;
use ratatui::style::Color;

use super::decimated::{Decimated, Look, LookKey};

/// What was computed for the charts of the last frame that had any, so that the next frame computes only what is new.
/// All else is dropped: the curves of a run that is trained are others with every frame.
#[derive(Debug, Default)]
pub struct ChartCache {
    /// Single curves, as long as a chart has them.
    lines: RefCell<HashMap<Key, Weak<Decimated>>>,
    drawn: RefCell<FrameCache<DrawnKey, Drawn>>,
    pictures: RefCell<FrameCache<PictureKey, Buffer>>,
    /// Charts that were numbered.
    numbered: Cell<u64>,
}

/// Values by what they depend on, and whether this frame had them.
#[derive(Debug)]
struct FrameCache<K, V>(HashMap<K, (Rc<V>, bool)>);

impl<K, V> Default for FrameCache<K, V> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<K: Eq + Hash, V> FrameCache<K, V> {
    fn get(&mut self, key: K, compute: impl FnOnce() -> V) -> Rc<V> {
        let (value, used) = self.0.entry(key).or_insert_with(|| (Rc::new(compute()), true));
        *used = true;
        value.clone()
    }

    fn is_used(&self) -> bool {
        self.0.values().any(|(_, used)| *used)
    }

    fn end_frame(&mut self) {
        self.0.retain(|_, (_, used)| std::mem::take(used));
    }
}

/// The version of a curve and how it is seen.
type Key = (u64, usize, LookKey);

/// What the curves of a chart, all together, are told apart by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawnKey {
    /// The curves: version, colour, values that are dotted, and whether there is a band.
    pub curves: Vec<((u64, usize), Color, u64, bool)>,
    /// How they are seen.
    pub look: LookKey,
}

impl Hash for DrawnKey {
    fn hash<H: Hasher>(&self, state: &mut H) {
        // Versions say nearly all; a hundred curves are hashed with every chart of a frame.
        self.curves.iter().for_each(|((version, _), ..)| state.write_u64(*version));
        self.curves.first().hash(state);
        self.look.hash(state);
    }
}

/// The curves of a chart.
#[derive(Debug)]
pub struct Drawn {
    /// Its number, which no others have; none if they cannot be told apart from others.
    pub number: Option<u64>,
    /// The curves in columns.
    pub lines: Vec<Rc<Decimated>>,
    /// Least and greatest value of all of them.
    pub range: Option<[f32; 2]>,
}

impl Drawn {
    fn new(number: Option<u64>, lines: Vec<Rc<Decimated>>) -> Self {
        let ranges = lines.iter().filter_map(|line| line.range);
        let range = ranges.reduce(|[low, high], [least, greatest]| [low.min(least), high.max(greatest)]);
        Self { number, lines, range }
    }
}

/// What the picture of the curves of a chart depends on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PictureKey {
    /// The number of the curves.
    pub number: u64,
    /// The lowest and the highest value of the axis, by their bits.
    pub range: [u32; 2],
    /// Cells of the plot.
    pub size: [u16; 2],
    /// Dots of a cell.
    pub dots: [u16; 2],
}

impl ChartCache {
    /// A curve in columns. Its version is a number that is another whenever the values are others, and which of the
    /// curves of that number it is; without one it is looked at again.
    pub fn decimated(
        &self,
        version: Option<(u64, usize)>,
        episodes: &[u64],
        values: &[f32],
        look: &Look,
    ) -> Rc<Decimated> {
        let Some((version, curve)) = version else { return Rc::new(look.decimate(episodes, values)) };
        let mut lines = self.lines.borrow_mut();
        let known = lines.entry((version, curve, look.key())).or_default();
        known.upgrade().unwrap_or_else(|| {
            let line = Rc::new(look.decimate(episodes, values));
            *known = Rc::downgrade(&line);
            line
        })
    }

    /// The curves of a chart; put together if they are not known, or cannot be told apart from others.
    pub fn drawn(&self, key: Option<DrawnKey>, lines: impl FnOnce() -> Vec<Rc<Decimated>>) -> Rc<Drawn> {
        let Some(key) = key else { return Rc::new(Drawn::new(None, lines())) };
        let number = || {
            self.numbered.set(self.numbered.get() + 1);
            Some(self.numbered.get())
        };
        self.drawn.borrow_mut().get(key, || Drawn::new(number(), lines()))
    }

    /// The picture of the curves of a chart; drawn if it is not known.
    pub fn picture(&self, key: PictureKey, draw: impl FnOnce() -> Buffer) -> Rc<Buffer> {
        self.pictures.borrow_mut().get(key, draw)
    }

    /// Drops what the frame did without, unless it had no chart at all.
    pub fn end_frame(&self) {
        if self.drawn.borrow().is_used() {
            self.drawn.borrow_mut().end_frame();
            self.pictures.borrow_mut().end_frame();
            self.lines.borrow_mut().retain(|_, line| line.strong_count() > 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::decimated::tests::{all, look};
    use super::*;

    #[test]
    fn a_curve_is_looked_at_again_only_when_something_is_another() {
        let cache = ChartCache::default();
        let at = |version: Option<u64>, values: &[f32], look: &Look| {
            cache.decimated(version.map(|version| (version, 0)), &all(values), values, look)
        };
        let first = at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 10));
        assert!(Rc::ptr_eq(&first, &at(Some(1), &[9.0, 9.0], &look(1.0, 2.0, 10))), "the version says it is the same");
        assert!(!Rc::ptr_eq(&first, &at(Some(2), &[1.0, 2.0], &look(1.0, 2.0, 10))));
        assert_ne!(first, at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 20)));
        assert_ne!(first, at(None, &[9.0, 9.0], &look(1.0, 2.0, 10)));
    }

    #[test]
    fn the_curves_of_a_chart_are_put_together_again_only_when_one_is_another() {
        let cache = ChartCache::default();
        let at = |versions: &[u64], colour: Color| {
            let curves = versions.iter().map(|version| ((*version, 0), colour, 0, false)).collect();
            let line = |value: f32| Rc::new(look(1.0, 2.0, 10).decimate(&[1], &[value]));
            cache.drawn(Some(DrawnKey { curves, look: look(1.0, 2.0, 10).key() }), || vec![line(1.0), line(3.0)])
        };
        let first = at(&[1, 2], Color::Red);
        assert_eq!(first.range, Some([1.0, 3.0]));
        assert!(Rc::ptr_eq(&first, &at(&[1, 2], Color::Red)));
        for other in [at(&[1, 3], Color::Red), at(&[1, 2], Color::Blue), cache.drawn(None, Vec::new)] {
            assert_ne!(first.number, other.number);
        }
    }

    #[test]
    fn what_a_frame_does_without_is_dropped_and_frames_without_charts_drop_nothing() {
        let cache = ChartCache::default();
        let frame = |versions: &[u64]| {
            let look = look(1.0, 2.0, 10);
            let curves = versions.iter().map(|version| ((*version, 0), Color::Red, 0, false)).collect();
            let lines = || versions.iter().map(|&version| cache.decimated(Some((version, 0)), &[1], &[1.0], &look));
            let drawn = cache.drawn(Some(DrawnKey { curves, look: look.key() }), || lines().collect());
            cache.end_frame();
            drawn
        };
        let first = frame(&[1, 2]);
        cache.end_frame();
        assert!(Rc::ptr_eq(&first, &frame(&[1, 2])), "nothing was drawn between");
        let second = frame(&[2, 3]);
        assert!(Rc::ptr_eq(&first.lines[1], &second.lines[0]), "of a chart that changed what is the same is kept");
        drop((first, second));
        (4..100).for_each(|version| drop(frame(&[2, version])));
        assert_eq!((cache.drawn.borrow().0.len(), cache.lines.borrow().len()), (1, 2));
    }
}
