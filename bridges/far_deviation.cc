#include "luxfield/bridges/far_deviation.h"

#include <algorithm>
#include <cmath>

#include "luxfield/formats/far_field.h"

namespace luxfield::bridges {

using lightfield::Vec3;

std::vector<FarDeviation> DeviationsOf(std::span<const lightfield::PosedLightField> fields,
                                       const std::function<double(Vec3 p, Vec3 n)>& illuminance) {
  std::vector<Vec3> directions;
  std::vector<double> intensities;
  for (int gamma = 1; gamma < 180; gamma += 4)
    for (int c = 0; c < 360; c += 30) {
      directions.push_back(formats::Direction(formats::PhotometryType::kC, c, gamma));
      intensities.push_back(formats::IntensityOf(fields, directions.back(), {}));
    }
  const double peak = *std::max_element(intensities.begin(), intensities.end());
  std::vector<FarDeviation> deviations;
  for (const double distance : {0.1, 0.3, 1.0, 3.0, 10.0}) {
    if (distance <= formats::ReachOfSupports(fields)) continue;
    double largest = 0, brightest = 0;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      if (!(intensities[k] > 0.01 * peak)) continue;
      const Vec3 d = directions[k];
      const double exact = formats::IntensityOf(fields, d, distance) / (distance * distance);
      brightest = std::max(brightest, exact);
      largest = std::max(largest, std::abs(illuminance(distance * d, -1 * d) - exact));
    }
    if (brightest > 0) deviations.push_back({distance, largest / brightest});
  }
  return deviations;
}

}  // namespace luxfield::bridges
