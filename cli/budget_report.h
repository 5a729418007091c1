// What `budget` shows: a table on the terminal, a page with a bar chart per quantity.
#pragma once

#include <filesystem>
#include <string>

#include "reconstruct/error_budget.h"

namespace luxfield::cli {

void PrintErrorBudget(const reconstruct::ErrorBudget& budget);

void WriteBudgetReport(const reconstruct::ErrorBudget& budget, const std::string& session,
                       const std::filesystem::path& html);

}  // namespace luxfield::cli
