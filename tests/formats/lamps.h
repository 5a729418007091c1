// Far fields for tests of photometric files.
#pragma once

#include <cmath>
#include <random>

#include "luxfield/formats/photometric.h"

namespace luxfield::formats {

inline std::vector<double> Steps(double from, double to, double step) {
  std::vector<double> list;
  for (int k = 0; from + k * step <= to + 1e-9; ++k) list.push_back(from + k * step);
  return list;
}

// Random intensities of 10 to 1000 cd without any symmetry; at the poles of type C one value.
inline Photometry RandomLamp(PhotometryType type, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> cd(10, 1000);
  Photometry p;
  p.format = "test";
  p.type = type;
  p.absolute = true;
  switch (type) {
    case PhotometryType::kC:
      p.planes_deg = Steps(0, 345, 15);
      p.angles_deg = Steps(0, 180, 5);
      break;
    case PhotometryType::kB:
      p.planes_deg = Steps(-90, 90, 10);
      p.angles_deg = Steps(-90, 90, 5);
      break;
    case PhotometryType::kA:
      p.planes_deg = Steps(-90, 90, 10);
      p.angles_deg = Steps(-90, 90, 5);
      break;
  }
  const double nadir = cd(random), zenith = cd(random);
  for (std::size_t k = 0; k < p.planes_deg.size(); ++k)
    for (std::size_t j = 0; j < p.angles_deg.size(); ++j) {
      const bool first = j == 0, last = j + 1 == p.angles_deg.size();
      const bool pole = type == PhotometryType::kC && (first || last);
      p.intensity_cd.push_back(pole ? (first ? nadir : zenith) : cd(random));
    }
  p.opening = {Opening::Shape::kBox, 0.3, 0.6, 0.05};
  p.keywords = {{"MANUFAC", "Ulm \xC3\xA4"}, {"LUMINAIRE", "L 1"}};
  return p;
}

inline double LargestDifference(const Photometry& a, const Photometry& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.intensity_cd.size(); ++k)
    largest = std::max(largest, std::abs(a.intensity_cd[k] / b.intensity_cd[k] - 1));
  return largest;
}

}  // namespace luxfield::formats
