//! Places that the slice viewer can be brought to.

use crate::Summary;

/// A place with its name; the template escapes it.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) name: String,
    /// As [`at`] writes it.
    pub(crate) at: String,
}

/// A position (LPS, mm) as the viewer reads it: `40.0,-30.0,10.0`.
pub(crate) fn at(p: [f64; 3]) -> String {
    p.map(|x| format!("{x:.1}")).join(",")
}

/// The tumour, the nipple, and the points that were carried along.
pub(crate) fn places(s: &Summary) -> Vec<Place> {
    let place = |name: &str, p| Place { name: name.into(), at: at(p) };
    let mut places = Vec::new();
    if let Some(tumour) = &s.tumour {
        places.push(place("tumour in the CT", tumour.before_mm));
        places.push(place("tumour on the operating table", tumour.after_mm));
    }
    places.extend(s.nipple.iter().map(|nipple| place("nipple", nipple.before_mm)));
    places.extend(s.points.iter().map(|point| place(&point.name, point.before_mm)));
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::example;

    #[test]
    fn what_the_case_names_can_be_looked_at() {
        let places = places(&example());
        let told: Vec<_> = places.iter().map(|p| (p.name.as_str(), p.at.as_str())).collect();
        assert_eq!(told[0], ("tumour in the CT", "40.0,-30.0,10.0"));
        assert_eq!(told[3], ("clip <1>", "30.0,-25.0,0.0"));
    }
}
