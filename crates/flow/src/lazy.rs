//! A large part of a result that is made or read only when somebody looks at it.

use crate::Error;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use supine_space::Progress;

/// How a value is had.
type Make<T> = Box<dyn Fn(Progress<'_>) -> Result<T, Error> + Send + Sync>;

/// A value that is held, or that can be had.
pub(crate) struct Lazy<T> {
    held: OnceLock<Arc<T>>,
    /// Gone once it is held: what it was made from need not be held too.
    make: Mutex<Option<Make<T>>>,
}

impl<T> std::fmt::Debug for Lazy<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.held.get().is_some() { "Lazy(held)" } else { "Lazy" })
    }
}

impl<T> Lazy<T> {
    /// A value that is held.
    pub(crate) fn held(value: T) -> Self {
        Self::shared(Arc::new(value))
    }

    /// A value that others hold too.
    pub(crate) fn shared(value: Arc<T>) -> Self {
        Self { held: OnceLock::from(value), make: Mutex::default() }
    }

    /// A value that is made, or read, on first use.
    pub(crate) fn made(
        make: impl Fn(Progress<'_>) -> Result<T, Error> + Send + Sync + 'static,
    ) -> Self {
        Self { held: OnceLock::new(), make: Mutex::new(Some(Box::new(make))) }
    }

    /// The value.
    ///
    /// # Errors
    /// When it cannot be made or read, or the callback asked to stop: it is then tried again when
    /// it is next asked for.
    pub(crate) fn get(&self, progress: Progress<'_>) -> Result<Arc<T>, Error> {
        if let Some(held) = self.held.get() {
            return Ok(Arc::clone(held));
        }
        // Who comes second waits for the first, and makes it not again.
        let mut make = self.make.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(held) = self.held.get() {
            return Ok(Arc::clone(held));
        }
        let made = make.as_ref().map_or(Err(Error::NoFolder), |make| make(progress))?;
        let value = Arc::clone(self.held.get_or_init(|| Arc::new(made)));
        *make = None;
        Ok(value)
    }

    /// The value if it is in memory.
    pub(crate) fn peek(&self) -> Option<&Arc<T>> {
        self.held.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn a_value_is_made_once_and_what_it_came_from_let_go() {
        let (source, count) = (Arc::new(7), Arc::new(AtomicUsize::new(0)));
        let (held, counted) = (Arc::clone(&source), Arc::clone(&count));
        let lazy = Lazy::made(move |_| match counted.fetch_add(1, Ordering::SeqCst) {
            0 => Err(Error::Stopped),
            _ => Ok(*held),
        });
        assert!(lazy.get(Progress::none()).is_err() && lazy.peek().is_none());
        assert_eq!(Arc::strong_count(&source), 2);
        assert_eq!(*lazy.get(Progress::none()).unwrap(), 7);
        assert_eq!(*lazy.get(Progress::none()).unwrap(), 7);
        assert_eq!((count.load(Ordering::SeqCst), Arc::strong_count(&source)), (2, 1));
    }
}
