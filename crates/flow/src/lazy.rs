//! A large part of a result that is read from the folder only when somebody looks at it.

use crate::Error;
use std::sync::{Arc, OnceLock};

/// A value that is held, or that can be read.
pub(crate) struct Lazy<T> {
    held: OnceLock<Arc<T>>,
    read: Option<Box<dyn Fn() -> Result<T, Error> + Send + Sync>>,
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
        Self { held: OnceLock::from(value), read: None }
    }

    /// A value that is read on first use.
    pub(crate) fn read(read: impl Fn() -> Result<T, Error> + Send + Sync + 'static) -> Self {
        Self { held: OnceLock::new(), read: Some(Box::new(read)) }
    }

    /// The value.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn get(&self) -> Result<Arc<T>, Error> {
        if let Some(held) = self.held.get() {
            return Ok(Arc::clone(held));
        }
        let read = self.read.as_ref().map_or(Err(Error::NoFolder), |read| read())?;
        Ok(Arc::clone(self.held.get_or_init(|| Arc::new(read))))
    }

    /// The value if it is in memory.
    pub(crate) fn peek(&self) -> Option<&T> {
        self.held.get().map(Arc::as_ref)
    }
}
