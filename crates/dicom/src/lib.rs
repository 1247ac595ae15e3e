//! DICOM CT series in and out, inspection and verification of exports.
