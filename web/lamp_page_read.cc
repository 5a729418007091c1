// Reading a lamp's page back (docs/web.md, "The volume").
#include <algorithm>
#include <array>
#include <cmath>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/json.h"
#include "luxfield/core/outputs.h"
#include "luxfield/web/lamp_page.h"

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

Rectangle RectangleOf(const core::Json& numbers) {
  return {{numbers.at(0), numbers.at(1)}, {numbers.at(2), numbers.at(3)}};
}

LampTable TableOf(const core::Json& stated, int channels) {
  LampTable table;
  table.side = stated.at("side") == "front" ? Side::kFront : Side::kBetween;
  table.w_first = stated.at("first");
  table.w_last = stated.at("last");
  const core::Json& nodes = stated.at("nodes");
  table.size = {nodes.at(0), nodes.at(1), nodes.at(2)};
  for (const int n : {table.size.x, table.size.y, table.size.w})
    if (n < 4 || n > 4096) throw InputError("a table's nodes make no sense");
  for (int k = 0; k < 3 * channels; ++k)
    table.quantisation.push_back({stated.at("knees").at(k), stated.at("steps").at(k)});
  table.codes =
      UnpackCodes(BytesOfBase64(stated.at("codes").get<std::string>()), table.size, channels);
  FillFromCodes(table, channels);
  return table;
}

}  // namespace

FittedVolume ReadLampPage(const std::filesystem::path& path) {
  const std::string file = path.string(), text = core::ReadFile(core::ReadableAt(path));
  const auto begin = text.find(kOpening);
  const auto end = begin == text.npos ? text.npos : text.find("\n</script>", begin);
  if (end == text.npos) Damaged(file);
  const core::Json json = core::ParseJson(
      std::string_view(text).substr(begin + kOpening.size(), end - begin - kOpening.size()), file);
  FittedVolume read;
  try {
    read.volume.delta_m = json.at("delta_m");
    read.volume.channels = json.at("channels");
    if (read.volume.channels != 1 && read.volume.channels != 3) Damaged(file);
    read.volume.unit = json.at("unit") == "lx"         ? lightfield::FluxUnit::kLumen
                       : json.at("unit") == "relative" ? lightfield::FluxUnit::kRelative
                                                       : lightfield::FluxUnit::kWatt;
    read.volume.bounds = {RectangleOf(json.at("on_f")), RectangleOf(json.at("on_i"))};
    for (const core::Json& table : json.at("tables"))
      read.volume.tables.push_back(TableOf(table, read.volume.channels));
    for (const core::Json& zone : json.at("zones"))
      read.zones.push_back({zone.at("z_first_m"), zone.at("z_last_m"), zone.at("about_image_plane"),
                            zone.at("stated_error"), zone.at("rel_rmse"), zone.at("receivers")});
  } catch (const core::Json::exception&) {
    Damaged(file);
  } catch (const InputError&) {
    Damaged(file);
  }
  if (read.volume.tables.empty()) Damaged(file);
  return read;
}

}  // namespace luxfield::web
