// The C++ side of src/bridge.rs.
#pragma once
#include "rust/cxx.h"

namespace supine_tetgen {

struct Raw;

/// Fills the closed surface of `faces` (three points each, one tag each) by TetGen with these
/// switches. Throws std::runtime_error when TetGen gives up; it may also end the process.
Raw fill(rust::Slice<const double> points, rust::Slice<const uint32_t> faces,
         rust::Slice<const uint8_t> tags, rust::Str switches);

} // namespace supine_tetgen
