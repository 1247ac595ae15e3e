//! CT, mesh and displacement to the deformed CT.
