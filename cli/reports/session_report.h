// How a session went, as text and as an HTML page.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/capture/review/session_review.h"

namespace luxfield::cli {

void PrintSessionReview(const capture::SessionReview& review, const std::string& session);

// One page that needs no other file. What a session does not have is left out in one sentence; of
// long series the plots show means and extremes of equal spans of time.
void WriteSessionReport(const capture::SessionReview& review, const std::string& session,
                        const std::filesystem::path& html);

}  // namespace luxfield::cli
