#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/radiance_hdr.h"

namespace luxfield::core {

void WriteRadianceHdr(const std::filesystem::path& path, const Image& image,
                      const std::vector<std::string>& comments, const std::string& view) {
  std::string bytes = "#?RADIANCE\n";
  for (const std::string& comment : comments) bytes += "# " + comment + "\n";
  if (!view.empty()) bytes += "VIEW= " + view + "\n";
  bytes += fmt::format("FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", image.height, image.width);
  bytes.reserve(bytes.size() + 4 * image.plane_size());
  const auto red = image.plane(0), green = image.plane(image.channels == 3 ? 1 : 0),
             blue = image.plane(image.channels == 3 ? 2 : 0);
  for (std::size_t k = 0; k < image.plane_size(); ++k) {
    const float rgb[] = {red[k], green[k], blue[k]};
    for (const float value : rgb)
      if (!(value >= 0 && value < 0x1p127f))
        throw InputError(path.string(), fmt::format("{} has no place in a Radiance picture", value),
                         "write OpenEXR instead");
    int exponent = 0;  // largest = mantissa 2^exponent, mantissa in [1/2, 1)
    const float largest = std::max({rgb[0], rgb[1], rgb[2]});
    std::frexp(largest, &exponent);
    if (largest == 0 || exponent < -127) {
      bytes.append(4, '\0');
      continue;
    }
    for (const float value : rgb)
      bytes.push_back(static_cast<char>(static_cast<int>(std::ldexp(value, 8 - exponent))));
    bytes.push_back(static_cast<char>(exponent + 128));
  }
  WriteFileAtomically(path, bytes);
}

}  // namespace luxfield::core
