#include "luxfield/core/nearest.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace luxfield::core {
namespace {

// Optimal string alignment: row i of the table holds the distances of a's first i letters to the
// beginnings of b.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before_last = std::exchange(last, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::optional<std::string> Nearest(std::string_view word, std::span<const std::string> words) {
  std::optional<std::string> nearest;
  std::size_t least = 0;
  for (const std::string& candidate : words) {
    const std::size_t distance = EditDistance(word, candidate);
    if (3 * distance > std::max(word.size(), candidate.size())) continue;
    if (!nearest || distance < least) {
      nearest = candidate;
      least = distance;
    }
  }
  return nearest;
}

}  // namespace luxfield::core
