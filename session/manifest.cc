#include "luxfield/session/manifest.h"

#include "luxfield/core/json.h"
#include "luxfield/session/session_path.h"

namespace luxfield::session {

std::string FormatManifest(const Manifest& manifest) {
  core::Json files = core::Json::array();
  for (const ManifestFile& file : manifest.files)
    files.push_back({{"file", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  return core::Json{{"journal_head", manifest.journal_head}, {"files", files}}.dump(2) + "\n";
}

Manifest ParseManifest(std::string_view text, const std::string& file) {
  const core::Json json = core::ParseJson(text, file);
  Manifest manifest;
  manifest.journal_head = core::Field<std::string>(json, "journal_head", file);
  for (const core::Json& entry : core::Field<core::Json>(json, "files", file)) {
    manifest.files.push_back({core::Field<std::string>(entry, "file", file),
                              core::Field<std::uint64_t>(entry, "bytes", file),
                              core::Field<std::string>(entry, "sha256", file)});
    CheckSessionFileName(manifest.files.back().name, file);
  }
  return manifest;
}

}  // namespace luxfield::session
