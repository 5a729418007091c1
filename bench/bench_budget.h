// `luxfield bench budget`: is the error budget what many simulated labs show?
//
// The judge shares nothing with the propagation: every run simulates a lab, captures it, merges,
// reconstructs and evaluates the closed forms. Sources are judged alone and all together, each over
// `runs` labs with their own noise, patterns and fixed errors; deviations are from the same lab
// without errors (no noise, no ADC), so a bias counts as an error; those of an image shift are from
// the same session, with all other errors, registered rightly. The prediction is the root mean
// square of the budgets of `budgets` further labs with every source on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchBudgetOptions {
  std::filesystem::path folder;  // scratch
  int runs = 400;
  int budgets = 50;
  std::uint64_t seed = 1;
  bool dual = false;                 // pairs of prints instead of one
  std::vector<std::string> sources;  // empty: all, and "total"
};

// Sources "basis", "basis, estimated" and "total, with the basis": random lamps that no basis holds
// (truncation_rows.h, spot_total_rows.h); deviations are from the lamps themselves, `value` is the
// root mean square of theirs, and `error` comes from the spread of the squares.
//
// "SOURCE, exposures estimated": of sessions with longer brackets, whose exposure times are found
// from the frames. Deviations of the times themselves are from the same session, merged with the
// times read back, which are right there.
//
// Source "missing positions": random lamps that some texels saw through a part of the filters only
// (missing_rows.h); likewise.
//
// Source "measured filter": photographs of a print, or of a pair (filter_rows.h).
//
// Rows: source, quantity, runs, value (without errors), predicted and observed (standard
// deviations in its unit), ratio (predicted over observed), error (relative standard error of
// observed, 1 / sqrt(2 runs)), share (observed over value); of filters at their known level bias
// (filter_rows.h).
nlohmann::json BenchBudget(const BenchBudgetOptions& options);

}  // namespace luxfield::bench
