//! Whether to go on with what takes long.

use crate::error::Error;

/// Whether to go on; asked again and again while something is waited for.
pub(crate) type GoOn<'a> = &'a (dyn Fn() -> Result<(), Error> + Sync);
