#include "reconstruct/mosaic_sites.h"

#include <fmt/format.h>

#include "core/cfa.h"
#include "core/error.h"
#include "core/json.h"

namespace luxfield::reconstruct {
namespace {

template <typename Value>
std::vector<Value> PixelsOfSite(const std::vector<Value>& pixels, int width, int height, int site) {
  std::vector<Value> own;
  if (pixels.empty()) return own;
  own.reserve(pixels.size() / 4 + static_cast<std::size_t>(width));
  for (int row = site / 2; row < height; row += 2)
    for (int column = site % 2; column < width; column += 2)
      own.push_back(pixels[static_cast<std::size_t>(row) * width + column]);
  return own;
}

}  // namespace

std::string ReadCfa(const core::Json& camera, const std::string& file) {
  if (!camera.contains("cfa")) return {};
  const auto cfa = core::Field<std::string>(camera, "cfa", file);
  if (!core::IsBayer(cfa))
    throw InputError(file, fmt::format("camera.cfa = '{}' is unknown", cfa),
                     "use RGGB, BGGR, GRBG or GBRG");
  return cfa;
}

int SitesOf(const std::string& cfa) { return cfa.empty() ? 1 : 4; }

std::vector<core::RawFrame> SplitSites(core::RawFrame frame, const std::string& cfa) {
  std::vector<core::RawFrame> sites;
  if (cfa.empty()) {
    sites.push_back(std::move(frame));
    return sites;
  }
  const int width = frame.width, height = frame.height;
  for (int site = 0; site < SitesOf(cfa); ++site)
    sites.push_back({(width + 1 - site % 2) / 2, (height + 1 - site / 2) / 2,
                     PixelsOfSite(frame.dn, width, height, site),
                     PixelsOfSite(frame.value, width, height, site)});
  return sites;
}

}  // namespace luxfield::reconstruct
