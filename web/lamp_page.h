// A lamp as one web page (docs/web.md): a room lit by its near field, with readings, in one HTML file
// that asks nothing of any network.
#pragma once

#include <filesystem>
#include <string>

#include "luxfield/lightfield/light_field.h"
#include "luxfield/web/lamp_volume_fit.h"

namespace luxfield::web {

struct PageFacts {
  std::string title;      // as text
  std::string file_name;  // of the light field
  std::string sha256;     // of its bytes; left out of the page if empty
};

// Of the size of an error: "0.34 %", "12 %".
std::string PercentText(double share);

// The JSON that the page holds.
std::string PageJson(const FittedVolume& fitted);

// The whole page. `fitted` is the light field's.
std::string LampPage(const lightfield::LightField& field, const FittedVolume& fitted,
                     const PageFacts& facts);

// The volume of a page and what is stated of it; `packed` is empty. InputError naming the file.
FittedVolume ReadLampPage(const std::filesystem::path& path);

struct PageResult {
  FittedVolume fitted;
  std::size_t bytes = 0;  // of the page
};

// Writes the page of a light field at once or not at all (core/file.h).
PageResult WriteLampPage(const std::filesystem::path& path, const lightfield::LightField& field,
                         const PageFacts& facts, const FitOptions& options = {});

}  // namespace luxfield::web
