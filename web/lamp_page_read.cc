// Reading a lamp's page back (docs/web.md, "The volume").
#include <array>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/outputs.h"
#include "luxfield/web/lamp_page.h"
#include "luxfield/web/lamp_volume_json.h"

namespace luxfield::web {
namespace {

constexpr std::string_view kOpening = "<script type=\"application/json\" id=\"lamp\">\n";

[[noreturn]] void Damaged(const std::string& file) {
  throw InputError(file, "holds no whole lamp", "export it again with 'luxfield export'");
}

std::vector<std::uint8_t> BytesOfBase64(std::string_view text) {
  std::array<int, 256> value{};
  value.fill(-1);
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t k = 0; k < kDigits.size(); ++k)
    value[static_cast<unsigned char>(kDigits[k])] = static_cast<int>(k);
  std::vector<std::uint8_t> bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char c : text) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) break;  // the padding
    group = group << 6 | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<std::uint8_t>(group >> bits & 0xff));
  }
  return bytes;
}

}  // namespace

FittedVolume ReadLampPage(const std::filesystem::path& path) {
  const std::string file = path.string(), text = core::ReadFile(core::ReadableAt(path));
  const auto begin = text.find(kOpening);
  const auto end = begin == text.npos ? text.npos : text.find("\n</script>", begin);
  if (end == text.npos) Damaged(file);
  const core::Json json = core::ParseJson(
      std::string_view(text).substr(begin + kOpening.size(), end - begin - kOpening.size()), file);
  return VolumeFromJson(
      json,
      [](const core::Json& table) { return BytesOfBase64(table.at("codes").get<std::string>()); },
      file);
}

}  // namespace luxfield::web
