// Environment pictures to cube maps, with their energy.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "luxfield/core/image.h"
#include "luxfield/environment/cube_map.h"
#include "luxfield/environment/environment_layouts.h"

namespace luxfield::environment {

// A texel of the picture stands for constant radiance over the solid angle it covers. A cube texel
// t receives the mean over its own:
//
//   L_t = (1 / dw_t) sum_s Omega_ts (Omega_s / sum_t' Omega_t's) L_s
//
// Omega_ts is the solid angle of the overlap of s and t: the outline of s, as a polygon of great
// circles (environment_layouts.h), clipped against the faces and texels of the cube, in closed form
// and in double. Omega_s is the exact solid angle of s, so that the sum over the cube of L dw
// equals the sum over the picture of L Omega for every channel, whatever the picture: what polygons
// leave out at curved edges is given back to the texel it belongs to. That leaves two roundings to
// float, of weight and of radiance: 2^-23 of the energy at most. A constant comes out constant to
// partition_error().
//
// The weights depend on sizes and layout only: build once, use for every frame of a sequence. They
// take 8 bytes for each overlap, three to four a texel of the finer side; building takes up to 32
// more for a while. Latitude-longitude 1024 x 512 to 6 x 256^2: 1.4 core-seconds to build, 7 ms a
// frame.
class CubeResampler {
 public:
  // Throws InputError if a size is below 1, a disc layout is not square, a cube is not N x 6 N, or
  // the cube has more than 2^31 texels.
  CubeResampler(EnvironmentLayout layout, TexelRegistration registration, int width, int height,
                int face_size);

  // A picture whose pixels show any part of the sphere: outline(row, column, polygon) makes the
  // unit directions around a pixel, less than a hemisphere, in either sense, empty where the pixel
  // shows nothing; it is called from several threads. What the outlines leave uncovered is in
  // coverage().
  using Outline = std::function<void(int row, int column, std::vector<lightfield::Vec3>& polygon)>;
  CubeResampler(int width, int height, int face_size, const Outline& outline);

  // `picture` of 3 channels, or 1 that stands for all three. Throws InputError for another size.
  // Sums in double. Directions that the picture does not show are black.
  CubeMap operator()(const core::Image& picture) const;
  // sum_s weight_ts^2 V_s: the variance of each texel where V is that of pixels independent of each
  // other. Neighbouring texels share pixels: theirs are not.
  CubeMap Variance(const core::Image& variance) const;

  int width() const { return width_; }
  int height() const { return height_; }
  int face_size() const { return face_size_; }
  std::size_t overlap_count() const { return overlaps_.size(); }
  // Exact solid angle of each texel of the picture, sr, row-major: 0 outside of a disc.
  const std::vector<double>& source_solid_angles() const { return source_solid_angles_; }
  // Largest |sum_s weight_ts - 1| over cube texels that the picture covers.
  double partition_error() const { return partition_error_; }
  // sum_s weight_ts: the share of each cube texel that the picture shows.
  const std::vector<float>& coverage() const { return coverage_; }

 private:
  struct Piece {
    std::uint32_t target, source;
    double solid_angle;
  };
  class Clipper;
  bool IsCovered(EnvironmentLayout layout, std::size_t texel) const;
  void Sort(std::vector<std::vector<Piece>>& rows);
  template <typename Weight>
  CubeMap Sum(const core::Image& picture, Weight weight) const;

  struct Overlap {
    std::uint32_t source;
    float weight;
  };

  int width_, height_, face_size_;
  std::vector<double> source_solid_angles_;
  std::vector<std::size_t> first_;  // of each cube texel in overlaps_, and the end
  std::vector<Overlap> overlaps_;
  std::vector<float> coverage_;
  double partition_error_ = 0;
};

// The face size at which the cube's texels are about as large as the picture's: height of a
// cube's face, width / 4 of latitude-longitude and angular map, width / 2 of mirror ball and
// fisheye; at least 1.
int DefaultFaceSize(EnvironmentLayout layout, int width);

}  // namespace luxfield::environment
