// Codes of a lamp's table as bytes, and back.
#include <zlib.h>

#include "luxfield/core/error.h"
#include "luxfield/web/lamp_volume.h"

namespace luxfield::web {
namespace {

constexpr int kComponents = 3;

// What the neighbours before a code say that it is: left + below - both, of those that are there.
int Predicted(const std::int16_t* code, std::size_t x, std::size_t y, std::size_t line) {
  const int left = x > 0 ? code[-1] : 0;
  const int below = y > 0 ? *(code - line) : 0;
  const int both = x > 0 && y > 0 ? *(code - line - 1) : 0;
  return left + below - both;
}

// 0, -1, 1, -2 ... to 0, 1, 2, 3 ...
std::uint16_t Unsigned(int difference) {
  return static_cast<std::uint16_t>(difference < 0 ? -2 * difference - 1 : 2 * difference);
}

int Signed(std::uint16_t number) { return number % 2 ? -(number + 1) / 2 : number / 2; }

}  // namespace

std::vector<std::uint8_t> PackCodes(const LampTable& table, int channels) {
  const TableSize& size = table.size;
  const std::size_t line = size.x + 2, lines = size.y + 2,
                    slices = static_cast<std::size_t>(size.w + 2) * kComponents * channels,
                    count = slices * lines * line;
  std::vector<std::uint8_t> bytes(2 * count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::int16_t* code = table.codes.data() + k;
    const std::uint16_t number =
        Unsigned(*code - Predicted(code, k % line, k / line % lines, line));
    bytes[k] = static_cast<std::uint8_t>(number & 0xff);
    bytes[count + k] = static_cast<std::uint8_t>(number >> 8);
  }
  uLongf packed_size = compressBound(bytes.size());
  std::vector<std::uint8_t> packed(packed_size);
  if (compress(packed.data(), &packed_size, bytes.data(), bytes.size()) != Z_OK)
    throw std::bad_alloc();
  packed.resize(packed_size);
  return packed;
}

std::vector<std::int16_t> UnpackCodes(const std::vector<std::uint8_t>& packed,
                                      const TableSize& size, int channels) {
  const std::size_t line = size.x + 2, lines = size.y + 2,
                    slices = static_cast<std::size_t>(size.w + 2) * kComponents * channels,
                    count = slices * lines * line;
  std::vector<std::uint8_t> bytes(2 * count);
  uLongf unpacked = bytes.size();
  if (uncompress(bytes.data(), &unpacked, packed.data(), packed.size()) != Z_OK ||
      unpacked != bytes.size())
    throw InputError("the codes of a lamp's volume are damaged, or of another size than stated");
  std::vector<std::int16_t> codes(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto number = static_cast<std::uint16_t>(bytes[k] | bytes[count + k] << 8);
    codes[k] = static_cast<std::int16_t>(
        Signed(number) + Predicted(codes.data() + k, k % line, k / line % lines, line));
  }
  return codes;
}

}  // namespace luxfield::web
