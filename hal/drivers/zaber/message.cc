#include "luxfield/hal/drivers/zaber/message.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <utility>

namespace luxfield::hal::zaber {
namespace {

std::string_view TakeWord(std::string_view& text) {
  const auto at = text.find(' ');
  const std::string_view word = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return word;
}

std::optional<int> Parse(std::string_view text, int base = 10) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return {};
  return value;
}

// Removes ":LRC" where there is one; false if it is wrong.
bool CheckAndDropChecksum(std::string_view& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || text.size() - colon != 3) return true;
  const auto stated = Parse(text.substr(colon + 1), 16);
  text = text.substr(0, colon);
  return stated && *stated == Checksum(text);
}

template <typename Kind>
bool ParseState(std::string_view& text, Kind& message) {
  const std::string_view state = TakeWord(text);
  message.warning = TakeWord(text);
  message.busy = state == "BUSY";
  return (message.busy || state == "IDLE") && message.warning.size() == 2;
}

template <typename Kind>
bool ParseSender(std::string_view& text, Kind& message) {
  const auto device = Parse(TakeWord(text)), axis = Parse(TakeWord(text));
  if (!device || !axis || *device > 99 || *axis > 9) return false;
  message.device = *device;
  message.axis = *axis;
  return true;
}

std::optional<Reply> ParseReply(std::string_view text) {
  Reply reply;
  if (!ParseSender(text, reply)) return {};
  std::string_view flag = TakeWord(text);
  if (const auto id = Parse(flag)) {
    reply.id = id;
    flag = TakeWord(text);
  }
  reply.accepted = flag == "OK";
  if ((!reply.accepted && flag != "RJ") || !ParseState(text, reply) || text.empty()) return {};
  reply.data = text;
  return reply;
}

std::optional<Alert> ParseAlert(std::string_view text) {
  Alert alert;
  if (!ParseSender(text, alert) || !ParseState(text, alert)) return {};
  return alert;
}

using Meanings = std::pair<std::string_view, std::string_view>;

template <std::size_t size>
std::string_view Find(const std::array<Meanings, size>& table, std::string_view key) {
  for (const auto& [name, meaning] : table)
    if (name == key) return meaning;
  return {};
}

}  // namespace

std::uint8_t Checksum(std::string_view text) {
  unsigned sum = 0;
  for (const char c : text) sum += static_cast<unsigned char>(c);
  return static_cast<std::uint8_t>(0u - sum);
}

Message ParseMessage(std::string_view line) {
  std::string_view text = line.substr(line.empty() ? 0 : 1);
  if (CheckAndDropChecksum(text)) {
    if (line.starts_with('@'))
      if (auto reply = ParseReply(text)) return *std::move(reply);
    if (line.starts_with('!'))
      if (auto alert = ParseAlert(text)) return *std::move(alert);
  }
  return Other{std::string(line)};
}

std::string Command(int device, int axis, int id, std::string_view text) {
  const std::string body =
      fmt::format("{} {} {}{}{}", device, axis, id, text.empty() ? "" : " ", text);
  return fmt::format("/{}:{:02X}\n", body, Checksum(body));
}

std::string_view WarningMeaning(std::string_view flag) {
  static constexpr std::array<Meanings, 15> kTable = {{{"FF", "critical system error"},
                                                       {"FD", "driver disabled"},
                                                       {"FQ", "encoder error"},
                                                       {"FS", "stalled and stopped"},
                                                       {"FE", "limit error"},
                                                       {"FR", "overdrive limit exceeded"},
                                                       {"FX", "unexpected trigger of a limit"},
                                                       {"FO", "peripheral is inactive"},
                                                       {"WR", "no reference position"},
                                                       {"WH", "device is not homed"},
                                                       {"WM", "displaced when stationary"},
                                                       {"WV", "supply voltage out of range"},
                                                       {"WT", "system temperature high"},
                                                       {"NC", "moved by its knob"},
                                                       {"NI", "interrupted by another command"}}};
  return Find(kTable, flag);
}

std::string_view RejectionMeaning(std::string_view data) {
  static constexpr std::array<Meanings, 8> kTable = {
      {{"BADDATA", "the value is out of range"},
       {"BADCOMMAND", "the command is unknown"},
       {"BADAXIS", "there is no such axis"},
       {"AGAIN", "it cannot do that now"},
       {"STATUSBUSY", "it is moving"},
       {"LOCKSTEP", "its axes are coupled"},
       {"PARKED", "it is parked"},
       {"DRIVERDISABLED", "its driver is disabled"}}};
  return Find(kTable, data);
}

}  // namespace luxfield::hal::zaber
