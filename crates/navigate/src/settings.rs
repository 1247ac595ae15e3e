//! What a session is asked for; a recording keeps it.

use crate::follower::Renewal;
use crate::tool::Tool;
use serde::{Deserialize, Serialize};
use supine_fem::Contact;
use supine_flow::LiveMesh;
use supine_mesh::Order;

/// What a session is asked for, but for addresses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Tetrahedra of the mesh.
    pub tetrahedra: usize,
    /// Order of the elements, 1 or 2.
    pub order: u8,
    /// How tissue is held to the applicator.
    pub contact: Holding,
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Radius of the shaft, mm.
    pub shaft_radius_mm: f64,
    /// Length of the shaft from the centre of the sphere, mm.
    pub shaft_mm: f64,
    /// Planned centre of the sphere on the table, LPS, mm. None: beside the tumour on the way in,
    /// or in the middle of the cavity.
    pub at_mm: Option<[f64; 3]>,
    /// Direction from which the shaft comes, LPS. None: from the skin nearest to the tumour.
    pub from: Option<[f64; 3]>,
    /// The tumour is cut out with so much tissue around it, mm. None: it is still there.
    pub cavity_mm: Option<f64>,
    /// When the factor of the stiffness is renewed.
    pub renewal: Renewing,
}

/// How tissue is held to the applicator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Holding {
    /// Frictionless; tissue lifts off.
    Pressing,
    /// Frictionless; tissue is held in tension too, as by a suture.
    Sliding,
    /// Tissue follows the applicator.
    #[default]
    Tied,
}

/// When the factor of the stiffness is renewed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Renewing {
    /// In another thread: quick.
    #[default]
    Beside,
    /// Between two steps: a replay gives the same bits.
    Between,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tetrahedra: 1581,
            order: 2,
            contact: Holding::default(),
            radius_mm: 20.0,
            shaft_radius_mm: 6.0,
            shaft_mm: 200.0,
            at_mm: None,
            from: None,
            cavity_mm: None,
            renewal: Renewing::default(),
        }
    }
}

impl Settings {
    /// The applicator.
    pub fn tool(&self) -> Tool {
        let Self { radius_mm, shaft_radius_mm, shaft_mm, .. } = *self;
        Tool { radius_mm, shaft_radius_mm, shaft_mm }
    }

    /// The mesh.
    pub fn mesh(&self) -> LiveMesh {
        let order = if self.order == 1 { Order::Linear } else { Order::Quadratic };
        LiveMesh { tetrahedra: self.tetrahedra, order }
    }

    /// The contact.
    pub fn contact(&self) -> Contact {
        match self.contact {
            Holding::Pressing => Contact::Unilateral,
            Holding::Sliding => Contact::Frictionless,
            Holding::Tied => Contact::Tied,
        }
    }

    /// The renewal.
    pub fn renewal(&self) -> Renewal {
        match self.renewal {
            Renewing::Beside => Renewal::Beside,
            Renewing::Between => Renewal::Between,
        }
    }
}
