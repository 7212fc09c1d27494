//! Items that an agent chooses among, represented by embeddings.

use std::sync::Arc;

/// Items of which an agent chooses one with every action; each is represented by a point, its
/// embedding. The items on offer may change with every observation, and an item that was never offered
/// before can be chosen by its embedding.
///
/// An agent with options is Wolpertinger (Dulac-Arnold et al., 2015: "Deep Reinforcement Learning in
/// Large Discrete Action Spaces") on DDPG, with a part of the action that stays continuous. The actor
/// outputs that part and the embedding of an item that need not exist, the proto item. The
/// [`candidates`](Self::candidates) nearest to it among the items on offer are evaluated, and the one
/// that the critic values most is taken. Observations end with the numbers of the items on offer, which
/// the networks do not see, and actions end with the embedding of the item taken. Describing items by
/// their properties, so that a policy generalises over sets of items, follows Jain et al., 2020
/// ("Generalization to New Actions in Reinforcement Learning").
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Length of an embedding, at least 1.
    len: usize,
    /// Embeddings, one per row.
    embeddings: Arc<[f32]>,
    offered: usize,
    candidates: usize,
}

impl Options {
    /// Items with these embeddings, one per row of `len` numbers. At most `offered` items are on offer at
    /// a time: an observation ends with this many numbers, and unused ones do not denote any item.
    ///
    /// # Panics
    /// If the embeddings are not whole rows, or a count is 0.
    pub fn new(len: usize, embeddings: Vec<f32>, offered: usize, candidates: usize) -> Self {
        assert!(len > 0 && offered > 0 && candidates > 0 && embeddings.len().is_multiple_of(len), "options");
        Self { len, embeddings: embeddings.into(), offered, candidates }
    }

    /// Length of an embedding.
    pub fn embedding_len(&self) -> usize {
        self.len
    }

    /// All embeddings, one per row.
    pub fn embeddings(&self) -> &[f32] {
        &self.embeddings
    }

    /// Maximum number of items on offer at a time.
    pub fn offered(&self) -> usize {
        self.offered
    }

    /// Number of items that the critic evaluates for an action.
    pub fn candidates(&self) -> usize {
        self.candidates
    }

    /// Sets the number of items that the critic evaluates for an action, at least 1.
    pub(super) fn set_candidates(&mut self, candidates: usize) {
        self.candidates = candidates.max(1);
    }

    /// The embedding of an item; none if there is no item with this number.
    pub fn embedding(&self, number: usize) -> Option<&[f32]> {
        self.embeddings.get(number.checked_mul(self.len)?..)?.get(..self.len)
    }

    /// The index in `offer` of the item nearest to a point; none if nothing is on offer.
    pub fn nearest(&self, offer: &[f32], point: &[f32]) -> Option<usize> {
        self.by_distance(offer, point).first().map(|(place, _)| *place)
    }

    /// Embeddings of the items on offer that are candidates for a point, the nearest first.
    pub(super) fn near(&self, offer: &[f32], point: &[f32]) -> Vec<&[f32]> {
        let ordered = self.by_distance(offer, point).into_iter();
        ordered.take(self.candidates).map(|(_, embedding)| embedding).collect()
    }

    /// Indices in `offer` and embeddings of its items, the nearest first; equally near ones keep their
    /// order.
    fn by_distance(&self, offer: &[f32], point: &[f32]) -> Vec<(usize, &[f32])> {
        let distance = |embedding: &[f32]| embedding.iter().zip(point).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
        let items = offer.iter().enumerate().filter_map(|(place, number)| Some((place, self.item(*number)?)));
        let mut items: Vec<_> = items.map(|(place, embedding)| (distance(embedding), place, embedding)).collect();
        items.sort_by(|a, b| a.0.total_cmp(&b.0));
        items.into_iter().map(|(_, place, embedding)| (place, embedding)).collect()
    }

    /// The embedding of the item that a number of an observation denotes, if it denotes one.
    fn item(&self, number: f32) -> Option<&[f32]> {
        (number >= 0.0 && number.fract() == 0.0).then(|| self.embedding(number as usize))?
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four points on a line; the critic evaluates two.
    fn line() -> Options {
        Options::new(1, vec![-1.0, -0.5, 0.5, 1.0], 5, 2)
    }

    #[test]
    fn the_nearest_items_on_offer_are_the_candidates() {
        let near = |offer: &[f32], point: f32| -> Vec<f32> {
            line().near(offer, &[point]).into_iter().map(|embedding| embedding[0]).collect()
        };
        assert_eq!(near(&[0.0, 1.0, 2.0, 3.0], 0.6), [0.5, 1.0]);
        assert_eq!(near(&[3.0, 0.0, 1.0], 0.6), [1.0, -0.5], "others are not on offer");
        assert_eq!(near(&[2.0, 1.0], 0.0), [0.5, -0.5], "equally near: the first of the offer first");
        assert_eq!(near(&[-1.0, 2.0, 4.0, 0.5, f32::NAN], 0.0), [0.5], "other numbers denote no item");
        assert_eq!(line().nearest(&[-1.0, 3.0, 2.0], &[0.0]), Some(2));
        assert_eq!(line().nearest(&[-1.0, 7.0], &[0.0]), None);
    }
}
