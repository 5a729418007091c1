#include "luxfield/cli/build_facts.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "commit.h"
#include "luxfield/version.h"
#include "options.h"

namespace luxfield::cli {
namespace {

// `list` parted at its ", ", in lines of at most 100 columns that begin below one another.
std::string Wrapped(std::string_view list, std::size_t indent) {
  std::string lines;
  std::size_t column = indent;
  while (!list.empty()) {
    const std::size_t comma = list.find(", ");
    const std::string_view item = list.substr(0, comma);
    list = comma == list.npos ? std::string_view{} : list.substr(comma + 2);
    if (column + item.size() + 1 > 100) {
      lines += "\n" + std::string(indent, ' ');
      column = indent;
    }
    lines += fmt::format("{}{}", item, list.empty() ? "" : ", ");
    column += item.size() + 2;
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
