// The Frobisher stack, a Canon 5D Mark II's JPEGs of 1/8, 1 and 8 s, and colour-hdri's response
// curves of it, where the test data are.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "luxfield/core/npy.h"
#include "luxfield/reconstruct/calibrate/response/picture_stack.h"
#include "tests/test_data.h"

namespace luxfield::reconstruct {

inline std::filesystem::path FrobisherFile(const std::string& name) {
  return testdata::Folder() / "hdr_colour" / name;
}

// g at codes 0 to 255.
inline std::vector<double> FrobisherCurve(int channel) {
  return core::ReadNpy(FrobisherFile(fmt::format("calibration__test_g_solve_g_{}.npy", channel)));
}

inline PictureStack FrobisherStack() {
  std::vector<std::filesystem::path> files;
  for (const int n : {2600, 2601, 2602})
    files.push_back(FrobisherFile(fmt::format("frobisher_001__IMG_{}.jpg", n)));
  return ReadPictureStack(files, {});
}

}  // namespace luxfield::reconstruct
