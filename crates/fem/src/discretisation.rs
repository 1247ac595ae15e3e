//! What depends on neither the moduli of a body nor its load.

use crate::curved::Straightening;
use crate::element::{Elements, element_nodes};
use crate::fibre_directions::wall_to_skin;
use crate::pattern::{Pattern, Storage};
use crate::skin::Skin;
use crate::sliding_wall::{SlidingWall, placed};
use crate::{Error, Job, support};
use std::sync::{Arc, OnceLock};
use supine_space::Vector;

/// A body in the CT.
pub(crate) struct Discretisation<const N: usize, const Q: usize> {
    /// Positions of its nodes, mm.
    pub(crate) positions: Vec<Vector>,
    /// The chest wall on which the tissue slides, if it does, and the skin, if it is a membrane.
    pub(crate) wall: Option<SlidingWall<N>>,
    pub(crate) skin: Option<Skin<N>>,
    /// Which of them are held.
    pub(crate) held: Vec<bool>,
    /// The elements there.
    pub(crate) elements: Arc<Elements<N, Q>>,
    /// Directions of fibres at the quadrature points, if the tissue has fibres.
    pub(crate) fibres: Option<Vec<[Vector; Q]>>,
    /// Pattern of the stiffness.
    pub(crate) lower: Arc<Pattern>,
    /// The same with all entries.
    full: OnceLock<Pattern>,
    /// To the nodes of the mesh of straight elements.
    pub(crate) straight: Straightening<N>,
}

impl<const N: usize, const Q: usize> Discretisation<N, Q> {
    /// The body of `job`, with its cut held or not.
    ///
    /// # Errors
    /// When nothing holds the tissue, nothing is free, or a tetrahedron is flat.
    pub(crate) fn new(job: &Job<'_>) -> Result<Self, Error> {
        let positions = job.positions::<N>();
        let sliding = job.params.sliding.map(|area| placed(area, &job.body.mesh));
        let boundary = (job.params.cut, sliding.as_ref());
        let held = support::held_nodes(&job.body.mesh, job.edges, positions.len(), boundary);
        support::check_support(&job.body.mesh, &held, boundary)?;
        let elements = Elements::new(&positions, element_nodes(&job.body.mesh, job.edges))
            .map_err(Error::flat)?;
        let (mesh, nodes) = (&job.body.mesh, &elements.nodes);
        let slides = |area| SlidingWall::new(mesh, nodes, &positions, &held, area);
        let wall = sliding.as_ref().map(slides);
        let skin = job.params.skin.as_ref();
        let skin = skin.map(|membrane| Skin::new(mesh, nodes, &positions, membrane));
        let lower = Arc::new(Pattern::new(&elements.nodes, &held, Storage::Lower));
        let straight = job.straightening::<N>(&positions);
        let elements = Arc::new(elements);
        let fibred = job.body.tissue.fibres > 0.0;
        let fibres = fibred.then(|| match job.body.tissue.fibre_direction {
            Some(along) => vec![[Vector::from(along).normalize(); Q]; elements.nodes.len()],
            None => wall_to_skin(&job.body.mesh),
        });
        Ok(Self {
            positions,
            wall,
            skin,
            held,
            elements,
            fibres,
            lower,
            full: OnceLock::new(),
            straight,
        })
    }

    /// The pattern of the unsymmetric derivative, found when first asked for.
    pub(crate) fn full(&self) -> &Pattern {
        self.full.get_or_init(|| Pattern::new(&self.elements.nodes, &self.held, Storage::Full))
    }

    /// Zero at every node.
    pub(crate) fn zero(&self) -> Vec<Vector> {
        vec![Vector::zeros(); self.held.len()]
    }

    /// Not enough memory for its factor.
    pub(crate) fn memory(&self) -> Error {
        Error::Memory { unknowns: self.lower.unknowns() }
    }
}
