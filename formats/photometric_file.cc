#include "luxfield/formats/photometric_file.h"

#include <algorithm>
#include <cctype>

#include "luxfield/core/input_file.h"
#include "luxfield/formats/eulumdat.h"
#include "luxfield/formats/gldf.h"
#include "luxfield/formats/lm63.h"
#include "luxfield/formats/text_reader.h"
#include "luxfield/formats/tm33.h"
#include "luxfield/formats/zip.h"

namespace luxfield::formats {
namespace {

// A line that begins with TILT=, which every LM-63 file has.
bool HasTilt(std::string_view text) {
  for (auto at = text.find('='); at != std::string_view::npos; at = text.find('=', at + 1)) {
    std::size_t begin = at;
    while (begin > 0 && std::isalpha(static_cast<unsigned char>(text[begin - 1]))) --begin;
    std::string word(text.substr(begin, at - begin));
    std::transform(word.begin(), word.end(), word.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    if (word == "TILT") return true;
  }
  return false;
}

bool IsXml(std::string_view text) {
  if (text.starts_with("\xFE\xFF") || text.starts_with("\xFF\xFE")) return true;  // UTF-16
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return Trimmed(text).starts_with('<');
}

// Of members, or without any.
bool IsZip(std::string_view bytes) {
  return bytes.starts_with("PK\x03\x04") || bytes.starts_with("PK\x05\x06");
}

}  // namespace

Photometry ParsePhotometry(std::string_view text, const std::string& file) {
  if (IsXml(text)) return ParseTm33(text, file);
  const bool lm63 = text.starts_with("IES") || HasTilt(text);
  return lm63 ? ParseLm63(text, file) : ParseEulumdat(text, file);
}

Photometry ReadPhotometry(const std::filesystem::path& path) {
  const std::string bytes = core::ReadAtMost(path, kMostText);
  return IsZip(bytes) ? ParseGldf(bytes, path.string()) : ParsePhotometry(bytes, path.string());
}

std::optional<LampShape> ReadLampShape(const std::filesystem::path& path) {
  const std::string bytes = core::ReadAtMost(path, kMostText);
  if (!IsZip(bytes)) return {};
  if (ZipReader(bytes, path.string()).Has("product.xml"))
    return ParseGldfShape(bytes, path.string());
  return ParseL3d(bytes, path.string());
}

}  // namespace luxfield::formats
