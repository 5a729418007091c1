#include "luxfield/reconstruct/calibrate/filter/photograph.h"

#include <fmt/format.h>

#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"

namespace luxfield::reconstruct {

void WritePhotograph(const std::filesystem::path& path, const MergedFrame& photograph) {
  const core::ExrPartView part{"",
                               photograph.width,
                               photograph.height,
                               {{"Y", std::span(photograph.rate_e_per_s)},
                                {"sigma.Y", std::span(photograph.sigma_e_per_s)},
                                {"mask", std::span(photograph.mask)}},
                               {}};
  core::WriteExr(path, std::span(&part, 1));
}

MergedFrame ReadPhotograph(const std::filesystem::path& path) {
  core::ExrReader reader(path);
  if (!reader.has_channel(0, "Y") || !reader.has_channel(0, "sigma.Y"))
    throw InputError(path.string(), "has no channels Y and sigma.Y",
                     "merge the photograph's exposures to a linear picture with its error");
  MergedFrame photograph;
  photograph.width = reader.parts()[0].width;
  photograph.height = reader.parts()[0].height;
  photograph.rate_e_per_s = reader.ReadFloat(0, "Y");
  photograph.sigma_e_per_s = reader.ReadFloat(0, "sigma.Y");
  photograph.count.assign(photograph.rate_e_per_s.size(), 1);
  photograph.mask.assign(photograph.rate_e_per_s.size(), 0);
  if (reader.has_channel(0, "mask")) photograph.mask = reader.ReadUint(0, "mask");
  for (std::size_t p = 0; p < photograph.mask.size(); ++p)
    if (!(std::isfinite(photograph.rate_e_per_s[p]) && photograph.sigma_e_per_s[p] >= 0 &&
          std::isfinite(photograph.sigma_e_per_s[p])))
      throw InputError(
          path.string(),
          fmt::format("holds {} with sigma {} at row {}, column {}", photograph.rate_e_per_s[p],
                      photograph.sigma_e_per_s[p], p / photograph.width, p % photograph.width),
          "merge the photograph again");
  return photograph;
}

}  // namespace luxfield::reconstruct
