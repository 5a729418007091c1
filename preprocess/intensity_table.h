// A luminaire's light by direction, coarsely: what it sends to receivers that are far against it.
//
//   I(t) = J(t) / cos^3(theta),   J(t) = delta^2 integral over F of |E|(u, u + delta t) du,
//   t = direction_xy / direction_z,   1 / cos^2 = 1 + |t|^2
//
// with |E| = sum |C_m| Phi_m of the luminance, as preprocess/summed_area.h weighs it (docs/theory.md
// 2, lightfield::FarFieldIntensity). The table holds the means of J over bins of t. A texel's light
// through an image is taken as even through each quarter of a cell of Phi_m, which shares it out by
// its integrals: the table is 0 only where no light goes.
//
// Of receivers at any distance, who see each point u of F under a t of its own,
//
//   delta^2 integral over F of |E|(u, u + delta t(u)) du <= delta^2 sum_m integral Phi_m du max |C_m|
//
// the maximum over the texels that are seen through the support of image m; for all t in a bin and
// its neighbours the table holds that bound too.
#pragma once

#include <string>
#include <vector>

#include "luxfield/lightfield/light_field.h"

namespace luxfield::preprocess {

struct IntensityTable {
  int columns = 0, rows = 0;  // bins along t_x and t_y, at most kMostBins
  lightfield::Vec2 low, bin;  // the corner of least tangents, and the sides of a bin
  // sums[row * (columns + 1) + column] is the integral of J over the bins of lesser rows and
  // columns; (rows + 1) x (columns + 1) values.
  std::vector<double> sums;
  std::vector<float> bounds;  // [row * columns + column], of the bin and its eight neighbours
  float largest_bound = 0;    // whatever t is

  static constexpr int kMostBins = 128;

  double Flux() const { return sums.back(); }  // integral of J over all t: the luminaire's flux
  double BinFlux(int row, int column) const;
};

// Images in parallel; the result does not depend on threads. `name` (the file) is for messages.
// Throws InputError as BuildTables does.
IntensityTable BuildIntensityTable(const lightfield::LightField& field, const std::string& name);

}  // namespace luxfield::preprocess
