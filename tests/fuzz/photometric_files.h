// Fuzz targets: text that claims to be LM-63, EULUMDAT or TM-33, and containers. It ends in an InputError or in a table
// with a flux, which is written and read back.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "luxfield/core/error.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/tm33.h"

namespace luxfield::fuzz {

inline void RequirePhotometry(const formats::Photometry& p) {
  formats::Validate(p, "input");
  if (!std::isfinite(formats::Flux(p)) || !std::isfinite(formats::Intensity(p, {0.3, -0.2, 0.9})))
    std::abort();
  formats::FindSymmetry(p);
}

inline void Lm63File(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseLm63(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(
        formats::ParseLm63(formats::FormatLm63(p, formats::Lm63Version::k2019, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void EulumdatFile(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseEulumdat(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(formats::ParseEulumdat(formats::FormatEulumdat(p, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void Tm33File(std::string_view input) {
  try {
    const formats::Photometry p = formats::ParseTm33(input, "input");
    RequirePhotometry(p);
    RequirePhotometry(formats::ParseTm33(formats::FormatTm33(p, "output"), "again"));
  } catch (const InputError&) {
  }
}

inline void GldfFile(std::string_view input) {
  try {
    RequirePhotometry(formats::ParseGldf(input, "input"));
  } catch (const InputError&) {
  }
}

}  // namespace luxfield::fuzz
