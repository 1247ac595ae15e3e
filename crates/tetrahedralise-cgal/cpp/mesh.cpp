// CGAL's Mesh_3 on a domain that is known by a label at each point, with curves to be kept.
#include "mesh.h"
#include "supine-tetrahedralise-cgal/src/bridge.rs.h"
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_domain_with_polyline_features_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>
#include <algorithm>
#include <map>
#include <vector>

namespace supine_cgal {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Labelled = CGAL::Labeled_mesh_domain_3<Kernel>;
using Domain = CGAL::Mesh_domain_with_polyline_features_3<Labelled>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index,
                                                        Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace parameters = CGAL::parameters;

/// Labels in CGAL's eyes: the inside is above all others, so that the lower one of a pair is the tag.
constexpr int INSIDE = 9;

Raw raw(const Complex &complex) {
  Raw raw;
  std::map<Triangulation::Vertex_handle, uint32_t> number;
  auto vertex = [&](Triangulation::Vertex_handle v) {
    auto [at, fresh] = number.emplace(v, static_cast<uint32_t>(number.size()));
    if (fresh) {
      const auto &p = v->point();
      raw.points.push_back(CGAL::to_double(p.x()));
      raw.points.push_back(CGAL::to_double(p.y()));
      raw.points.push_back(CGAL::to_double(p.z()));
    }
    return at->second;
  };
  for (auto c = complex.cells_in_complex_begin(); c != complex.cells_in_complex_end(); ++c)
    for (int i = 0; i < 4; ++i)
      raw.tets.push_back(vertex(c->vertex(i)));
  for (auto f = complex.facets_in_complex_begin(); f != complex.facets_in_complex_end(); ++f) {
    for (int i = 1; i < 4; ++i)
      raw.faces.push_back(vertex(f->first->vertex((f->second + i) % 4)));
    const auto pair = complex.surface_patch_index(*f);
    raw.tags.push_back(static_cast<uint8_t>(std::min(pair.first, pair.second)));
  }
  return raw;
}

} // namespace

Raw mesh(const Places &places, const Request &request, rust::Slice<const double> rims,
         rust::Slice<const size_t> lengths) {
  // Its own random numbers from a stated seed: the same mesh each time.
  CGAL::Random random(0);
  CGAL::get_default_random() = CGAL::Random(0);
  const auto label = [&places](const Point &p) {
    const int beyond = places.label(p.x(), p.y(), p.z());
    return beyond == 0 ? INSIDE : beyond;
  };
  const auto outside = [](int label) { return label != INSIDE; };
  const Point centre(request.centre[0], request.centre[1], request.centre[2]);
  const double radius = 1.1 * request.radius;
  // CGAL's bound is a share of half the diagonal of the sphere's box.
  const double bound = request.precision / (radius * std::sqrt(3.0));
  Domain domain(parameters::function = label,
                parameters::bounding_object = Kernel::Sphere_3(centre, radius * radius),
                parameters::relative_error_bound = bound, parameters::p_rng = &random,
                parameters::null_subdomain_index = outside);
  std::vector<std::vector<Point>> curves;
  const double *at = rims.data();
  for (size_t length : lengths) {
    std::vector<Point> curve;
    for (size_t n = 0; n < length; ++n, at += 3)
      curve.emplace_back(at[0], at[1], at[2]);
    curves.push_back(std::move(curve));
  }
  domain.add_features(curves.begin(), curves.end());
  Criteria criteria(parameters::edge_size = request.edge, parameters::facet_angle = 25.0,
                    parameters::facet_size = request.edge,
                    parameters::facet_distance = request.sag * request.edge,
                    parameters::cell_radius_edge_ratio = 2.0, parameters::cell_size = request.edge);
  Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria, parameters::manifold(),
                                               parameters::no_perturb(), parameters::no_exude());
  if (request.optimise) {
    CGAL::perturb_mesh_3(complex, domain, parameters::time_limit = request.patience);
    CGAL::exude_mesh_3(complex, parameters::time_limit = request.patience);
  }
  return raw(complex);
}

} // namespace supine_cgal
