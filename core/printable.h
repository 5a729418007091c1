// Text from files and devices, in messages and on terminals.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace luxfield::core {

// Its first bytes, '?' in place of what is not printable ASCII.
std::string Printable(std::string_view text, std::size_t most = 60);

}  // namespace luxfield::core
