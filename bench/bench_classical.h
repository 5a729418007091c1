// `luxfield bench classical`: a measured lamp as a light field against the classical lights that its
// photometric file makes (docs/theory.md 15).
//
// The light field's far field is taken as an LM-63 file would have it (formats/far_field.h). A point,
// a line along the opening's longer side and an area of its opening shine by it on a plane across
// the lamp's axis, d away, over what is lit by a tenth of the peak intensity or more:
//
//   error^2 = sum (E_model - E)^2 / sum E^2
//
// as they are, and with half of the plane in the shadow of an edge half way, along y through the
// opening's middle. E without the edge is the closed form; shares of visible light and the models'
// integrals are midpoint sums, of whose cells the edge cuts off a part.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchClassicalOptions {
  std::vector<std::filesystem::path> lamps{"out/lamps/bike.lf.exr", "out/lamps/car1.lf.exr",
                                           "out/lamps/car2.lf.exr"};
  double nearest_m = 0.1, farthest_m = 20;
  int per_decade = 6;  // distances
  int receivers = 24;  // along each side of the plane
  std::vector<double> errors{0.01, 0.02, 0.05, 0.1};
};

// The error at a distance.
struct ErrorAt {
  double distance_m = 0, error = 0;
};

// From where on a curve of ascending distances stays at or below an error, by a straight line in
// logarithms between the last one above it and the next; none if the last one is above it.
std::optional<double> GoodFrom(std::span<const ErrorAt> curve, double error);

// {"rows": [{"lamp", "model", "distance_m", "illuminance_error", "edge_error"}, ...],
//  "good_from": [{"lamp", "model", "error", "illuminance_m", "edge_m"}, ...]}, lengths null where
// the error is not kept at the farthest distance. Throws InputError for light fields that cannot be
// read, of several planes, or without light, and for distances that make no sense.
nlohmann::json BenchClassical(const BenchClassicalOptions& options);

}  // namespace luxfield::bench
