// Options of verbs that write a tone-mapped PNG beside an EXR: --png, --tone, --exposure.
//
//   auto options = std::make_shared<PngOptions>();
//   AddPngOptions(verb, *options);
//   ...
//   CheckPngOptions(*options);  // before anything is computed
//   WritePng(*options, frame.radiance);
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "luxfield/core/image.h"

namespace luxfield::cli {

struct PngOptions {
  std::string png;   // empty: none is written
  std::string tone;  // a name of render::ToneCurves(); empty: the first
  std::optional<double> exposure;
};

void AddPngOptions(CLI::App& verb, PngOptions& options);

// Throws InputError for a name that ends otherwise than .png, and for options that contradict each
// other or would not be read.
void CheckPngOptions(const PngOptions& options);

// Writes the picture where one is asked for. Throws DeviceError.
void WritePng(const PngOptions& options, const core::Image& radiance);

}  // namespace luxfield::cli
