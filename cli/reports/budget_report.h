// What `budget` shows: a table on the terminal, a page with a bar chart per quantity.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "luxfield/reconstruct/budget/budget_settings.h"
#include "luxfield/reconstruct/budget/error_budget.h"

namespace luxfield::cli {

void PrintErrorBudget(const reconstruct::ErrorBudget& budget);

// `meter`: whose serial number, calibration and V(lambda) the page repeats.
void WriteBudgetReport(const reconstruct::ErrorBudget& budget,
                       const std::optional<reconstruct::Meter>& meter, const std::string& session,
                       const std::filesystem::path& html);

}  // namespace luxfield::cli
