// Fuzz targets: whatever bytes come from an instrument, as SCPI text and as USBTMC transfers.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "luxfield/hal/drivers/scpi/scpi.h"
#include "luxfield/hal/drivers/usbtmc/message.h"

namespace luxfield::fuzz {

inline void ScpiMessage(std::string_view input) {
  hal::scpi::ParseNumber(input);
  if (const auto error = hal::scpi::ParseError(input))
    for (const char c : error->text)
      if (c < ' ' || c > '~') std::abort();
}

inline void UsbTmcTransfer(std::string_view input) {
  constexpr std::uint32_t kMost = 4096;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(input.data());
  const auto reply = hal::usbtmc::ParseReply({bytes, input.size()}, 1, kMost);
  if (reply.problem.empty() && reply.size > kMost) std::abort();
}

}  // namespace luxfield::fuzz
