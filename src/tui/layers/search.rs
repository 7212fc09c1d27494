//! Search as one types: everywhere by the same rules.

use nucleo_matcher::pattern::{Atom, AtomKind, CaseMatching, Normalization};
use nucleo_matcher::{Config, Matcher, Utf32Str};

use mge_base::spelling::closeness;

/// Something that can be searched.
pub trait Searched {
    /// Its names, in which letters are found that are in the typed order, and a description, in which parts of words are.
    fn texts(&self) -> (Vec<&str>, &str);
}

/// The least score of a letter, on average: less is that of letters that are scattered over a long text by chance.
const LEAST: u32 = 18;

/// The items in which each word of the typed text is found, the best ones first: those with this name, those with a name
/// that begins so, then those with its letters close together.
pub fn search<'a, T: Searched>(items: impl IntoIterator<Item = &'a T>, typed: &str) -> Vec<&'a T> {
    // The value after a key is a word.
    let typed = typed.to_lowercase().replace('=', "= ");
    let typed = typed.trim();
    let words = typed.split_whitespace().map(|word| {
        let atom = |kind| Atom::new(word, CaseMatching::Ignore, Normalization::Smart, kind, false);
        // Scattered digits would be found in almost every number.
        let is_number = word.starts_with(|first: char| first.is_ascii_digit());
        ((!is_number).then(|| atom(AtomKind::Fuzzy)), atom(AtomKind::Substring), LEAST * word.len() as u32)
    });
    let words: Vec<_> = words.collect();
    let (mut matcher, mut characters) = (Matcher::new(Config::DEFAULT), Vec::new());
    let mut score = |atom: &Atom, text: &str| atom.score(Utf32Str::new(text, &mut characters), &mut matcher);
    let mut rank = |item: &T| {
        let ((names, about), mut sum) = (item.texts(), 0);
        let text = [&names, &[about][..]].concat().join(" ");
        for (scattered, part, least) in &words {
            let name = scattered.iter().flat_map(|atom| names.iter().map(move |name| (atom, name)));
            let name = name.filter_map(|(atom, name)| score(atom, name)).map(u32::from).max();
            let name = name.filter(|score| score >= least).map(|score| 2 * score);
            sum += name.max(score(part, &text).map(u32::from))?;
        }
        let begins = names.iter().filter(|name| name.to_lowercase().starts_with(typed));
        Some((begins.map(|name| name.len() == typed.len()).max(), sum))
    };
    let mut found: Vec<_> = items.into_iter().filter_map(|item| Some((rank(item)?, item))).collect();
    found.sort_by(|(a, _), (b, _)| b.cmp(a));
    found.into_iter().map(|(_, item)| item).collect()
}

/// The items with names at least so similar to a misspelt one, the most similar first.
pub fn similar<'a, T: Searched>(items: &'a [T], typed: &str, least: f64) -> Vec<&'a T> {
    /// Number of items.
    const SIMILAR: usize = 8;
    let rank = |item: &'a T| (item.texts().0.into_iter().map(|name| closeness(name, typed)).fold(0.0, f64::max), item);
    let mut all: Vec<_> = items.iter().map(rank).collect();
    all.retain(|(closeness, _)| *closeness >= least);
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    all.into_iter().map(|(_, item)| item).take(SIMILAR).collect()
}
