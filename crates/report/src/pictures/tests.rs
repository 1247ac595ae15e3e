//! A synthetic torso with a known displacement.
