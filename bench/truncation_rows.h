// What basis_truncation.h and coarser_grids.h say against random lamps; rows of `bench budget`
// (bench_budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::bench {

constexpr const char *kBasisSource = "basis", *kEstimatedBasisSource = "basis, estimated";

// Spot lamps from a quarter to one spacing; the quarter is what is stated, or, estimated, nothing.
// What 7 x 7 filters make
// of them comes from the simulated lab's own quadrature, or of dual pairs (`quadratic`, a = 1/2)
// from exact integrals of the dual function: no propagation, no Gram function.
nlohmann::json TruncationRows(const std::filesystem::path& folder, int lamps, std::uint64_t seed,
                              bool dual, bool estimated);

}  // namespace luxfield::bench
