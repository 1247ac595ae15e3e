//! The same for linear and for quadratic elements.

/// One of two.
pub(crate) enum Either<L, Q> {
    Linear(L),
    Quadratic(Q),
}

/// What the expression gives for either.
macro_rules! either {
    ($either:expr, $name:pat => $value:expr) => {
        match $either {
            $crate::either::Either::Linear($name) => $value,
            $crate::either::Either::Quadratic($name) => $value,
        }
    };
}

pub(crate) use either;
