//! File formats beside DICOM: NRRD, NIfTI, VTU, markups, point lists.
