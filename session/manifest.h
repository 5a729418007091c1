// manifest.json of a sealed session (docs/formats/session.md): the one place that knows its fields.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::session {

struct ManifestFile {
  std::string name;  // relative to the session's folder
  std::uint64_t bytes = 0;
  std::string sha256;
};

struct Manifest {
  std::string journal_head;  // SHA-256 of the journal's last line
  std::vector<ManifestFile> files;
};

std::string FormatManifest(const Manifest& manifest);

// Throws InputError naming `file` and the field; names that leave the session are errors too.
Manifest ParseManifest(std::string_view text, const std::string& file);

}  // namespace luxfield::session
