//! Labels in a sphere to a tagged tetrahedral mesh of an asked size.
