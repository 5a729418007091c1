// Stated standard deviations against deviations, over an ensemble of lamps; rows of `bench budget`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

class MeanSquares {
 public:
  explicit MeanSquares(std::string source) : source_(std::move(source)) {}

  void Add(const std::string& quantity, double truth, double sigma, double deviation);

  // Root mean squares per quantity as in bench_budget.h; `error` is the standard error of
  // `observed` by the spread of its squares, which are not those of a normal variable.
  nlohmann::json Rows() const;

 private:
  struct Sums {
    std::string quantity;
    int runs = 0;
    double truth = 0, sigma = 0, deviation = 0, deviation_fourth = 0;
  };
  std::string source_;
  std::vector<Sums> sums_;
};

}  // namespace luxfield::bench
