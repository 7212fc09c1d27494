//! Caches what was computed for the charts of a frame for the next frame.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::rc::{Rc, Weak};

use ratatui::buffer::Buffer;
use ratatui::style::Color;

use super::decimated::{Decimated, Look, LookKey, union};

/// What was computed for the charts of the last frame with charts, so that the next frame computes only what is new.
/// Everything else is dropped, because the curves of a running training change with every frame.
#[derive(Debug, Default)]
pub struct ChartCache {
    /// Single curves, as long as a chart uses them.
    lines: RefCell<HashMap<Key, Weak<Decimated>>>,
    drawn: RefCell<FrameCache<DrawnKey, Drawn>>,
    pictures: RefCell<FrameCache<PictureKey, Buffer>>,
    /// The latest number given to the curves of a chart.
    numbered: Cell<u64>,
}

/// Values by their key, each with a flag whether this frame has used it.
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

/// The cache key of a curve: its version, its index within the version, and its look.
type Key = (u64, usize, LookKey);

/// The cache key of all curves of a chart together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawnKey {
    /// For each curve: version, colour, last dotted episode, and whether it has a band.
    pub curves: Vec<((u64, usize), Color, u64, bool)>,
    /// Their look.
    pub look: LookKey,
}

impl Hash for DrawnKey {
    fn hash<H: Hasher>(&self, state: &mut H) {
        // The versions distinguish nearly all keys, and hashing must be fast: a chart may have a hundred curves.
        self.curves.iter().for_each(|((version, _), ..)| state.write_u64(*version));
        self.curves.first().hash(state);
        self.look.hash(state);
    }
}

/// The curves of a chart.
#[derive(Debug)]
pub struct Drawn {
    /// A unique number; None if a curve has no version.
    pub number: Option<u64>,
    /// The decimated curves.
    pub lines: Vec<Rc<Decimated>>,
    /// Smallest and largest scaled value of all of them.
    pub range: Option<[f32; 2]>,
}

impl Drawn {
    fn new(number: Option<u64>, lines: Vec<Rc<Decimated>>) -> Self {
        let ranges = lines.iter().filter_map(|line| line.range);
        let range = ranges.reduce(union);
        Self { number, lines, range }
    }
}

/// The cache key of the picture of a chart's curves.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PictureKey {
    /// The number of the curves.
    pub number: u64,
    /// The bits of the lowest and the highest value of the axis.
    pub range: [u32; 2],
    /// Width and height of the plot in cells.
    pub size: [u16; 2],
    /// Dots per cell.
    pub dots: [u16; 2],
}

impl ChartCache {
    /// The decimated curve, from the cache if it is known. `version` is a number that changes whenever the values
    /// change, and the index of the curve among those that share the number; without one, nothing is cached.
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

    /// The curves of a chart, from the cache if they are known; without a key, nothing is cached.
    pub fn drawn(&self, key: Option<DrawnKey>, lines: impl FnOnce() -> Vec<Rc<Decimated>>) -> Rc<Drawn> {
        let Some(key) = key else { return Rc::new(Drawn::new(None, lines())) };
        let number = || {
            self.numbered.set(self.numbered.get() + 1);
            Some(self.numbered.get())
        };
        self.drawn.borrow_mut().get(key, || Drawn::new(number(), lines()))
    }

    /// The picture of a chart's curves, from the cache if it is known.
    pub fn picture(&self, key: PictureKey, draw: impl FnOnce() -> Buffer) -> Rc<Buffer> {
        self.pictures.borrow_mut().get(key, draw)
    }

    /// Drops what the frame did not use, unless it had no charts at all.
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
    fn a_curve_is_decimated_again_only_after_a_change() {
        let cache = ChartCache::default();
        let at = |version: Option<u64>, values: &[f32], look: &Look| {
            cache.decimated(version.map(|version| (version, 0)), &all(values), values, look)
        };
        let first = at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 10));
        assert!(Rc::ptr_eq(&first, &at(Some(1), &[9.0, 9.0], &look(1.0, 2.0, 10))), "same version, same values");
        assert!(!Rc::ptr_eq(&first, &at(Some(2), &[1.0, 2.0], &look(1.0, 2.0, 10))));
        assert_ne!(first, at(Some(1), &[1.0, 2.0], &look(1.0, 2.0, 20)));
        assert_ne!(first, at(None, &[9.0, 9.0], &look(1.0, 2.0, 10)));
    }

    #[test]
    fn the_curves_of_a_chart_are_computed_again_only_after_a_change() {
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
    fn unused_values_are_dropped_except_in_frames_without_charts() {
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
        assert!(Rc::ptr_eq(&first.lines[1], &second.lines[0]), "the unchanged curve of a changed chart is kept");
        drop((first, second));
        (4..100).for_each(|version| drop(frame(&[2, version])));
        assert_eq!((cache.drawn.borrow().0.len(), cache.lines.borrow().len()), (1, 2));
    }
}
