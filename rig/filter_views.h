// What the bench of a filter shows, by the names of its target selector.
#pragma once

#include <string>
#include <vector>

namespace luxfield::rig {

// The empty holder, then with each print in it.
inline std::vector<std::string> FilterViewNames(bool dual) {
  if (dual) return {"filter holder", "filter plus", "filter minus"};
  return {"filter holder", "filter print"};
}

}  // namespace luxfield::rig
