// Faces of a Wavefront mesh (.obj) as areas: what is asked of the surfaces of an L3D file.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/lightfield/geometry.h"

namespace luxfield::formats {

// Areas of a group's faces up to and with each: of faces first to last, the difference.
struct FaceGroup {
  std::vector<double> area_up_to{0};
  std::vector<lightfield::Vec3> normal_up_to{{}};  // of area times unit normal

  std::size_t faces() const { return area_up_to.size() - 1; }
};

// Groups begin at lines `g` and `o`; those without faces are none. A face is a polygon whose area
// is that of its fan, half the length of
//
//   sum (p_k - p_0) x (p_(k+1) - p_0)
//
// Units are the file's, faces look to where their vertices are counterclockwise. Throws InputError
// naming `file` and line for numbers that are none and vertices that are not there.
std::vector<FaceGroup> ParseObjFaces(std::string_view text, const std::string& file);

}  // namespace luxfield::formats
