// Sizes and positions of foreign ray files (docs/formats/ray-files.md). Internal to formats/.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace luxfield::formats {

static_assert(std::endian::native == std::endian::little,
              "ray files are read and written as they lie in memory");

inline constexpr double kUnitTolerance = 1e-3;  // of a direction's length

namespace zemax {
inline constexpr std::size_t kHeaderBytes = 208, kDescriptionBytes = 100;
inline constexpr std::int32_t kMagic = 1010, kOldMagic = 8675309;
inline constexpr std::size_t kAtRays = 4, kAtDescription = 8, kAtSourceFlux = 108, kAtRayFlux = 112,
                             kAtWavelength = 116, kAtUnits = 136, kAtScale = 164,
                             kAtRayFormat = 192, kAtFluxType = 196;
inline constexpr std::int32_t kFluxOnly = 0, kSpectral = 2;
inline constexpr double kMetres[] = {1, 0.0254, 0.01, 0.3048, 0.001};  // by units code
inline constexpr std::uint32_t kMillimetres = 4;
}  // namespace zemax

namespace lighttools {
inline constexpr std::size_t kHeaderBytes = 44, kEndBytes = 7;
inline constexpr std::size_t kAtMajor = 4, kAtDataType = 12, kAtFarField = 16, kAtColour = 20,
                             kAtUnits = 24, kAtOrigin = 28, kAtFlux = 40;
inline constexpr std::uint32_t kMajor = 2, kLumens = 1, kMillimetres = 1;
inline constexpr std::size_t kColumns[] = {7, 10, 8};  // by colour: none, XYZ, wavelength
inline constexpr char kMagic[] = "LTRF", kEnd[] = "LTRFEND";
}  // namespace lighttools

namespace speos {
inline constexpr std::size_t kHeaderBytes = 28, kRayBytes = 32, kAtLumens = 24;
inline constexpr float kFiller = 2.0f;         // the header's bytes 4 to 23, as seen
inline constexpr double kWavelength_nm = 555;  // of rays whose own is not known
inline constexpr double kLumensPerWatt = 683;  // at 555 nm
}  // namespace speos

}  // namespace luxfield::formats
