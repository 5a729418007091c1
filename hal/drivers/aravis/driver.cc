#include "luxfield/hal/drivers/aravis/driver.h"

#include <fmt/format.h>

#include "luxfield/hal/drivers/aravis/pixel_format.h"

namespace luxfield::hal::aravis {
namespace {

// The mosaic of a Bayer format, as rig/cfa.h has it: the format names the first row's colours.
std::string MosaicOf(const std::string& pixel_format) {
  if (!pixel_format.starts_with("Bayer")) return "";
  const std::string row = pixel_format.substr(5, 2);
  return row == "RG" ? "RGGB" : row == "GR" ? "GRBG" : row == "GB" ? "GBRG" : "BGGR";
}

std::map<std::string, std::string> SettingsOf(const AravisOptions& options) {
  std::map<std::string, std::string> settings = {{"driver", "aravis"},
                                                 {"pixel_format", options.pixel_format},
                                                 {"gain_db", fmt::format("{}", options.gain_db)}};
  if (const auto& r = options.region)
    settings["region_px"] = fmt::format("{}, {}, {}, {}", r->x, r->y, r->width, r->height);
  if (const auto& line = options.line_trigger) {
    settings["trigger_source"] = line->source;
    settings["trigger_activation"] = line->activation;
  }
  return settings;
}

DescribedCamera Read(const core::Config& camera) {
  const AravisOptions options = ReadOptions(camera);
  const auto format = FindPixelFormat(options.pixel_format);
  if (!format)
    camera.Fail("pixel_format", "is \"" + options.pixel_format + "\", which is not read",
                "choose one of " + PixelFormatNames());
  DescribedCamera described;
  described.bits = format->bits;
  described.cfa = MosaicOf(options.pixel_format);
  described.mosaic_field = "pixel_format";
  described.settings = SettingsOf(options);
  described.needs_trigger = options.line_trigger.has_value();
#if LUXFIELD_ARAVIS
  described.open = [options](std::shared_ptr<core::Clock> clock, std::shared_ptr<Trigger> trigger) {
    return std::make_unique<AravisCamera>(options, std::move(clock), std::move(trigger));
  };
#endif
  return described;
}

#if LUXFIELD_ARAVIS
std::vector<AttachedDevice> Attached() {
  std::vector<AttachedDevice> devices;
  for (const AravisDevice& camera : ListAravisDevices())
    devices.push_back({"aravis",
                       camera.id,
                       fmt::format("{} {} {}, {} at {}", camera.vendor, camera.model, camera.serial,
                                   camera.protocol, camera.address),
                       {}});
  return devices;
}
#endif

}  // namespace

AravisOptions ReadOptions(const core::Config& camera) {
  AravisOptions options;
  options.id = camera.Text("id", "");
  options.pixel_format = camera.Text("pixel_format", options.pixel_format);
  options.gain_db = camera.Number("gain_db", 0, {-100, 100});
  if (camera.Has("region_px")) {
    const auto r = camera.Numbers("region_px", 4);
    for (const double value : r)
      if (value < 0 || value > 1e6 || value != static_cast<int>(value))
        camera.Fail("region_px", "must be whole numbers of pixels", "give x, y, width, height");
    options.region = {static_cast<int>(r[0]), static_cast<int>(r[1]), static_cast<int>(r[2]),
                      static_cast<int>(r[3])};
  }
  options.readout_s = camera.Number("readout_s", options.readout_s, {0, 100});
  if (camera.Has("trigger_source")) {
    LineTrigger& trigger = options.line_trigger.emplace();
    trigger.source = camera.Text("trigger_source");
    if (trigger.source.empty() || trigger.source == "Software")
      camera.Fail("trigger_source", "is \"" + trigger.source + "\", which is no input of a camera",
                  "name the one that [trigger] is wired to, such as \"Line0\", or leave it out");
    trigger.activation =
        camera.Choice("trigger_activation", {"RisingEdge", "FallingEdge"}, trigger.activation);
  }
  return options;
}

Driver Description() {
  Driver driver{"aravis",
                "GigE Vision and USB3 Vision cameras",
                bool(LUXFIELD_ARAVIS),
                "libaravis-dev",
                Read,
                {},
                {}};
#if LUXFIELD_ARAVIS
  driver.attached = Attached;
#endif
  return driver;
}

}  // namespace luxfield::hal::aravis
