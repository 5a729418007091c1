// Sizes and positions of a TM-25 file (docs/formats/tm25.md). Internal to lightfield/.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace luxfield::formats::tm25 {

static_assert(std::endian::native == std::endian::little,
              "TM-25 is read and written as it lies in memory");

inline constexpr std::size_t kHeaderBytes = 256, kFlagBytes = 32;
inline constexpr std::size_t kTexts = 9, kTextBytes = 4000;
inline constexpr std::size_t kFixedBytes =
    kHeaderBytes + kFlagBytes + kTexts * kTextBytes;  // 36 288
inline constexpr std::size_t kLabelBytes = 512, kAlignment = 32, kDateBytes = 28;
inline constexpr std::int32_t kVersion = 2013;
inline constexpr std::uint32_t kUnknownBits = 0x7FC00001;  // the NaN that stands for "unknown"
inline constexpr double kUnitTolerance = 1e-3;             // of a direction's length

// Offsets in the header.
inline constexpr std::size_t kAtVersion = 4, kAtCreation = 8, kAtLuminous = 12, kAtRadiant = 16,
                             kAtRays = 20, kAtDate = 28, kAtStart = 56, kAtSpectral = 60,
                             kAtWavelength = 64, kAtMinimum = 68, kAtMaximum = 72, kAtTables = 76,
                             kAtAdditional = 80, kAtText = 84;

// Flags, in the order in which they are stored.
enum Flag {
  kPosition,
  kDirection,
  kRadiant,
  kWavelength,
  kLuminous,
  kStokes,
  kTristimulus,
  kIndex,
  kFlags
};

// Number of float32 that a flag adds to each ray.
inline constexpr std::size_t kItems[kFlags] = {3, 3, 1, 1, 1, 6, 2, 1};

}  // namespace luxfield::formats::tm25
