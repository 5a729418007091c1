// The hardware error that an action ends in; without one the test fails.
#pragma once

#include <gtest/gtest.h>

#include "luxfield/hal/error.h"

namespace luxfield::hal {

template <typename Action>
HardwareError ErrorOf(Action&& action) {
  try {
    action();
  } catch (const HardwareError& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was thrown";
  return {Fault::kProtocol, "", "", "", ""};
}

}  // namespace luxfield::hal
