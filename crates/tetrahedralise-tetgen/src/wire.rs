//! What goes through the pipes: numbers in little-endian order, lists with their length before
//! them.

use supine_mesh::{BoundaryFace, BoundaryTag, MeshError, TetMesh};
use supine_space::Point;

/// A surface to be filled.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Request {
    /// Three coordinates each.
    pub points: Vec<f64>,
    /// Three points each.
    pub faces: Vec<u32>,
    /// One for each face.
    pub tags: Vec<u8>,
    /// How TetGen is to do it.
    pub switches: String,
}

/// A mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Answer {
    /// Three coordinates each.
    pub points: Vec<f64>,
    /// Four points each.
    pub tets: Vec<u32>,
    /// Three points each.
    pub faces: Vec<u32>,
    /// One for each face.
    pub tags: Vec<u8>,
}

fn put(
    bytes: &mut Vec<u8>,
    count: usize,
    items: impl Iterator<Item = impl IntoIterator<Item = u8>>,
) {
    bytes.extend((count as u64).to_le_bytes());
    bytes.extend(items.flatten());
}

/// The items of a list that begins at the front of `bytes`, which then begin behind it.
fn take<const N: usize, T>(bytes: &mut &[u8], item: fn([u8; N]) -> T) -> Option<Vec<T>> {
    let (count, rest) = bytes.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*count)).ok()?.checked_mul(N)?;
    let (list, rest) = rest.split_at_checked(length)?;
    *bytes = rest;
    Some(list.as_chunks::<N>().0.iter().map(|chunk| item(*chunk)).collect())
}

impl Request {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.points.len(), self.points.iter().map(|x| x.to_le_bytes()));
        put(&mut bytes, self.faces.len(), self.faces.iter().map(|n| n.to_le_bytes()));
        put(&mut bytes, self.tags.len(), self.tags.iter().map(|t| [*t]));
        put(&mut bytes, self.switches.len(), self.switches.bytes().map(|b| [b]));
        bytes
    }

    /// `None` when the bytes are no request.
    pub(crate) fn read(mut bytes: &[u8]) -> Option<Self> {
        let bytes = &mut bytes;
        let request = Self {
            points: take(bytes, f64::from_le_bytes)?,
            faces: take(bytes, u32::from_le_bytes)?,
            tags: take(bytes, |[b]| b)?,
            switches: String::from_utf8(take(bytes, |[b]| b)?).ok()?,
        };
        (bytes.is_empty() && request.check()).then_some(request)
    }

    /// Whether the lists fit each other.
    fn check(&self) -> bool {
        let points = self.points.len() / 3;
        self.points.len() == 3 * points
            && self.faces.len() == 3 * self.tags.len()
            && self.faces.iter().all(|&v| (v as usize) < points)
            && self.points.iter().all(|x| x.is_finite())
            && i32::try_from(self.faces.len()).is_ok()
    }
}

impl Answer {
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        put(&mut bytes, self.points.len(), self.points.iter().map(|x| x.to_le_bytes()));
        put(&mut bytes, self.tets.len(), self.tets.iter().map(|n| n.to_le_bytes()));
        put(&mut bytes, self.faces.len(), self.faces.iter().map(|n| n.to_le_bytes()));
        put(&mut bytes, self.tags.len(), self.tags.iter().map(|t| [*t]));
        bytes
    }

    /// `None` when the bytes are no answer.
    pub(crate) fn read(mut bytes: &[u8]) -> Option<Self> {
        let bytes = &mut bytes;
        let answer = Self {
            points: take(bytes, f64::from_le_bytes)?,
            tets: take(bytes, u32::from_le_bytes)?,
            faces: take(bytes, u32::from_le_bytes)?,
            tags: take(bytes, |[b]| b)?,
        };
        bytes.is_empty().then_some(answer)
    }

    /// The mesh, its tetrahedra turned to positive volume and without points that none uses.
    pub(crate) fn mesh(&self) -> Result<TetMesh, MeshError> {
        let given: Vec<Point> = self.points.chunks_exact(3).map(Point::from_slice).collect();
        let mut number = vec![u32::MAX; given.len()];
        let mut points = Vec::new();
        let mut place = |v: u32| match number.get_mut(v as usize) {
            Some(n) if *n == u32::MAX => {
                points.push(given[v as usize]);
                *n = points.len() as u32 - 1;
                *n
            }
            Some(n) => *n,
            None => u32::MAX,
        };
        let turned = |t: &[u32]| {
            let at = |c: usize| given.get(t[c] as usize).copied().unwrap_or_default();
            let (a, b, c, d) = (at(0), at(1), at(2), at(3));
            let positive = (b - a).dot(&(c - a).cross(&(d - a))) >= 0.0;
            if positive { [t[0], t[1], t[2], t[3]] } else { [t[0], t[1], t[3], t[2]] }
        };
        let tets = self.tets.chunks_exact(4).map(|t| turned(t).map(&mut place)).collect();
        let faces = self.faces.chunks_exact(3).zip(&self.tags).filter_map(|(f, &tag)| {
            let tag = BoundaryTag::from_number(tag)?;
            Some(BoundaryFace { points: [f[0], f[1], f[2]].map(&mut place), tag })
        });
        let faces = faces.collect();
        TetMesh::new(points, tets, faces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request() -> Request {
        Request {
            points: (0..12).map(f64::from).collect(),
            faces: vec![0, 1, 2, 1, 2, 3],
            tags: vec![1, 3],
            switches: "pq".into(),
        }
    }

    #[test]
    fn what_is_sent_is_received() {
        let sent = request();
        assert_eq!(Request::read(&sent.bytes()), Some(sent));
        let Request { points, faces, tags, .. } = request();
        let sent = Answer { points, tets: vec![0, 1, 2, 3], faces, tags };
        assert_eq!(Answer::read(&sent.bytes()), Some(sent));
    }

    #[test]
    fn what_is_no_request_is_refused() {
        let good = request().bytes();
        assert_eq!(Request::read(&good[..good.len() - 1]), None, "cut short");
        assert_eq!(Request::read(&[&good[..], &[0]].concat()), None, "too long");
        assert_eq!(Request::read(&[0xff; 40]), None, "a length beyond all memory");
        let wrong = Request { faces: vec![0, 1, 2, 1, 2, 4], ..request() };
        assert_eq!(Request::read(&wrong.bytes()), None, "a point that is not there");
        let wrong = Request { tags: vec![1], ..request() };
        assert_eq!(Request::read(&wrong.bytes()), None, "a face without a tag");
    }

    #[test]
    fn a_tetrahedron_is_turned_and_spare_points_are_left_out() {
        let mut points = vec![9.0; 3];
        points.extend([0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
        let faces = vec![2, 3, 4, 1, 3, 4, 1, 2, 4, 1, 2, 3];
        let answer = Answer { points, tets: vec![1, 3, 2, 4], faces, tags: vec![1, 2, 3, 3] };
        let mesh = answer.mesh().unwrap();
        assert_eq!((mesh.points().len(), mesh.tets().len()), (4, 1));
        assert!((mesh.total_volume() - 1.0 / 6.0).abs() < 1e-12);
        let broken = Answer { tets: vec![1, 2, 3, 7], ..answer };
        assert!(broken.mesh().is_err(), "a point that is not there");
    }
}
