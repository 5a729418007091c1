// A lamp's volume as JSON and packed codes (docs/web.md, "The volume"): what a page and a glTF file
// hold of it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "luxfield/core/json.h"
#include "luxfield/web/lamp_volume_fit.h"

namespace luxfield::web {

// All that is said of the volume but the codes, which each container keeps in its own way: beside
// the keys of tables[k] it puts where the codes of table k are.
core::Json VolumeJson(const FittedVolume& fitted);

// The volume and what is stated of it; `packed` stays empty. `codes` returns the packed codes of one
// of the JSON's tables. InputError naming `file` where that is no whole lamp.
FittedVolume VolumeFromJson(
    const core::Json& json,
    const std::function<std::vector<std::uint8_t>(const core::Json& table)>& codes,
    const std::string& file);

}  // namespace luxfield::web
