#include "luxfield/core/file_kind.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <fstream>
#include <string_view>
#include <utility>

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

using Marks = std::vector<std::pair<std::string_view, FileKind>>;

constexpr std::size_t kMost = 1 << 18;

std::string FirstBytes(const fs::path& path) {
  std::string bytes(kMost, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return bytes;
}

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension;
}

// The text behind `key` and the separators that follow it.
std::string_view Behind(std::string_view text, std::string_view key, std::string_view separators) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return {};
  const auto value = text.find_first_not_of(separators, at + key.size());
  return value == std::string_view::npos ? std::string_view() : text.substr(value);
}

FileKind FirstOf(const Marks& marks, std::string_view text, FileKind otherwise) {
  for (const auto& [mark, kind] : marks)
    if (text.starts_with(mark)) return kind;
  return otherwise;
}

// Attributes are name\0 type\0 size value; a text is not terminated.
FileKind OfExr(std::string_view bytes) {
  if (bytes.find("luxfield flat field") != std::string_view::npos) return FileKind::kFlatField;
  constexpr std::string_view kKey("luxfield:kind\0string\0", 21);
  const auto at = bytes.find(kKey);
  if (at == std::string_view::npos || bytes.size() < at + kKey.size() + 4)
    return FileKind::kExrPicture;
  return FirstOf({{"light-field", FileKind::kLightField},
                  {"measurements", FileKind::kMeasurements},
                  {"tables", FileKind::kTables},
                  {"filter", FileKind::kMeasuredFilter}},
                 bytes.substr(at + kKey.size() + 4), FileKind::kExrPicture);
}

FileKind OfJson(std::string_view text) {
  const auto format = Behind(text, "\"format\"", " \t\r\n:\"");
  if (!format.empty())
    return FirstOf({{"luxfield sensor calibration", FileKind::kSensorCalibration},
                    {"luxfield geometry calibration", FileKind::kGeometryCalibration},
                    {"luxfield glare calibration", FileKind::kGlareCalibration},
                    {"luxfield response calibration", FileKind::kResponseCalibration},
                    {"luxfield filter sheet", FileKind::kFilterSheet}},
                   format, FileKind::kUnknown);
  const bool figures = text.find("\"verb\"") != std::string_view::npos &&
                       text.find("\"wall_s\"") != std::string_view::npos;
  return figures ? FileKind::kFigures : FileKind::kUnknown;
}

// Ray files of Zemax and Speos, whose first bytes are numbers and no mark alone.
bool IsRays(std::string_view bytes, const std::string& extension, std::uintmax_t size) {
  if (extension != ".ray" && extension != ".dat" && extension != ".sdf") return false;
  for (const std::string_view zemax :
       {std::string_view("\xf2\x03\0\0", 4), std::string_view("\xed\x5f\x84\0", 4)})
    if (bytes.starts_with(zemax)) return true;
  return extension == ".ray" && size > 28 && size % 32 == 28 &&
         bytes.substr(4, 4) == std::string_view("\0\0\0\x40", 4);
}

// XML with the element of TM-33, or of ATLA S001 from which it comes.
bool IsTm33(std::string_view text) {
  if (!text.starts_with("<") && !text.starts_with("\xEF\xBB\xBF<")) return false;
  for (const char* element : {"IESTM33", "ATLA_S001", "LuminaireOpticalData"})
    if (text.find(element) != std::string_view::npos) return true;
  return false;
}

// Whether a line begins so.
bool HasLine(std::string_view text, std::string_view beginning) {
  for (auto at = text.find(beginning); at != std::string_view::npos;
       at = text.find(beginning, at + 1))
    if (at == 0 || text[at - 1] == '\n') return true;
  return false;
}

FileKind OfToml(std::string_view text) {
  if (HasLine(text, "[plan]")) return FileKind::kPlan;
  if (HasLine(text, "[lab]")) return FileKind::kLab;
  for (const char* table : {"[[camera]]", "[[luminaire.key]]"})
    if (HasLine(text, table)) return FileKind::kMotionPath;
  for (const char* table : {"[[luminaire]]", "[[mesh]]", "[[quad]]", "[[box]]", "[[material]]"})
    if (HasLine(text, "[camera]") && HasLine(text, table)) return FileKind::kScene;
  return FileKind::kUnknown;
}

FileKind OfPlan(const fs::path& plan_json) {
  const std::string text = FirstBytes(plan_json);
  if (text.empty()) return FileKind::kSession;
  if (text.find("\"geometry\":") != std::string::npos) return FileKind::kLightFieldSession;
  return FirstOf({{"sensor\"", FileKind::kSensorSession},
                  {"geometry\"", FileKind::kGeometrySession},
                  {"glare\"", FileKind::kGlareSession},
                  {"filter\"", FileKind::kFilterSession}},
                 Behind(text, "\"kind\"", " \t\r\n:\""), FileKind::kSession);
}

FileKind OfFolder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "plan.json", error)) return OfPlan(folder / "plan.json");
  for (const char* file : {"journal.jsonl", "session.json"})
    if (fs::exists(folder / file, error)) return FileKind::kSession;
  for (auto entry = fs::directory_iterator(folder, error); !error && entry != fs::end(entry);
       entry.increment(error)) {
    const std::string extension = LowerExtension(entry->path());
    if (extension == ".exr" || extension == ".hdr") return FileKind::kEnvironmentFrames;
  }
  return error ? FileKind::kUnknown : FileKind::kFolder;
}

}  // namespace

FileKind WhatIs(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return OfFolder(path);
  if (error || !fs::is_regular_file(path, error)) return FileKind::kUnknown;
  const std::string bytes = FirstBytes(path);
  const FileKind by_magic =
      FirstOf({{std::string_view("\x76\x2f\x31\x01", 4), FileKind::kExrPicture},
               {"TM25", FileKind::kRays},
               {"LTRF", FileKind::kRays},
               {"IESNA", FileKind::kIntensity},
               {"IES:LM-63", FileKind::kIntensity},
               {"#?", FileKind::kRadianceHdr},
               {"\x89PNG", FileKind::kPhotograph},
               {"\xff\xd8\xff", FileKind::kPhotograph},
               {std::string_view("II*\0", 4), FileKind::kPhotograph},
               {std::string_view("MM\0*", 4), FileKind::kPhotograph},
               {"<!DOCTYPE html", FileKind::kHtml},
               {"<!doctype html", FileKind::kHtml},
               {"glTF", FileKind::kMesh},
               {"ply\n", FileKind::kMesh},
               {"ply\r", FileKind::kMesh}},
              bytes, FileKind::kUnknown);
  if (by_magic == FileKind::kExrPicture) return OfExr(bytes);
  if (by_magic != FileKind::kUnknown) return by_magic;
  const std::string extension = LowerExtension(path);
  if (bytes.starts_with("{") && extension != ".gltf") return OfJson(bytes);
  if (extension == ".toml") return OfToml(bytes);
  const auto is = [&](std::initializer_list<const char*> extensions) {
    return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
  };
  if (is({".ies", ".ldt", ".gldf"}) || IsTm33(bytes)) return FileKind::kIntensity;
  if (IsRays(bytes, extension, fs::file_size(path, error)) || HasLine(bytes, "lt_rdf_version"))
    return FileKind::kRays;
  if (is({".ray", ".dis"})) return FileKind::kForeignRays;
  if (is({".obj", ".gltf", ".stl"})) return FileKind::kMesh;
  return FileKind::kUnknown;
}

std::string NameOf(FileKind kind) {
  switch (kind) {
    case FileKind::kUnknown:
      return "no file that luxfield knows";
    case FileKind::kFolder:
      return "a folder";
    case FileKind::kSession:
      return "a session";
    case FileKind::kLightFieldSession:
      return "a session (of a light field)";
    case FileKind::kSensorSession:
      return "a session that calibrates a sensor";
    case FileKind::kGeometrySession:
      return "a session that calibrates a geometry";
    case FileKind::kGlareSession:
      return "a session that measures glare";
    case FileKind::kFilterSession:
      return "a session that photographs a filter";
    case FileKind::kEnvironmentFrames:
      return "a folder of pictures";
    case FileKind::kPlan:
      return "a plan";
    case FileKind::kLab:
      return "a lab";
    case FileKind::kScene:
      return "a scene";
    case FileKind::kMotionPath:
      return "a path of cameras and lamps (path.toml)";
    case FileKind::kMeasurements:
      return "a file of measurements (.meas.exr)";
    case FileKind::kLightField:
      return "a light field (.lf.exr)";
    case FileKind::kTables:
      return "a file of tables (.tab.exr)";
    case FileKind::kMeasuredFilter:
      return "a measured filter (.filter.exr)";
    case FileKind::kFlatField:
      return "a flat field (.flat.exr)";
    case FileKind::kExrPicture:
      return "an OpenEXR picture";
    case FileKind::kSensorCalibration:
      return "the calibration of a sensor (.cal.json)";
    case FileKind::kGeometryCalibration:
      return "the calibration of a geometry (.cal.json)";
    case FileKind::kGlareCalibration:
      return "the calibration of glare (.cal.json)";
    case FileKind::kResponseCalibration:
      return "the calibration of a response (.cal.json)";
    case FileKind::kFilterSheet:
      return "the sheet of a printed filter (.sheet.json)";
    case FileKind::kFigures:
      return "the figures of a verb (--json)";
    case FileKind::kRays:
      return "a ray file of TM-25, Zemax, LightTools or Speos";
    case FileKind::kIntensity:
      return "a photometric file (a far field alone)";
    case FileKind::kForeignRays:
      return "a ray file of no public layout, as of ASAP or LucidShape";
    case FileKind::kRadianceHdr:
      return "a Radiance .hdr picture";
    case FileKind::kPhotograph:
      return "a PNG, JPEG or TIFF picture";
    case FileKind::kMesh:
      return "a mesh";
    case FileKind::kHtml:
      return "an HTML page";
  }
  return {};
}

bool IsSession(FileKind kind) {
  return kind >= FileKind::kSession && kind <= FileKind::kFilterSession;
}

}  // namespace luxfield::core
