#include "luxfield/core/printable.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>

namespace luxfield::core {
namespace {

bool IsObeyed(std::uint32_t code) {
  return (code < 0x20 && code != '\n' && code != '\t') || (code >= 0x7F && code < 0xA0) ||
         code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

void AppendEscaped(std::string_view bytes, std::string& to) {
  for (const char c : bytes) to += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
}

}  // namespace

// RFC 3629: shortest forms, no surrogates, nothing above U+10FFFF.
Character FirstCharacter(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(0);
  if (first < 0x80) return {1, first};
  const std::size_t bytes = first < 0xC2   ? 0
                            : first < 0xE0 ? 2
                            : first < 0xF0 ? 3
                            : first < 0xF5 ? 4
                                           : 0;
  if (bytes == 0) return {};
  std::uint32_t code = first & (0xFFu >> (bytes + 1));
  for (std::size_t k = 1; k < bytes; ++k) {
    if (k == text.size()) return {0, 0, true};
    if ((byte(k) & 0xC0) != 0x80) return {};
    code = (code << 6) | (byte(k) & 0x3Fu);
  }
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return {};
  return {bytes, code};
}

std::string VisibleText::Next(std::string_view piece) {
  const std::string text = waiting_ + std::string(piece);
  waiting_.clear();
  std::string shown;
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view left = std::string_view(text).substr(at);
    const Character next = FirstCharacter(left);
    if (next.cut_off) {
      waiting_ = left;
      break;
    }
    const std::string_view bytes = left.substr(0, std::max<std::size_t>(next.bytes, 1));
    if (next.bytes == 0 || IsObeyed(next.code))
      AppendEscaped(bytes, shown);
    else
      shown += bytes;
    at += bytes.size();
  }
  return shown;
}

std::string VisibleText::Rest() {
  std::string shown;
  AppendEscaped(waiting_, shown);
  waiting_.clear();
  return shown;
}

void ObeyedByTerminal(std::string_view sequence) {
  std::fflush(stderr);
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, sequence.data(), sequence.size());
}

std::string Visible(std::string_view text) {
  VisibleText visible;
  std::string shown = visible.Next(text);
  return shown + visible.Rest();
}

std::string OnOneLine(std::string_view text) {
  std::string shown = Visible(text);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  return shown;
}

std::string EscapedMarkup(std::string_view text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

std::string Printable(std::string_view text, std::size_t most) {
  std::string shown(text.substr(0, most));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return shown;
}

}  // namespace luxfield::core
