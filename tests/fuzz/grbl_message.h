// Fuzz target: whatever bytes come from a Grbl controller.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "luxfield/hal/drivers/grbl/message.h"
#include "luxfield/hal/transport/line_reader.h"

namespace luxfield::fuzz {

inline void GrblMessage(std::string_view input) {
  namespace grbl = hal::grbl;
  hal::LineBuffer lines(128);
  lines.Push(input);
  while (const auto line = lines.Pop()) {
    if (line->size() > 128) std::abort();
    const grbl::Message message = grbl::ParseMessage(*line);
    if (const auto* status = std::get_if<grbl::Status>(&message))
      for (const double axis : status->position)
        if (!std::isfinite(axis)) std::abort();
    if (const auto* setting = std::get_if<grbl::Setting>(&message))
      if (!std::isfinite(setting->value)) std::abort();
  }
}

}  // namespace luxfield::fuzz
