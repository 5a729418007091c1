// Fuzz target: whatever bytes come from a Zaber chain.
#pragma once

#include <cstdlib>
#include <string_view>

#include "luxfield/hal/drivers/zaber/message.h"
#include "luxfield/hal/transport/line_reader.h"

namespace luxfield::fuzz {

inline void ZaberMessage(std::string_view input) {
  namespace zaber = hal::zaber;
  hal::LineBuffer lines(128);
  lines.Push(input);
  while (const auto line = lines.Pop()) {
    const zaber::Message message = zaber::ParseMessage(*line);
    if (const auto* reply = std::get_if<zaber::Reply>(&message))
      if (reply->data.empty() || reply->warning.size() != 2 || reply->device > 99) std::abort();
  }
}

}  // namespace luxfield::fuzz
