//! Values loaded in the background.

use std::time::{Duration, Instant};

use super::job::{Job, Reporter};

/// Values by key: each is pending, ready or failed, and has an age. One value is loaded at a time, on a thread of its
/// own; at most a given number of loaded values is kept. A request is cheap and is repeated for as long as its value
/// is needed, so that the owner never waits: it takes over what has been loaded by [`Loader::poll`].
#[derive(Debug)]
pub struct Loader<K, V> {
    bound: usize,
    /// What was loaded and when, the latest last.
    loaded: Vec<(K, Instant, Result<V, String>)>,
    loading: Option<(K, Instant, Job<V>)>,
    /// How long the latest load took.
    took: Duration,
}

impl<K: PartialEq, V: Send + 'static> Default for Loader<K, V> {
    /// Keeps the value loaded last.
    fn default() -> Self {
        Self::new(1)
    }
}

impl<K: PartialEq, V: Send + 'static> Loader<K, V> {
    /// Nothing loaded yet; at most `bound` values are kept, those loaded last.
    pub const fn new(bound: usize) -> Self {
        Self { bound, loaded: Vec::new(), loading: None, took: Duration::ZERO }
    }

    /// Loads the value of a key by `load`, unless it was loaded at most `max_age` ago or something is being loaded.
    pub fn request(
        &mut self,
        key: K,
        max_age: Duration,
        load: impl FnOnce(&Reporter) -> Result<V, String> + Send + 'static,
    ) {
        let mut of_key = self.loaded.iter().filter(|(known, ..)| *known == key);
        if self.loading.is_some() || of_key.any(|(_, at, _)| at.elapsed() <= max_age) {
            return;
        }
        self.loading = Some((key, Instant::now(), Job::spawn(load)));
    }

    /// The value loaded last of the keys that satisfy `which`, or why it could not be loaded, with its key.
    pub fn latest(&self, which: impl Fn(&K) -> bool) -> Option<(&K, &Result<V, String>)> {
        self.loaded.iter().rev().find(|(key, ..)| which(key)).map(|(key, _, value)| (key, value))
    }

    /// Sets the value of a key that became known otherwise.
    pub fn set(&mut self, key: K, value: Result<V, String>) {
        self.loaded.retain(|(known, ..)| *known != key);
        self.loaded.push((key, Instant::now(), value));
        self.loaded.drain(..self.loaded.len().saturating_sub(self.bound));
    }

    /// Takes over a value that has been loaded. True if there is one.
    pub fn poll(&mut self) -> bool {
        let Some((key, begun, job)) = self.loading.take_if(|(.., job)| job.is_finished()) else { return false };
        self.took = begun.elapsed();
        self.set(key, job.result());
        true
    }

    /// Whether something is being loaded.
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// Whether enough time has passed since the latest load for another costly one: `pause`, or `factor` times what
    /// that one took.
    pub fn is_rested(&self, pause: Duration, factor: u32) -> bool {
        let pause = pause.max(self.took * factor);
        self.loaded.last().is_none_or(|(_, at, _)| at.elapsed() >= pause)
    }

    /// As if the latest load had taken `took`, and had ended `ago`.
    #[cfg(test)]
    pub fn age(&mut self, took: Duration, ago: Duration) {
        (self.took, self.loaded[0].1) = (took, Instant::now() - ago);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    /// A loader with a load that is held until something is sent.
    fn held(bound: usize, key: u32) -> (Loader<u32, u32>, Sender<u32>) {
        let mut loader = Loader::new(bound);
        let (release, gate): (Sender<u32>, Receiver<u32>) = channel();
        loader.request(key, Duration::MAX, move |_| gate.recv().map_err(|error| error.to_string()));
        (loader, release)
    }

    fn wait(loader: &mut Loader<u32, u32>) {
        while loader.is_loading() {
            loader.poll();
            std::thread::yield_now();
        }
    }

    fn get<V: Send + 'static>(loader: &Loader<u32, V>, key: u32) -> Option<&Result<V, String>> {
        loader.latest(|known| *known == key).map(|(_, value)| value)
    }

    #[test]
    fn requests_and_polls_do_not_wait_for_a_slow_load() {
        let (mut loader, release) = held(2, 1);
        for key in 0..1000 {
            loader.request(key, Duration::ZERO, |_| panic!("another value is being loaded"));
            assert!(!loader.poll() && get(&loader, 1).is_none() && loader.is_loading());
        }
        release.send(7).unwrap();
        wait(&mut loader);
        assert_eq!(get(&loader, 1), Some(&Ok(7)));
    }

    #[test]
    fn a_value_is_loaded_again_once_it_is_too_old() {
        let (mut loader, release) = held(2, 1);
        release.send(7).unwrap();
        wait(&mut loader);
        loader.request(1, Duration::from_secs(60), |_| panic!("it is recent"));
        loader.age(Duration::ZERO, Duration::from_secs(61));
        loader.request(1, Duration::from_secs(60), |_| Err("gone".to_owned()));
        assert_eq!(get(&loader, 1), Some(&Ok(7)), "it is kept until then");
        wait(&mut loader);
        assert_eq!(get(&loader, 1), Some(&Err("gone".to_owned())));
    }

    #[test]
    fn the_values_loaded_last_are_kept_up_to_the_bound() {
        let mut loader = Loader::new(2);
        for key in [1, 2, 3, 2] {
            loader.request(key, Duration::ZERO, move |_| Ok(10 * key));
            wait(&mut loader);
        }
        assert_eq!([1, 2, 3].map(|key| get(&loader, key).is_some()), [false, true, true]);
        assert_eq!(loader.latest(|key| *key > 0), Some((&2, &Ok(20))));
        assert_eq!(loader.latest(|key| *key > 2), Some((&3, &Ok(30))));
    }

    #[test]
    fn a_costly_load_is_followed_by_a_pause() {
        let mut loader: Loader<u32, u32> = Loader::new(1);
        assert!(loader.is_rested(Duration::from_secs(1), 20));
        loader.set(1, Ok(1));
        assert!(!loader.is_rested(Duration::from_secs(1), 20));
        loader.age(Duration::ZERO, Duration::from_secs(2));
        assert!(loader.is_rested(Duration::from_secs(1), 20));
        loader.age(Duration::from_secs(20), Duration::from_secs(2));
        assert!(!loader.is_rested(Duration::from_secs(1), 20));
    }

    #[test]
    fn a_panic_is_a_failure() {
        let mut loader: Loader<u32, u32> = Loader::new(1);
        loader.request(1, Duration::MAX, |_| panic!("on purpose"));
        wait(&mut loader);
        assert!(get(&loader, 1).unwrap().as_ref().unwrap_err().contains("on purpose"));
    }
}
