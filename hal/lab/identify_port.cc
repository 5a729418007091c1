#include "luxfield/hal/lab/identify_port.h"

#include <fmt/format.h>

#include <algorithm>

#include "luxfield/hal/drivers/grbl/message.h"
#include "luxfield/hal/drivers/zaber/message.h"
#include "luxfield/hal/transport/line_reader.h"
#include "luxfield/hal/transport/open_port.h"

namespace luxfield::hal {
namespace {

constexpr double kGrbl_s = 3, kQuestion_s = 0.5, kZaber_s = 0.5;

// Real-time queries only: a line's end would execute what half a line is left in the controller.
Identification AskGrbl(ByteStream& port, LineReader& lines) {
  const SteadyTime end = SecondsFromNow(kGrbl_s);
  while (std::chrono::steady_clock::now() < end) {
    port.Write("?", end);
    const SteadyTime again = std::min(end, SecondsFromNow(kQuestion_s));
    while (const auto line = lines.Next(again)) {
      const grbl::Message message = grbl::ParseMessage(*line);
      if (const auto* welcome = std::get_if<grbl::Welcome>(&message))
        return {"grbl", true, welcome->firmware.name + " " + welcome->firmware.version};
      if (const auto* status = std::get_if<grbl::Status>(&message))
        return {"grbl", true, "Grbl, grblHAL or FluidNC, " + grbl::StateName(status->state)};
    }
  }
  return {"grbl", false, fmt::format("no status report within {} s of the first \"?\"", kGrbl_s)};
}

Identification AskZaber(ByteStream& port, LineReader& lines) {
  const SteadyTime end = SecondsFromNow(kZaber_s);
  port.Write("/get deviceid\n", end);
  std::string devices;
  while (const auto line = lines.Next(end)) {
    const zaber::Message message = zaber::ParseMessage(*line);
    if (const auto* reply = std::get_if<zaber::Reply>(&message))
      devices += fmt::format("{}{}: id {}", devices.empty() ? "device " : ", ", reply->device,
                             reply->data);
  }
  if (devices.empty())
    return {"zaber", false, fmt::format("no reply to \"/get deviceid\" within {} s", kZaber_s)};
  return {"zaber", true, devices};
}

}  // namespace

std::vector<Identification> IdentifyPort(const std::string& name, int baud) {
  const auto port = OpenPort(name, baud, SecondsFromNow(kGrbl_s));
  LineReader lines(*port);
  std::vector<Identification> answers{AskGrbl(*port, lines)};
  if (answers.front().takes)
    answers.push_back({"zaber", false, "the port speaks Grbl"});
  else
    answers.push_back(AskZaber(*port, lines));
  return answers;
}

}  // namespace luxfield::hal
