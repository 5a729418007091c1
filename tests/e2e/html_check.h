// Whether a report is a page that a browser shows as it was meant, without any other file.
#pragma once

#include <string>

namespace luxfield::e2e {

// Adds a failure for every tag that is not closed, or closed where another is open; for attributes
// without quotes, and for '&' that begins no entity; for what the page would fetch from elsewhere
// or run; for a number that is none ("nan", "inf") in text or in an attribute; and for a page
// without a title, a heading or text.
void ExpectSelfContainedPage(const std::string& html);

}  // namespace luxfield::e2e
