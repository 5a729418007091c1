#include "core/printable.h"

#include <algorithm>

namespace luxfield::core {

std::string Printable(std::string_view text, std::size_t most) {
  std::string shown(text.substr(0, most));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return shown;
}

}  // namespace luxfield::core
