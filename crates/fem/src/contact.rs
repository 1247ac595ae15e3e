//! What happens where tissue meets an applicator.

/// How tissue is held at the surface of an applicator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// Tied: all nodes on or inside the applicator follow its pose.
    #[default]
    Tied,
    /// Frictionless sliding. Tetrahedra whose nodes all lie on or inside the applicator are its cavity: they
    /// bear and weigh nothing, and nodes of no other tetrahedron follow the pose. The other nodes on or inside
    /// the applicator keep their distance from its surface, and are free along it.
    ///
    /// The tissue is held to the surface in pressure and in tension, as a purse-string suture does; it does
    /// not lift off.
    Frictionless,
}
