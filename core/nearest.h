// The known word that a misspelt one was probably meant to be.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace luxfield::core {

// Of `words` the one with the smallest edit distance to `word` (Damerau and Levenshtein: a letter
// inserted, left out, replaced, or two neighbours swapped count one each), the first of several.
// Nothing where even that takes more than a third of the letters of the longer word.
//
//   Nearest("rendr", {"render", "report"}) == "render"
std::optional<std::string> Nearest(std::string_view word, std::span<const std::string> words);

}  // namespace luxfield::core
