#include "luxfield/bench/mean_squares.h"

#include <algorithm>
#include <cmath>

#include "luxfield/core/json.h"

namespace luxfield::bench {

void MeanSquares::Add(const std::string& quantity, double truth, double sigma, double deviation) {
  auto sum = std::find_if(sums_.begin(), sums_.end(),
                          [&](const Sums& s) { return s.quantity == quantity; });
  if (sum == sums_.end()) sum = sums_.insert(sum, Sums{quantity});
  const double square = deviation * deviation;
  ++sum->runs;
  sum->truth += truth * truth;
  sum->sigma += sigma * sigma;
  sum->deviation += square;
  sum->deviation_fourth += square * square;
}

nlohmann::json MeanSquares::Rows() const {
  core::Json rows = core::Json::array();
  for (const Sums& sum : sums_) {
    const double spread =
        sum.deviation_fourth * sum.runs / (sum.deviation * sum.deviation) - 1;  // of the squares
    rows.push_back({{"source", source_},
                    {"quantity", sum.quantity},
                    {"runs", sum.runs},
                    {"value", std::sqrt(sum.truth / sum.runs)},
                    {"predicted", std::sqrt(sum.sigma / sum.runs)},
                    {"observed", std::sqrt(sum.deviation / sum.runs)},
                    {"ratio", std::sqrt(sum.sigma / sum.deviation)},
                    {"error", 0.5 * std::sqrt(spread / sum.runs)},
                    {"share", std::sqrt(sum.deviation / sum.truth)}});
  }
  return rows;
}

}  // namespace luxfield::bench
