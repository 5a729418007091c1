#include "luxfield/cli/build_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "commit.h"
#include "luxfield/version.h"
#include "options.h"

namespace luxfield::cli {
namespace {

// `list` parted at its blanks after commas, in lines of at most 100 columns that begin below one
// another.
std::string Wrapped(std::string_view list, std::size_t indent) {
  std::string lines;
  std::size_t column = indent;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(", "), list.size() - 1) + 1;
    const std::string_view item = list.substr(0, end);
    list.remove_prefix(std::min(end + 1, list.size()));
    if (column > indent && column + 1 + item.size() > 100) {
      lines += "\n" + std::string(indent, ' ');
      column = indent;
    }
    if (column > indent) lines += ' ', ++column;
    lines += item;
    column += item.size();
  }
  return lines;
}

}  // namespace

std::string BuildFacts() {
  const std::string_view commit = LUXFIELD_COMMIT;
  return fmt::format(
      "luxfield {}\n"
      "commit     {}\n"
      "build      {}, {}, with {}\n"
      "libraries  {}",
      LUXFIELD_VERSION, commit.empty() ? "unknown: built without its git repository" : commit,
      LUXFIELD_BUILD_TYPE, LUXFIELD_COMPILER, LUXFIELD_PARTS, Wrapped(LUXFIELD_LIBRARIES, 11));
}

}  // namespace luxfield::cli
