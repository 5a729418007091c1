#include "luxfield/cli/memory_option.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/cli/program.h"
#include "luxfield/core/error.h"
#include "luxfield/core/resident_memory.h"

namespace luxfield::cli {

void AddMemoryOption(CLI::App& verb, std::string& memory, const std::string& what) {
  verb.add_option(
      "--memory", memory,
      fmt::format("Most memory that the program takes, bytes or with K, M, G (2G): {}", what));
}

std::optional<std::uint64_t> MemoryLeft(const std::string& memory) {
  if (memory.empty()) return {};
  constexpr double kKibi = 1024;
  const double bytes = ParseQuantity(memory, "--memory",
                                     {{"", 1},
                                      {"K", kKibi},
                                      {"M", kKibi * kKibi},
                                      {"G", kKibi * kKibi * kKibi},
                                      {"T", kKibi * kKibi * kKibi * kKibi}});
  const auto taken = static_cast<double>(core::ResidentBytes());
  if (!(bytes > taken))
    throw InputError(fmt::format(
        "--memory {} is less than the {} that the program takes to begin with; give more", memory,
        FormatBytes(taken)));
  return static_cast<std::uint64_t>(std::min(bytes, 0x1p62) - taken);
}

void RequireMemory(const std::string& file, const std::string& what, std::uint64_t left,
                   std::uint64_t needed) {
  if (needed <= left) return;
  constexpr std::uint64_t kMib = 1 << 20;
  throw InputError(file,
                   fmt::format("{} take {} MiB, and --memory leaves {}", what,
                               (needed + kMib - 1) / kMib, left / kMib),
                   fmt::format("give it {} MiB more", (needed - left) / kMib + 1));
}

}  // namespace luxfield::cli
