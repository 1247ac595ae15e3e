// TetGen on a closed surface of tagged triangles.
#include "fill.h"
#include "supine-tetrahedralise-tetgen/src/bridge.rs.h"
#include <cstdio>
#include <stdexcept>
#include <string>
#include <tetgen.h>
#include <unistd.h>

namespace supine_tetgen {
namespace {

/// What TetGen prints goes to stderr while this lives: stdout carries the answer.
class Quiet {
public:
  Quiet() : kept(dup(STDOUT_FILENO)) {
    std::fflush(stdout);
    dup2(STDERR_FILENO, STDOUT_FILENO);
  }
  ~Quiet() {
    std::fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    close(kept);
  }
  Quiet(const Quiet &) = delete;
  Quiet &operator=(const Quiet &) = delete;

private:
  int kept;
};

const char *reason(int code) {
  switch (code) {
  case 1:
    return "out of memory";
  case 2:
    return "an error within TetGen";
  case 3:
    return "the surface crosses itself";
  case 4:
    return "the surface has a feature too small for it";
  case 5:
    return "two faces of the surface lie too close together";
  default:
    return "it cannot use the surface";
  }
}

} // namespace

Raw fill(rust::Slice<const double> points, rust::Slice<const uint32_t> faces,
         rust::Slice<const uint8_t> tags, rust::Str switches) {
  tetgenio in, out;
  in.firstnumber = 0;
  // TetGen's destructors free what is allocated here.
  in.numberofpoints = static_cast<int>(points.size() / 3);
  in.pointlist = new REAL[points.size()];
  std::copy(points.begin(), points.end(), in.pointlist);
  in.numberoffacets = static_cast<int>(faces.size() / 3);
  in.facetlist = new tetgenio::facet[in.numberoffacets];
  in.facetmarkerlist = new int[in.numberoffacets];
  for (int n = 0; n < in.numberoffacets; ++n) {
    tetgenio::facet &facet = in.facetlist[n];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::polygon &polygon = facet.polygonlist[0];
    tetgenio::init(&polygon);
    polygon.numberofvertices = 3;
    polygon.vertexlist = new int[3];
    for (int i = 0; i < 3; ++i)
      polygon.vertexlist[i] = static_cast<int>(faces[3 * n + i]);
    in.facetmarkerlist[n] = tags[n];
  }
  std::string text(switches);
  try {
    Quiet quiet;
    tetrahedralize(text.data(), &in, &out);
  } catch (int code) {
    throw std::runtime_error(reason(code));
  }
  Raw raw;
  for (int n = 0; n < 3 * out.numberofpoints; ++n)
    raw.points.push_back(out.pointlist[n]);
  for (int n = 0; n < out.numberoftetrahedra; ++n)
    for (int i = 0; i < 4; ++i)
      raw.tets.push_back(
          static_cast<uint32_t>(out.tetrahedronlist[n * out.numberofcorners + i]));
  for (int n = 0; n < out.numberoftrifaces; ++n) {
    if (out.trifacemarkerlist[n] <= 0)
      continue;
    for (int i = 0; i < 3; ++i)
      raw.faces.push_back(static_cast<uint32_t>(out.trifacelist[3 * n + i]));
    raw.tags.push_back(static_cast<uint8_t>(out.trifacemarkerlist[n]));
  }
  return raw;
}

} // namespace supine_tetgen
