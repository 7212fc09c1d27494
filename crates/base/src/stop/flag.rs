//! The flag that asks work to stop.

use std::sync::Arc;

use super::atomic::{AtomicBool, Ordering};

/// A flag that asks work to stop. Clones share the flag. Whoever sees the request also sees everything that the
/// requesting thread did before it.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

/// Work ended early because it was asked to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped before its end")]
pub struct Stopped;

impl Stop {
    /// Asks all work that polls this flag to stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether the work should stop.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// The items of a long loop, which ends early once a stop is requested: [`check`](Self::check) after it.
    pub fn until<I: IntoIterator>(&self, items: I) -> impl Iterator<Item = I::Item> {
        items.into_iter().take_while(|_| !self.is_requested())
    }

    /// Ends work by `?` once a stop is requested.
    ///
    /// # Errors
    /// When a stop is requested.
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_requested() { Err(Stopped) } else { Ok(()) }
    }
}
