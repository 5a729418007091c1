#include "luxfield/hal/drivers/gphoto2/decoder_process.h"

#if LUXFIELD_GPHOTO2

#include <optional>

#include "luxfield/core/apart.h"
#include "luxfield/core/printable.h"
#include "luxfield/hal/error.h"

namespace luxfield::hal::gphoto2 {
namespace {

constexpr char kOperation[] = "read RAW";
constexpr std::size_t kMemoryPerPixel = 32;  // of LibRaw, which keeps the picture twice
constexpr std::size_t kLongestText = 512;
constexpr char kPicture = 'P', kFault = 'F';

// Of a child that may have been damaged before it answered: any bytes.
std::string Text(core::ApartReader& reader) {
  return core::Printable(reader.Value<std::string>(), kLongestText);
}

void Answer(const std::function<RawFile()>& decode, core::ApartWriter& writer) {
  try {
    const RawFile file = decode();
    writer(kPicture, file.image.width, file.image.height, file.image.dn, file.cfa, file.exposure_s,
           file.temperature_c);
  } catch (const HardwareError& error) {
    writer(kFault, error.fault, error.operation, error.problem, error.remedy);
  }
}

}  // namespace

RawFile DecodeApart(const std::function<RawFile()>& decode, const std::string& device,
                    std::size_t most_pixels, double within_s) {
  const auto failed = [&](const std::string& problem) {
    return HardwareError(Fault::kIncomplete, device, kOperation, problem,
                         "check the cable, then resume; set another RAW format if it goes on");
  };
  core::ApartLimits limits;
  limits.processor_s = limits.wall_s = within_s;
  limits.memory_bytes += kMemoryPerPixel * most_pixels;
  limits.interruptible = false;
  RawFile file;
  std::optional<HardwareError> refused;
  const auto take = [&](core::ApartReader& reader) {
    if (reader.Value<char>() == kPicture) {
      reader(file.image.width, file.image.height, file.image.dn);
      file.cfa = Text(reader);
      reader(file.exposure_s, file.temperature_c);
      return;
    }
    const auto fault = static_cast<int>(reader.Value<Fault>());
    const std::string operation = Text(reader), problem = Text(reader), remedy = Text(reader);
    if (fault >= 0 && fault <= static_cast<int>(Fault::kIncomplete))
      refused.emplace(static_cast<Fault>(fault), device, operation, problem, remedy);
  };
  try {
    core::Apart(
        limits, [&](core::ApartWriter& writer) { Answer(decode, writer); }, take);
  } catch (const core::ApartError& error) {
    if (error.why == core::ApartError::Why::kNoProcess)
      throw HardwareError(Fault::kRefused, device, kOperation, error.what(),
                          "end other programs, then resume");
    throw failed(std::string("the file ") + error.what());
  }
  if (refused) throw *refused;
  if (file.image.width < 1 || file.image.height < 1 || file.image.size() > most_pixels ||
      file.image.dn.size() != file.image.size())
    throw failed("the decoder had no answer to the file");
  return file;
}

}  // namespace luxfield::hal::gphoto2

#endif
