//! NIfTI-1 in one file (`.nii`, `.nii.gz`).
//!
//! The header is read by the `nifti` crate; the samples are decoded here, since its volumes are
//! allocated on the header's word. Frame: RAS+, so x and y change sign towards LPS.
//! Format: <https://nifti.nimh.nih.gov/nifti-1>, `nifti1.h`.

mod affine;
mod names;
mod read;
mod write;

pub(crate) use read::{is_nifti, parse};
pub(crate) use write::{write, write_displacements};

#[cfg(test)]
mod tests;
