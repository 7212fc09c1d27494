//! What an agent chooses among: items that are known by their embeddings.

use std::sync::Arc;

/// Items of which an agent takes one with every action, each known by a point, its embedding. Which
/// of them are on offer may change with every observation, and items that were never offered before
/// are met by where they are.
///
/// An agent with options is Wolpertinger (Dulac-Arnold et al., 2015: "Deep Reinforcement Learning in
/// Large Discrete Action Spaces") on DDPG, with a part of the action that stays continuous: the actor
/// gives that part and the point of an item that need not exist, a proto item; of the items on offer
/// the [`candidates`](Self::candidates) nearest to it are looked at, and the critic takes the one
/// that it values most. Its observations end with the numbers of the items on offer, which the
/// networks do not see, and its actions with the embedding of the item taken. That items are described
/// by what they are, so that a policy generalises over sets of them, follows Jain et al., 2020
/// ("Generalization to New Actions in Reinforcement Learning").
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Numbers of an embedding, at least 1.
    len: usize,
    /// Embeddings, one a row.
    embeddings: Arc<[f32]>,
    offered: usize,
    candidates: usize,
}

impl Options {
    /// Items with these embeddings, one a row of `len` numbers. At most `offered` are on offer at a
    /// time: so many numbers end an observation, and those that are no item's fill it up.
    ///
    /// # Panics
    /// If the embeddings do not make whole rows, or a count is 0.
    pub fn new(len: usize, embeddings: Vec<f32>, offered: usize, candidates: usize) -> Self {
        assert!(len > 0 && offered > 0 && candidates > 0 && embeddings.len().is_multiple_of(len), "options");
        Self { len, embeddings: embeddings.into(), offered, candidates }
    }

    /// Numbers of an embedding.
    pub fn embedding_len(&self) -> usize {
        self.len
    }

    /// All embeddings, one a row.
    pub fn embeddings(&self) -> &[f32] {
        &self.embeddings
    }

    /// Items on offer at a time, at most.
    pub fn offered(&self) -> usize {
        self.offered
    }

    /// Items that the critic looks at for an action.
    pub fn candidates(&self) -> usize {
        self.candidates
    }

    /// The same items; from now on the critic looks at another number of them, at least 1.
    pub(super) fn set_candidates(&mut self, candidates: usize) {
        self.candidates = candidates.max(1);
    }

    /// The embedding of an item; none if there is no item of that number.
    pub fn embedding(&self, number: usize) -> Option<&[f32]> {
        self.embeddings.get(number.checked_mul(self.len)?..)?.get(..self.len)
    }

    /// The place in `offer` of the item nearest to a point; none if nothing is on offer.
    pub fn nearest(&self, offer: &[f32], point: &[f32]) -> Option<usize> {
        self.by_distance(offer, point).first().map(|(place, _)| *place)
    }

    /// Embeddings of the items on offer that are candidates for a point, the nearest first.
    pub(super) fn near(&self, offer: &[f32], point: &[f32]) -> Vec<&[f32]> {
        let ordered = self.by_distance(offer, point).into_iter();
        ordered.take(self.candidates).map(|(_, embedding)| embedding).collect()
    }

    /// Places in `offer` and embeddings of its items, the nearest first; of two as near the first.
    fn by_distance(&self, offer: &[f32], point: &[f32]) -> Vec<(usize, &[f32])> {
        let distance = |embedding: &[f32]| embedding.iter().zip(point).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
        let items = offer.iter().enumerate().filter_map(|(place, number)| Some((place, self.item(*number)?)));
        let mut items: Vec<_> = items.map(|(place, embedding)| (distance(embedding), place, embedding)).collect();
        items.sort_by(|a, b| a.0.total_cmp(&b.0));
        items.into_iter().map(|(_, place, embedding)| (place, embedding)).collect()
    }

    /// The embedding of the item that a number of an observation stands for, if it is an item's.
    fn item(&self, number: f32) -> Option<&[f32]> {
        (number >= 0.0 && number.fract() == 0.0).then(|| self.embedding(number as usize))?
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four points on a line, of which the critic looks at two.
    fn line() -> Options {
        Options::new(1, vec![-1.0, -0.5, 0.5, 1.0], 5, 2)
    }

    #[test]
    fn the_nearest_on_offer_are_the_candidates() {
        let near = |offer: &[f32], point: f32| -> Vec<f32> {
            line().near(offer, &[point]).into_iter().map(|embedding| embedding[0]).collect()
        };
        assert_eq!(near(&[0.0, 1.0, 2.0, 3.0], 0.6), [0.5, 1.0]);
        assert_eq!(near(&[3.0, 0.0, 1.0], 0.6), [1.0, -0.5], "others are not on offer");
        assert_eq!(near(&[2.0, 1.0], 0.0), [0.5, -0.5], "of two as near the first");
        assert_eq!(near(&[-1.0, 2.0, 4.0, 0.5, f32::NAN], 0.0), [0.5], "what is no item is none");
        assert_eq!(line().nearest(&[-1.0, 3.0, 2.0], &[0.0]), Some(2));
        assert_eq!(line().nearest(&[-1.0, 7.0], &[0.0]), None);
    }
}
