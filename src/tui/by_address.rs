//! Shared values as keys of caches.

use std::sync::Arc;

/// A shared value that equals only itself. It keeps the value alive, so its address cannot be reused.
#[derive(Debug, Clone)]
pub struct ByAddress<T: ?Sized>(pub Arc<T>);

impl<T: ?Sized> PartialEq for ByAddress<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_equals_only_itself() {
        let value = Arc::new(1);
        assert!(ByAddress(value.clone()) == ByAddress(value.clone()));
        assert!(ByAddress(value) != ByAddress(Arc::new(1)));
    }
}
