#include "luxfield/cli/reports/rounded_number.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace luxfield::cli {
namespace {

constexpr int kSmallest = -5, kLargest = 9;  // powers of ten that are written out
constexpr int kMostDigits = 12;

// The power of ten of a value's first digit, once it is rounded to some digits.
int PowerOf(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  return std::stoi(text.substr(text.find('e') + 1));
}

bool IsWrittenOut(int power) { return power >= kSmallest && power < kLargest; }

// Rounded at 10^-decimals.
std::string Fixed(double value, int decimals) {
  const double step = std::pow(10.0, -decimals);
  if (decimals < 0) value = std::round(value / step) * step;
  std::string text = fmt::format("{:.{}f}", value, std::max(decimals, 0));
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  if (is_zero && text[0] == '-') text.erase(0, 1);
  return text;
}

}  // namespace

std::string Digits(double value, int digits) {
  if (value == 0) return "0";  // of -0 too
  const int power = PowerOf(value, digits);
  if (power >= digits && IsWrittenOut(power)) return Fixed(value, digits - 1 - power);
  return fmt::format("{:.{}g}", value, digits);
}

std::string RoundedTo(double value, const std::optional<double>& u) {
  if (!u || !(*u > 0)) return Digits(value);
  const int last = PowerOf(*u, 2) - 1;
  if (std::abs(value) < 0.5 * std::pow(10.0, last)) value = 0;
  const int first =
      value == 0 ? last + 1 : PowerOf(value, std::max(1, PowerOf(value, 1) - last + 1));
  if (!IsWrittenOut(std::max(first, last + 1)))
    return value == 0 ? "0"
                      : fmt::format("{:.{}e}", value, std::clamp(first - last, 0, kMostDigits - 1));
  return Fixed(value, std::min(-last, kMostDigits - 1 - first));
}

std::string UncertaintyText(double u) { return u > 0 ? RoundedTo(u, u) : Digits(u, 2); }

}  // namespace luxfield::cli
