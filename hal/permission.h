// Devices that a user may not open (docs/how-to/permissions.md).
#pragma once

#include <string>

namespace luxfield::hal {

// True where the node is there and this user may not read and write it.
bool IsForbidden(const std::string& node);

// Remedies.
inline constexpr const char* kJoinDialout =
    "join the group dialout, or the one that owns it (docs/how-to/permissions.md)";
inline constexpr const char* kJoinGpio =
    "install luxfield's udev rule and join the group gpio (docs/how-to/permissions.md)";
inline constexpr const char* kJoinPlugdev =
    "install luxfield's udev rule and join the group plugdev (docs/how-to/permissions.md)";

}  // namespace luxfield::hal
