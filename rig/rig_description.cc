#include "luxfield/rig/rig_description.h"

#include <fmt/format.h>

namespace luxfield::rig {

std::vector<std::string> TargetNames(const CalibrationTargets& targets) {
  std::vector<std::string> names = {"none"};
  if (targets.board) {
    names.push_back("board on image plane");
    for (int k = 1; k <= targets.board_poses; ++k) names.push_back(fmt::format("board {}", k));
  }
  names.push_back("mask");
  names.push_back("mask on spacer");
  for (int k = 1; k <= targets.traps; ++k) names.push_back(fmt::format("trap {}", k));
  return names;
}

}  // namespace luxfield::rig
