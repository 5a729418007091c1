// The Zaber ASCII protocol, a line at a time (Zaber "ASCII Protocol Manual").
//
//   command  /device axis id text[:LRC]
//   reply    @device axis id OK|RJ BUSY|IDLE warning data[:LRC]
//   alert    !device axis BUSY|IDLE warning       said unasked
//   info     #device axis text
//
// LRC: two hexadecimal digits that make the sum of all bytes from behind the first character up to
// the colon, and of the number itself, a multiple of 256.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace luxfield::hal::zaber {

struct Reply {
  int device = 0, axis = 0;
  std::optional<int> id;  // of the command, 0 to 99
  bool accepted = false;  // OK; else data says why
  bool busy = false;      // moving
  std::string warning;    // "--": none
  std::string data;
};
struct Alert {
  int device = 0, axis = 0;
  bool busy = false;
  std::string warning;
};
// An info line, or something damaged.
struct Other {
  std::string text;
};
using Message = std::variant<Reply, Alert, Other>;

std::uint8_t Checksum(std::string_view text);

// Never throws; lines whose checksum is wrong are Other.
Message ParseMessage(std::string_view line);

// "/1 2 5 move abs 1000:XX\n"
std::string Command(int device, int axis, int id, std::string_view text);

// What a warning flag or the reason of a rejection means; empty if it is not known.
std::string_view WarningMeaning(std::string_view flag);
std::string_view RejectionMeaning(std::string_view data);

}  // namespace luxfield::hal::zaber
