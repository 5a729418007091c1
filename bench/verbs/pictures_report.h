// Fast pictures beside their references, to look at.
#pragma once

#include <filesystem>
#include <vector>

#include "luxfield/bench/fast_pictures.h"

namespace luxfield::bench {

// NAME-fast.png and NAME-reference.png at one exposure, NAME-difference.png, the CIE 1976 difference
// of each pixel with its legend, and index.html, which shows them. Returns the page's path.
std::filesystem::path WriteFastPictures(const std::vector<FastPicture>& pictures,
                                        const std::filesystem::path& folder);

}  // namespace luxfield::bench
