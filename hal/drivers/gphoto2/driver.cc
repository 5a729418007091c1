#include "luxfield/hal/drivers/gphoto2/driver.h"

namespace luxfield::hal::gphoto2 {
namespace {

DescribedCamera Read(const core::Config& camera) {
  const Gphoto2Options options = ReadOptions(camera);
  DescribedCamera described;
  described.bits = options.bits;
  described.cfa = options.cfa;
  described.mosaic_field = "mosaic";
  described.settings = {{"driver", "gphoto2"}};
  for (const auto& [name, value] : options.settings) described.settings["setting " + name] = value;
#if LUXFIELD_GPHOTO2
  described.open = [options](std::shared_ptr<core::Clock> clock, const std::shared_ptr<Trigger>&) {
    return std::make_unique<Gphoto2Camera>(options, std::move(clock));
  };
#endif
  return described;
}

#if LUXFIELD_GPHOTO2
std::vector<AttachedDevice> Attached() {
  std::vector<AttachedDevice> devices;
  for (const Gphoto2Device& camera : ListGphoto2Devices())
    devices.push_back({"gphoto2", camera.port, camera.model, camera.problem});
  return devices;
}
#endif

}  // namespace

Gphoto2Options ReadOptions(const core::Config& camera) {
  Gphoto2Options options;
  options.port = camera.Text("port", "");
  const auto size = camera.Numbers("size_px", 2);
  for (const double side : size)
    if (side < 1 || side > 1e5 || side != static_cast<int>(side))
      camera.Fail("size_px", "must be whole numbers of pixels", "give width, height");
  options.width = static_cast<int>(size[0]);
  options.height = static_cast<int>(size[1]);
  options.bits = camera.Integer("bits", options.bits, 8, 16);
  options.cfa = camera.Choice("mosaic", {"RGGB", "BGGR", "GRBG", "GBRG", "none"});
  if (options.cfa == "none") options.cfa.clear();
  options.shutter_speed = camera.Text("shutter_speed", options.shutter_speed);
  for (const core::Config& setting : camera.Tables("setting"))
    options.settings.emplace_back(setting.Text("name"), setting.Text("value"));
  options.readout_s = camera.Number("readout_s", options.readout_s, {0, 100});
  return options;
}

Driver Description() {
  Driver driver{"gphoto2",
                "still cameras over PTP, by their RAW files",
                bool(LUXFIELD_GPHOTO2),
                "libgphoto2-dev and libraw-dev",
                Read,
                {},
                {}};
#if LUXFIELD_GPHOTO2
  driver.attached = Attached;
#endif
  return driver;
}

}  // namespace luxfield::hal::gphoto2
