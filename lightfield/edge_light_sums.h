// FindEdgeLight (edge_light.h) of measurements that come in bands of rows.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "luxfield/lightfield/edge_light.h"

namespace luxfield::lightfield {

// To the bit that of all rows, whatever the bands.
class EdgeLightSums {
 public:
  void Add(std::span<const Measurements> rows);  // from the top
  EdgeLight Find() const;

 private:
  LuminaireGeometry geometry_;  // of the last rows
  std::size_t measurements_ = 0;
  std::vector<double> light_, variance_;  // of each position
};

}  // namespace luxfield::lightfield
