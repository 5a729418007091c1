// Grbl's numbers in words: what an alarm or an error means for a stage, and what to do. Source of
// the numbers: doc/csv/alarm_codes_en_US.csv and error_codes_en_US.csv of Grbl 1.1; alarms from 10:
// alarms.h of grblHAL and Alarm.h of FluidNC, which differ.
#pragma once

#include <string_view>

#include "luxfield/hal/error.h"

namespace luxfield::hal::grbl {

struct Meaning {
  Fault fault;
  std::string_view problem, remedy;
};

// Unknown numbers mean an alarm, or a refusal, nobody has documented.
Meaning AlarmMeaning(int code, std::string_view firmware);
Meaning ErrorMeaning(int code);

}  // namespace luxfield::hal::grbl
