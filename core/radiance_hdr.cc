#include "luxfield/core/radiance_hdr.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/primaries.h"
#include "luxfield/core/printable.h"

namespace luxfield::core {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 27;
// A scanline of 32767 equal pixels takes 12 bytes; nobody packs tighter. Keeps a short file from
// claiming gigabytes.
constexpr std::size_t kMostPixelsPerByte = 4096;
// What a picture takes in memory beyond what nobody asks about, as of OpenEXR files.
constexpr std::size_t kUnaskedBytes = std::size_t{1} << 29, kMostBytesPerByte = 100;
constexpr std::size_t kMaxLine = 2048;  // a header line that is longer is no text
// Scanlines of other lengths are never run-length coded by component (the two length bytes).
constexpr int kMinComponentRuns = 8, kMaxComponentRuns = 0x7fff;

// Red, green, blue, white as x, y. Radiance's own are what a file without PRIMARIES means by the
// specification; such files are Rec. 709 in practice, and both are read as that.
constexpr std::array<double, 8> kRec709Line = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
constexpr std::array<double, 8> kRadianceLine = {0.64, 0.33, 0.29,   0.60,
                                                 0.15, 0.06, 0.3333, 0.3333};

// One axis of the resolution line: "-Y 512".
struct Axis {
  char name = 0;
  bool rising = false;
  int length = 0;
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path), bytes_(ReadFile(path)) {}

  HdrPrimaries ReadPrimaries() {
    ReadHeader();
    return is_xyz_ ? HdrPrimaries::kXyz : primaries_;
  }

  Image Read() {
    ReadHeader();
    ReadResolution();
    const bool rows = slow_.name == 'Y';  // a scanline is a row, else a column
    const int width = rows ? fast_.length : slow_.length;
    const int height = rows ? slow_.length : fast_.length;
    if ((bytes_.size() - at_) * kMostPixelsPerByte < std::size_t(width) * height)
      Fail(fmt::format("claims {} x {} pixels in {} bytes", width, height, bytes_.size()),
           kDamaged);
    const std::size_t taken = sizeof(float) * 3 * static_cast<std::size_t>(width) * height;
    if (taken > kUnaskedBytes + kMostBytesPerByte * bytes_.size())
      Fail(fmt::format("takes {} MiB of memory, more than its {:.1f} MiB can be trusted with",
                       taken >> 20, static_cast<double>(bytes_.size()) / 0x1p20),
           kDamaged);
    // Some writers store plain pixels and mean (1, 1, 1, n) as a dark grey: a file of just the
    // right length holds no runs.
    plain_ = bytes_.size() - at_ == std::size_t{4} * width * height;
    Image image(width, height, 3);
    std::vector<Rgbe> scanline(fast_.length);
    for (int k = 0; k < slow_.length; ++k) {
      line_ = k;
      ReadScanline(scanline);
      for (int i = 0; i < fast_.length; ++i) {
        const int along_slow = Position(slow_, k), along_fast = Position(fast_, i);
        const int row = rows ? along_slow : along_fast, column = rows ? along_fast : along_slow;
        const Rgb rgb = Decode(scanline[i]);
        for (int channel = 0; channel < 3; ++channel)
          image.at(channel, row, column) = static_cast<float>(rgb[channel]);
      }
    }
    return image;
  }

 private:
  static constexpr const char* kDamaged = "the file is truncated or damaged: fetch or make it anew";

  [[noreturn]] void Fail(const std::string& problem, const std::string& remedy) const {
    throw InputError(path_.string(), problem, remedy);
  }

  std::string_view Line() {
    const std::string_view rest = std::string_view(bytes_).substr(at_);
    const std::size_t end = rest.substr(0, kMaxLine).find('\n');
    if (end == std::string_view::npos) Fail("its header does not end", kDamaged);
    at_ += end + 1;
    std::string_view line = rest.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  // `count` numbers after NAME=.
  std::vector<double> Numbers(std::string_view name, std::string_view text, std::size_t count) {
    const std::string shown = Printable(text);
    std::vector<double> numbers;
    while (true) {
      while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
      if (text.starts_with('+')) text.remove_prefix(1);
      if (text.empty()) break;
      double value = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error != std::errc() || !std::isfinite(value)) break;
      numbers.push_back(value);
      text.remove_prefix(end - text.data());
    }
    if (!text.empty() || numbers.size() != count)
      Fail(fmt::format("{} = '{}' is not {}", name, shown,
                       count == 1 ? "a number" : fmt::format("{} numbers", count)),
           "mend that header line");
    return numbers;
  }

  void ReadHeader() {
    if (!Line().starts_with("#?"))
      Fail("is no Radiance picture: its first line does not begin with '#?'",
           "give a .hdr picture or an OpenEXR file");
    for (std::string_view line = Line(); !line.empty(); line = Line()) {
      const auto value_of = [line](std::string_view name) -> std::optional<std::string_view> {
        if (!line.starts_with(name) || line.substr(name.size()).find('=') != 0) return {};
        return line.substr(name.size() + 1);
      };
      if (const auto format = value_of("FORMAT")) {
        is_xyz_ = *format == "32-bit_rle_xyze";
        if (!is_xyz_ && *format != "32-bit_rle_rgbe")
          Fail(fmt::format("FORMAT = '{}' is not read", Printable(*format)),
               "convert the picture to 32-bit_rle_rgbe or 32-bit_rle_xyze");
      } else if (const auto exposure = value_of("EXPOSURE")) {
        Divide(Numbers("EXPOSURE", *exposure, 1), "EXPOSURE");
      } else if (const auto correction = value_of("COLORCORR")) {
        Divide(Numbers("COLORCORR", *correction, 3), "COLORCORR");
      } else if (const auto gamma = value_of("GAMMA")) {
        if (Numbers("GAMMA", *gamma, 1)[0] != 1)
          Fail(fmt::format("GAMMA = {} is not read", Printable(*gamma)),
               "store the picture linearly, with GAMMA=1");
      } else if (const auto primaries = value_of("PRIMARIES")) {
        TakePrimaries(Numbers("PRIMARIES", *primaries, 8));
      }
    }
  }

  // These lines repeat, and each multiplies what came before.
  void Divide(const std::vector<double>& factors, const char* name) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double factor = factors[factors.size() == 1 ? 0 : channel];
      scale_[channel] /= factor;
      if (!(factor > 0) || !std::isnormal(scale_[channel]))
        Fail(fmt::format("{} = {} is not a positive factor in reach", name, factor),
             "mend that header line");
    }
  }

  void TakePrimaries(const std::vector<double>& given) {
    // Eight zeros is how a well-known editor says that it does not know.
    const auto is = [&](const std::array<double, 8>& known) {
      return std::equal(given.begin(), given.end(), known.begin(),
                        [](double a, double b) { return std::abs(a - b) <= 0.002; });
    };
    from_primaries_.reset();
    primaries_ = is(kRec709Line)     ? HdrPrimaries::kAsRec709
                 : is(kRadianceLine) ? HdrPrimaries::kAsRadiance
                 : is({})            ? HdrPrimaries::kUnstated
                                     : HdrPrimaries::kOther;
    if (primaries_ != HdrPrimaries::kOther) return;
    try {
      from_primaries_ = Rec709FromRgb(
          {{given[0], given[1]}, {given[2], given[3]}, {given[4], given[5]}, {given[6], given[7]}});
    } catch (const InputError& error) {
      Fail(fmt::format("PRIMARIES: {}", error.what()), "mend that header line");
    }
  }

  void ReadResolution() {
    const std::string_view line = Line();
    const auto bad = [&]() {
      Fail(fmt::format("resolution line '{}' is not of the form '-Y HEIGHT +X WIDTH'",
                       Printable(line)),
           kDamaged);
    };
    const char* p = line.data();
    const char* const end = p + line.size();
    for (Axis* axis : {&slow_, &fast_}) {
      while (p != end && *p == ' ') ++p;
      if (end - p < 3 || (*p != '+' && *p != '-') || (p[1] != 'X' && p[1] != 'Y') || p[2] != ' ')
        bad();
      axis->rising = *p == '+';
      axis->name = p[1];
      p += 2;
      while (p != end && *p == ' ') ++p;
      const auto [after, error] = std::from_chars(p, end, axis->length);
      if (error != std::errc() || axis->length < 1) bad();
      p = after;
    }
    while (p != end && *p == ' ') ++p;
    if (p != end || slow_.name == fast_.name) bad();
    if (std::int64_t{slow_.length} * fast_.length > kMaxPixels)
      Fail(fmt::format("is {} x {} pixels", fast_.length, slow_.length),
           "at most 2^27 pixels are read");
  }

  // Column or row of the k-th step along an axis. +X runs to the right, +Y upwards.
  static int Position(const Axis& axis, int k) {
    return (axis.name == 'X') == axis.rising ? k : axis.length - 1 - k;
  }

  [[noreturn]] void FailScanline(const char* problem) const {
    Fail(fmt::format("scanline {} {}", line_, problem), kDamaged);
  }

  std::uint8_t Byte() {
    if (at_ == bytes_.size()) FailScanline("is cut short by the end of the file");
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }

  void ReadScanline(std::vector<Rgbe>& scanline) {
    const int length = static_cast<int>(scanline.size());
    const std::size_t begin = at_;
    if (length >= kMinComponentRuns && length <= kMaxComponentRuns && Byte() == 2 && Byte() == 2) {
      const int high = Byte();
      if (high < 128) {
        if (const int said = high << 8 | Byte(); said != length)
          FailScanline(fmt::format("says it has {} pixels, not {}", said, length).c_str());
        for (std::size_t component = 0; component < 4; ++component)
          ReadComponent(scanline, component);
        return;
      }
    }
    at_ = begin;
    ReadFlat(scanline);
  }

  // Component by component: a count above 128 repeats the next byte, one below announces literals.
  void ReadComponent(std::vector<Rgbe>& scanline, std::size_t component) {
    for (std::size_t i = 0; i < scanline.size();) {
      const std::size_t code = Byte();
      const bool run = code > 128;
      const std::size_t count = run ? code - 128 : code;
      if (count == 0) FailScanline("holds a run of no pixels");
      if (count > scanline.size() - i) FailScanline("holds a run that leaves it");
      std::uint8_t value = run ? Byte() : std::uint8_t{0};
      for (std::size_t k = 0; k < count; ++k) {
        if (!run) value = Byte();
        scanline[i++][component] = value;
      }
    }
  }

  // Pixel by pixel; (1, 1, 1, n) repeats the pixel before it n times, and consecutive ones are the
  // digits of a number in base 256, the lowest first.
  void ReadFlat(std::vector<Rgbe>& scanline) {
    int shift = 0;
    for (std::size_t i = 0; i < scanline.size();) {
      const Rgbe pixel = {Byte(), Byte(), Byte(), Byte()};
      if (plain_ || pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        scanline[i++] = pixel;
        shift = 0;
        continue;
      }
      if (i == 0) FailScanline("repeats a pixel before its first");
      if (shift > 24) FailScanline("holds a run that leaves it");
      const std::size_t count = std::size_t{pixel[3]} << shift;
      if (count > scanline.size() - i) FailScanline("holds a run that leaves it");
      std::fill_n(scanline.begin() + static_cast<std::ptrdiff_t>(i), count, scanline[i - 1]);
      i += count;
      shift += 8;
    }
  }

  Rgb Decode(const Rgbe& pixel) const {
    if (pixel[3] == 0) return {};
    Rgb value;
    for (std::size_t k = 0; k < 3; ++k)
      value[k] = scale_[k] * std::ldexp(pixel[k] + 0.5, pixel[3] - 136);
    if (is_xyz_) value = IntoGamut(Rec709FromXyz(value));
    if (!is_xyz_ && from_primaries_) value = IntoGamut(Apply(*from_primaries_, value));
    for (const double v : value)
      if (!std::isfinite(static_cast<float>(v))) FailScanline("is too bright for its EXPOSURE");
    return value;
  }

  std::filesystem::path path_;
  std::string bytes_;
  std::size_t at_ = 0;
  std::array<double, 3> scale_ = {1, 1, 1};
  Axis slow_, fast_;  // scanline by scanline, and along each
  bool plain_ = false;
  bool is_xyz_ = false;
  HdrPrimaries primaries_ = HdrPrimaries::kUnstated;
  std::optional<Matrix3> from_primaries_;  // of kOther
  int line_ = 0;
};

}  // namespace

Image ReadRadianceHdr(const std::filesystem::path& path) { return Reader(path).Read(); }

HdrPrimaries ReadHdrPrimaries(const std::filesystem::path& path) {
  return Reader(path).ReadPrimaries();
}

}  // namespace luxfield::core
