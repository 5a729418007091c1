// What a lab.toml says of devices on GPIO lines (docs/formats/lab-and-plan.md). All throw
// InputError naming file and field.
#pragma once

#include <string>
#include <vector>

#include "luxfield/core/config.h"
#include "luxfield/hal/drivers/gpiod/line_selector.h"
#include "luxfield/hal/drivers/gpiod/safety_inputs.h"
#include "luxfield/hal/drivers/gpiod/trigger_line.h"

namespace luxfield::hal {

// A table {line, active_low, bias}.
gpiod::LineSettings ReadLine(const core::Config& line);

// [inputs].
gpiod::SafetyInputsOptions ReadInputs(const core::Config& inputs);

// [shutter], [print] or [colour]: a device of these positions, the first of them where it goes when
// it is opened.
gpiod::LineSelectorOptions ReadSelector(const core::Config& selector, const std::string& name,
                                        const std::vector<std::string>& positions);

// [trigger].
gpiod::TriggerLineOptions ReadTrigger(const core::Config& trigger);

}  // namespace luxfield::hal
