// The bound of basis_truncation.h against random lamps; rows of `bench budget` (bench_budget.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace luxfield::study {

constexpr const char* kBasisSource = "basis";

// Lamps are sums of 4 to 8 Gaussian spots on F, standard deviation a quarter to one spacing, even
// over I. What 7 x 7 filters make of them comes from the simulated lab's own quadrature, or of dual
// pairs (`quadratic`, a = 1/2) from exact integrals of the dual function: no propagation, no Gram
// function.
nlohmann::json TruncationRows(const std::filesystem::path& folder, int lamps, std::uint64_t seed,
                              bool dual);

}  // namespace luxfield::study
