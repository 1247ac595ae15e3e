//! Finite elements: a neo-Hookean breast under gravity.
