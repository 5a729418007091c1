#include "luxfield/web/lamp_volume_json.h"

#include <array>
#include <stdexcept>

#include "luxfield/core/error.h"

namespace luxfield::web {
namespace {

std::string IlluminanceUnit(lightfield::FluxUnit unit) {
  switch (unit) {
    case lightfield::FluxUnit::kLumen:
      return "lx";
    case lightfield::FluxUnit::kWatt:
      return "W/m\u00b2";
    case lightfield::FluxUnit::kRelative:
      return "relative";
  }
  throw std::logic_error("unknown flux unit");
}

std::array<double, 4> Numbers(const Rectangle& r) {
  return {r.middle.x, r.middle.y, r.half.x, r.half.y};
}

Rectangle RectangleOf(const core::Json& numbers) {
  return {{numbers.at(0), numbers.at(1)}, {numbers.at(2), numbers.at(3)}};
}

LampTable TableOf(const core::Json& stated, const std::vector<std::uint8_t>& packed, int channels) {
  LampTable table;
  table.side = stated.at("side") == "front" ? Side::kFront : Side::kBetween;
  table.w_first = stated.at("first");
  table.w_last = stated.at("last");
  const core::Json& nodes = stated.at("nodes");
  table.size = {nodes.at(0), nodes.at(1), nodes.at(2)};
  for (const int n : {table.size.x, table.size.y, table.size.w})
    if (n < 4 || n > 4096) throw InputError("a table's nodes make no sense");
  if (3 * channels * table.size.coefficients() > kMostCodes)
    throw InputError("a table's nodes make no sense");
  for (int k = 0; k < 3 * channels; ++k)
    table.quantisation.push_back({stated.at("knees").at(k), stated.at("steps").at(k)});
  table.codes = UnpackCodes(packed, table.size, channels);
  FillFromCodes(table, channels);
  return table;
}

}  // namespace

core::Json VolumeJson(const FittedVolume& fitted) {
  const LampVolume& volume = fitted.volume;
  core::Json json{{"format", "luxfield lamp volume"},
                  {"version", 1},
                  {"delta_m", volume.delta_m},
                  {"channels", volume.channels},
                  {"unit", IlluminanceUnit(volume.unit)},
                  {"on_f", Numbers(volume.bounds.on_f)},
                  {"on_i", Numbers(volume.bounds.on_i)},
                  {"floor_share", kFloorShare},
                  {"stated_error", fitted.stated_error()}};
  for (const LampTable& table : volume.tables) {
    core::Json one{{"side", table.side == Side::kFront ? "front" : "between"},
                   {"first", table.w_first},
                   {"last", table.w_last},
                   {"nodes", {table.size.x, table.size.y, table.size.w}}};
    for (const Quantisation& q : table.quantisation) {
      one["knees"].push_back(q.knee);
      one["steps"].push_back(q.step);
    }
    json["tables"].push_back(one);
  }
  for (const ErrorZone& zone : fitted.zones)
    json["zones"].push_back({{"z_first_m", zone.z_first_m},
                             {"z_last_m", zone.z_last_m},
                             {"about_image_plane", zone.on_image_plane},
                             {"stated_error", zone.stated_error},
                             {"rel_rmse", zone.rel_rmse},
                             {"receivers", zone.receivers}});
  return json;
}

FittedVolume VolumeFromJson(
    const core::Json& json,
    const std::function<std::vector<std::uint8_t>(const core::Json& table)>& codes,
    const std::string& file) {
  const InputError damaged(file, "holds no whole lamp", "export it again with 'luxfield export'");
  FittedVolume read;
  try {
    read.volume.delta_m = json.at("delta_m");
    read.volume.channels = json.at("channels");
    if (read.volume.channels != 1 && read.volume.channels != 3) throw damaged;
    read.volume.unit = json.at("unit") == "lx"         ? lightfield::FluxUnit::kLumen
                       : json.at("unit") == "relative" ? lightfield::FluxUnit::kRelative
                                                       : lightfield::FluxUnit::kWatt;
    read.volume.bounds = {RectangleOf(json.at("on_f")), RectangleOf(json.at("on_i"))};
    std::size_t count = 0;
    for (const core::Json& table : json.at("tables")) {
      read.volume.tables.push_back(TableOf(table, codes(table), read.volume.channels));
      count += read.volume.tables.back().codes.size();
      if (count > kMostCodes) throw damaged;
    }
    for (const core::Json& zone : json.at("zones"))
      read.zones.push_back({zone.at("z_first_m"), zone.at("z_last_m"), zone.at("about_image_plane"),
                            zone.at("stated_error"), zone.at("rel_rmse"), zone.at("receivers")});
  } catch (const core::Json::exception&) {
    throw damaged;
  } catch (const InputError&) {
    throw damaged;
  }
  if (read.volume.tables.empty()) throw damaged;
  return read;
}

}  // namespace luxfield::web
