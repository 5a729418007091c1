// `luxfield bench ray-files`: ray files written, read and imported, beside the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace luxfield::bench {

struct BenchRayFilesOptions {
  std::filesystem::path light_field;  // .lf.exr of the lamp whose rays are drawn
  std::filesystem::path folder;       // scratch: 28 bytes a ray and format
  std::uint64_t rays = 1000000;
  // Endings as of `luxfield export`.
  std::vector<std::string> formats{"tm25ray", "dat", "ltrf", "speos.ray"};
  int runs = 3;  // of each work; medians count
};

// Rows, of the median run by wall time:
//   work      "export" and "import", programs as users start them; "read", the file streamed and
//             its rays counted; "disk write" and "disk read", as many bytes, durable as the
//             exported file and from the system's cache
//   format, rays, mib, wall_s, core_s, rays_per_core_s, mib_per_s (of wall time), peak_mib
// Throws InputError where the light field is none.
nlohmann::json BenchRayFiles(const BenchRayFilesOptions& options);

}  // namespace luxfield::bench
