//! What happens where tissue meets an applicator.

use crate::rigid::RigidBody;

/// How tissue is held at the surface of an applicator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contact {
    /// Tied: all nodes on or inside the applicator follow its pose.
    #[default]
    Tied,
    /// Frictionless sliding. Tetrahedra whose nodes all lie on or inside the applicator are its
    /// cavity: they bear and weigh nothing, and nodes of no other tetrahedron follow the pose. The
    /// other nodes on or inside the applicator keep their distance from its surface, and are free
    /// along it.
    ///
    /// The tissue is held to the surface in pressure and in tension, as a purse-string suture does;
    /// it does not lift off.
    Frictionless,
    /// Frictionless, with pressure alone: nodes of the tissue's free surface (skin, cavity wall and
    /// the rest of its boundary, without those that are held) do not go into the applicator, slide
    /// on it and lift off it. A sphere and its shaft are two surfaces, and a node may touch both.
    /// Nothing is coupled: an applicator that touches nothing is one, too.
    ///
    /// Nodes are kept out, not the faces between them: a body that is thin before the tetrahedra
    /// gets between their nodes.
    Unilateral,
}

/// What is put into the tissue, and how.
#[derive(Clone, Copy)]
pub struct Insertion<'a> {
    /// The applicator, placed in the frame of the CT where the target's gravity has the tissue.
    pub rigid: &'a dyn RigidBody,
    /// How it holds the tissue.
    pub contact: Contact,
    /// The cavity that was cut before, in the CT shape (LPS, mm), for [`Contact::Unilateral`]:
    /// tetrahedra whose middle lies in it, or a node more than 1 mm deep, bear and weigh nothing,
    /// nor does what then hangs on nothing. The tissue settles again without them. Numbers of nodes
    /// and tetrahedra stay; nodes of no other tetrahedron stay where they are and mean nothing.
    ///
    /// Without one nothing is taken out, unless the applicator as it is put in holds nodes that are
    /// not on the tissue's surface: tetrahedra whose nodes all lie in it are the cavity then.
    pub cavity: Option<&'a dyn RigidBody>,
}

impl<'a> Insertion<'a> {
    /// An applicator for which nothing was cut before.
    pub fn new(rigid: &'a dyn RigidBody, contact: Contact) -> Self {
        Self { rigid, contact, cavity: None }
    }
}

impl std::fmt::Debug for Insertion<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Insertion")
            .field("centre", &self.rigid.centre())
            .field("contact", &self.contact)
            .field("cavity", &self.cavity.map(RigidBody::centre))
            .finish()
    }
}
