// Which optional drivers this program was built with. Only for the hal room, whose compiler flags
// say so.
#pragma once

#include <string>

#include "luxfield/core/config.h"

namespace luxfield::hal {

inline constexpr bool kHasAravis = LUXFIELD_ARAVIS;
inline constexpr bool kHasGphoto2 = LUXFIELD_GPHOTO2;
#ifdef LUXFIELD_LIBGPIOD
inline constexpr bool kHasGpiod = true;
#else
inline constexpr bool kHasGpiod = false;
#endif

// InputError where [table] names a driver that is not built in.
inline void RequireBuilt(const core::Config& table, bool built, const std::string& library) {
  if (!built)
    table.Fail("driver", "is not built into this program",
               "install " + library + " and build again");
}

}  // namespace luxfield::hal
