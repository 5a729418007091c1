#include "luxfield/cli/named_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "luxfield/core/error.h"
#include "luxfield/core/outputs.h"

namespace luxfield::cli {
namespace {

namespace fs = std::filesystem;
using core::FileKind;

const std::vector<FileKind> kSessions = {FileKind::kSession,       FileKind::kLightFieldSession,
                                         FileKind::kSensorSession, FileKind::kGeometrySession,
                                         FileKind::kGlareSession,  FileKind::kFilterSession};

const std::vector<FileKind> kCalibrations = {
    FileKind::kSensorCalibration, FileKind::kGeometryCalibration, FileKind::kGlareCalibration,
    FileKind::kResponseCalibration};

// Where a file of this kind comes from, or nothing where the user writes it.
std::string Origin(FileKind kind) {
  switch (kind) {
    case FileKind::kMeasurements:
      return "`luxfield merge SESSION -o X.meas.exr` makes one";
    case FileKind::kLightField:
      return "`luxfield reconstruct X.meas.exr` makes one of measurements, `luxfield import` of "
             "rays";
    case FileKind::kTables:
      return "`luxfield preprocess X.lf.exr` makes one of a light field";
    case FileKind::kMeasuredFilter:
      return "`luxfield filter measure` makes one";
    case FileKind::kFlatField:
      return "`luxfield calibrate flat-field` makes one";
    case FileKind::kFilterSheet:
      return "`luxfield filter print` writes one";
    case FileKind::kSensorCalibration:
      return "`luxfield calibrate sensor` makes one";
    case FileKind::kResponseCalibration:
      return "`luxfield calibrate response` makes one";
    case FileKind::kSession:
    case FileKind::kLightFieldSession:
      return "`luxfield capture` makes one of a plan";
    case FileKind::kSensorSession:
      return "`luxfield capture` makes one of a plan of kind \"sensor\"";
    case FileKind::kGeometrySession:
      return "`luxfield capture` makes one of a plan of kind \"geometry\"";
    case FileKind::kGlareSession:
      return "`luxfield capture` makes one of a plan of kind \"glare\"";
    case FileKind::kFilterSession:
      return "`luxfield capture` makes one of a plan of kind \"filter\"";
    case FileKind::kPlan:
    case FileKind::kLab:
      return "docs/formats/lab-and-plan.md says how to write one";
    case FileKind::kScene:
      return "docs/formats/scene.md says how to write one";
    case FileKind::kMotionPath:
      return "docs/formats/path.md says how to write one";
    case FileKind::kRays:
      return "ray files come from a lamp's maker or a ray tracer: ask for TM-25";
    default:
      return "name one";
  }
}

// The verbs that take a file of this kind, if any does.
std::string Use(FileKind kind) {
  switch (kind) {
    case FileKind::kSession:
      return "`verify` and `report`";
    case FileKind::kLightFieldSession:
      return "`merge`";
    case FileKind::kSensorSession:
      return "`calibrate sensor` and `calibrate flat-field`";
    case FileKind::kGeometrySession:
      return "`calibrate geometry`";
    case FileKind::kGlareSession:
      return "`calibrate glare`";
    case FileKind::kFilterSession:
      return "`filter measure`";
    case FileKind::kEnvironmentFrames:
    case FileKind::kRadianceHdr:
      return "a scene's [environment]";
    case FileKind::kPlan:
      return "`plan` and `capture`";
    case FileKind::kLab:
      return "the --lab of `plan` and `capture`";
    case FileKind::kScene:
      return "`render` and `view`";
    case FileKind::kMotionPath:
      return "the --sequence of `render` and the --record of `view`";
    case FileKind::kMeasurements:
      return "`reconstruct`";
    case FileKind::kLightField:
      return "`preprocess` and a scene's [[luminaire]]";
    case FileKind::kTables:
      return "the --tables of `render`";
    case FileKind::kMeasuredFilter:
      return "the --filter of `reconstruct`";
    case FileKind::kFlatField:
      return "the --flat-field of `merge`";
    case FileKind::kExrPicture:
      return "`compare`";
    case FileKind::kSensorCalibration:
    case FileKind::kGeometryCalibration:
    case FileKind::kGlareCalibration:
      return "the --calibration of `merge`";
    case FileKind::kResponseCalibration:
      return "the --calibration of `merge` of pictures";
    case FileKind::kFilterSheet:
      return "the --sheet of `filter measure`";
    case FileKind::kRays:
      return "`import`";
    case FileKind::kPhotograph:
      return "`merge` and `calibrate response`";
    case FileKind::kMesh:
      return "a scene's [[mesh]]";
    case FileKind::kUnknown:
    case FileKind::kFolder:
    case FileKind::kFigures:
    case FileKind::kIntensity:
    case FileKind::kForeignRays:
    case FileKind::kHtml:
      return {};
  }
  return {};
}

}  // namespace

void RequireKind(const fs::path& path, const std::vector<FileKind>& taken) {
  const FileKind kind = core::WhatIs(path);
  if (kind == FileKind::kUnknown || std::find(taken.begin(), taken.end(), kind) != taken.end())
    return;
  std::string wanted;
  for (const FileKind one : taken)
    if (one != FileKind::kSession || taken.size() == 1)
      wanted += (wanted.empty() ? "" : " or ") + core::NameOf(one);
  if (taken == kSessions) wanted = core::NameOf(FileKind::kSession);
  if (taken == kCalibrations) wanted = "a calibration (.cal.json)";
  const std::string use = Use(kind);
  throw InputError(
      path.string(), fmt::format("is {}, not {}", core::NameOf(kind), wanted),
      Origin(taken.front()) + (use.empty() ? "" : fmt::format("; what you named is for {}", use)));
}

CLI::Validator InputFile(std::vector<FileKind> taken) {
  return CLI::Validator(
      [taken = std::move(taken)](const std::string& path) {
        if (!path.empty()) RequireKind(path, taken);  // or the program says what is empty
        return std::string();
      },
      "");
}

CLI::Validator InputSession() { return InputFile(kSessions); }
CLI::Validator InputCalibration() { return InputFile(kCalibrations); }

CLI::Validator OutputFile() {
  return CLI::Validator(
      [](const std::string& path) {
        core::RequireOutputPlace(path);
        return std::string();
      },
      "");
}

CLI::Validator OutputName(std::string first_ending) {
  return CLI::Validator(
      [first_ending = std::move(first_ending)](const std::string& name) {
        if (fs::path(name).filename().empty())
          throw InputError(
              fmt::format("--output '{}' ends without a name; write it like sheet or "
                          "folder/sheet",
                          name));
        core::RequireOutputPlace(name + first_ending);
        return std::string();
      },
      "");
}

void RequireLuminaires(const scene::Scene& scene) {
  for (const scene::Luminaire& luminaire : scene.luminaires) {
    const fs::path file = luminaire.light_field.lexically_normal();
    std::error_code unknown;
    if (!fs::exists(file, unknown)) {
      const fs::path folder = file.parent_path();
      const bool in_out = folder.parent_path().filename() == "out";
      throw InputError(
          file.string(),
          fmt::format("does not exist, and the luminaire '{}' needs it", luminaire.name),
          in_out && folder.filename() == "lamps"  ? "`./run lamps` makes the lamps of data/scenes"
          : in_out && folder.filename() == "demo" ? "`./run demo` makes it"
                                                  : Origin(FileKind::kLightField));
    }
    RequireKind(file, {FileKind::kLightField});
  }
  for (const scene::ClassicalLight& light : scene.classical_lights) {
    const fs::path file = light.distribution.lexically_normal();
    std::error_code unknown;
    if (!fs::exists(file, unknown))
      throw InputError(file.string(),
                       fmt::format("does not exist, and the luminaire '{}' needs it", light.name),
                       "correct its distribution");
    RequireKind(file, {FileKind::kIntensity});
  }
}

}  // namespace luxfield::cli
