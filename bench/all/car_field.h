// A headlight of any size on a road, as files.
#pragma once

#include <filesystem>

namespace luxfield::bench {

// Writes car.lf.exr, columns x rows images of texels^2 with the contrast of `car2`, and car.toml, a
// road that it lights, into the folder. Returns the latter.
std::filesystem::path WriteCarField(const std::filesystem::path& folder, int columns, int rows,
                                    int texels);

}  // namespace luxfield::bench
