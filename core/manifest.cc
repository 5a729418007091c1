#include "core/manifest.h"

#include "core/json.h"
#include "core/session_path.h"

namespace luxfield::core {

std::string FormatManifest(const Manifest& manifest) {
  Json files = Json::array();
  for (const ManifestFile& file : manifest.files)
    files.push_back({{"file", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  return Json{{"journal_head", manifest.journal_head}, {"files", files}}.dump(2) + "\n";
}

Manifest ParseManifest(std::string_view text, const std::string& file) {
  const Json json = ParseJson(text, file);
  Manifest manifest;
  manifest.journal_head = Field<std::string>(json, "journal_head", file);
  for (const Json& entry : Field<Json>(json, "files", file)) {
    manifest.files.push_back({Field<std::string>(entry, "file", file),
                              Field<std::uint64_t>(entry, "bytes", file),
                              Field<std::string>(entry, "sha256", file)});
    CheckSessionFileName(manifest.files.back().name, file);
  }
  return manifest;
}

}  // namespace luxfield::core
