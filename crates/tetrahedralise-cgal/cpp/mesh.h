// The C++ side of src/bridge.rs.
#pragma once
#include "rust/cxx.h"

namespace supine_cgal {

struct Request;
struct Raw;
struct Places;

/// Meshes the places labelled 0 inside the request's sphere. `rims`: coordinates of all points of the
/// curves that become edges; `lengths`: the number of points of each curve.
/// Throws what `Places::label` throws.
Raw mesh(const Places &places, const Request &request, rust::Slice<const double> rims,
         rust::Slice<const size_t> lengths);

} // namespace supine_cgal
