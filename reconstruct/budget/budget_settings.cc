#include "luxfield/reconstruct/budget/budget_settings.h"

#include <fmt/format.h>

#include <cmath>

namespace luxfield::reconstruct {
namespace {

using core::Config;

std::optional<double> Size(const Config& table, const char* key, double max) {
  if (!table.Has(key)) return {};
  return table.Number(key, {0, max});
}

ErrorSizes ReadSizes(const Config& table) {
  constexpr double kLargestLength_m = 0.1, kHalf = 0.5;
  ErrorSizes sizes;
  sizes.shutter_jitter_s = Size(table, "shutter_jitter_s", 1);
  sizes.exposure_time_s = Size(table, "exposure_time_s", 1);
  sizes.lamp_wander = Size(table, "lamp_wander", kHalf);
  if (sizes.lamp_wander)
    sizes.lamp_wander_period_s = table.Number("lamp_wander_period_s", {1e-3, 1e9});
  sizes.monitor = Size(table, "monitor", kHalf);
  sizes.stage_m = Size(table, "stage_m", kLargestLength_m);
  sizes.image_shift_m = Size(table, "image_shift_m", kLargestLength_m);
  sizes.print_shift_m = Size(table, "print_shift_m", kLargestLength_m);
  sizes.density = Size(table, "density", kHalf);
  sizes.density_gamma = Size(table, "density_gamma", kHalf);
  sizes.grain = Size(table, "grain", kHalf);
  if (sizes.grain) sizes.grain_area_m2 = table.Number("grain_area_m2", {0, 1});
  sizes.stray_share = Size(table, "stray_share", 1);
  if (table.Has("smallest_spot_m"))
    sizes.smallest_spot_m = table.Number("smallest_spot_m", {1e-6, 1});
  sizes.estimate_basis = table.Boolean("estimate_basis", true);
  return sizes;
}

lightfield::Vec2 Pair(const Config& table, const char* key) {
  const auto v = table.Numbers(key, 2);
  return {v[0], v[1]};
}

ReceiverAsked ReadReceiver(const Config& table) {
  ReceiverAsked receiver;
  const auto p = table.Numbers("p_m", 3), n = table.Numbers("normal", 3, {0, 0, -1});
  receiver.p_m = {p[0], p[1], p[2]};
  if (!(p[2] > 0)) table.Fail("p_m", "must lie before the filter plane", "give a z above 0");
  const lightfield::Vec3 normal{n[0], n[1], n[2]};
  if (!(lightfield::Length(normal) > 0)) table.Fail("normal", "has no direction");
  receiver.normal = lightfield::Normalized(normal);
  receiver.name =
      table.Text("name", fmt::format("irradiance at ({:.4g}, {:.4g}, {:.4g})", p[0], p[1], p[2]));
  return receiver;
}

Meter ReadMeter(const Config& table) {
  Meter meter;
  meter.calibration = table.Number("calibration", 0, {0, 0.5});
  meter.serial_number = table.Text("serial_number", "");
  meter.calibration_date = table.Text("calibration_date", "");
  meter.v_lambda = table.Text("v_lambda", "");
  for (const Config& reading : table.Tables("reading")) {
    MeterReading& r = meter.readings.emplace_back();
    r.at = ReadReceiver(reading);
    r.value = reading.Number("value", {1e-30, 1e30});
    r.sigma = reading.Number("sigma", {1e-30, 1e30});
  }
  if (meter.readings.empty()) table.Fail("reading", "is missing", "give at least one");
  return meter;
}

}  // namespace

BudgetSettings ReadBudgetSettings(const Config& config) {
  BudgetSettings settings;
  if (const auto table = config.OptionalTable("uncertainty")) settings.sizes = ReadSizes(*table);
  for (const Config& table : config.Tables("radiance")) {
    RayAsked ray{"", Pair(table, "u_m"), Pair(table, "s_m")};
    ray.name = table.Text("name", fmt::format("radiance ({:.4g}, {:.4g}) -> ({:.4g}, {:.4g})",
                                              ray.u_m.x, ray.u_m.y, ray.s_m.x, ray.s_m.y));
    settings.rays.push_back(std::move(ray));
  }
  for (const Config& table : config.Tables("irradiance"))
    settings.receivers.push_back(ReadReceiver(table));
  if (const auto table = config.OptionalTable("meter")) settings.meter = ReadMeter(*table);
  config.Finish();
  return settings;
}

}  // namespace luxfield::reconstruct
