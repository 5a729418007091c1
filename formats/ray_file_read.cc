#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>

#include "luxfield/core/error.h"
#include "luxfield/core/input_file.h"
#include "luxfield/formats/ray_file.h"
#include "luxfield/formats/tm25_layout.h"

namespace luxfield::formats {
namespace {

constexpr const char* kRemedy = "have it exported anew";

template <typename T>
T Get(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// UTF-32LE up to the first NUL. What is no code point becomes U+FFFD: texts are for people.
std::string Utf8FromUtf32(std::span<const char> bytes) {
  std::string out;
  for (std::size_t k = 0; k + 4 <= bytes.size(); k += 4) {
    auto c = Get<std::uint32_t>(bytes.data() + k);
    if (c == 0) break;
    if (c > 0x10FFFF || (c >= 0xD800 && c < 0xE000)) c = 0xFFFD;
    const auto put = [&](std::uint32_t byte) { out += static_cast<char>(byte); };
    const auto tail = [&](int shift) { put(0x80 | ((c >> shift) & 0x3F)); };
    if (c < 0x80) {
      put(c);
    } else if (c < 0x800) {
      put(0xC0 | (c >> 6));
      tail(0);
    } else if (c < 0x10000) {
      put(0xE0 | (c >> 12));
      tail(6);
      tail(0);
    } else {
      put(0xF0 | (c >> 18));
      tail(12);
      tail(6);
      tail(0);
    }
  }
  return out;
}

// An open ray file whose header has been read and checked.
class Tm25Reader {
 public:
  explicit Tm25Reader(const std::filesystem::path& path) : path_(path) {
    std::error_code error_code;
    if (!std::filesystem::exists(path, error_code)) Fail("no such file", "check the path");
    core::RequireRegularFile(path);
    size_ = std::filesystem::file_size(path, error_code);
    stream_.open(path, std::ios::binary);
    if (error_code || !stream_) Fail("cannot be opened", "check its permissions");
    ReadFixedPart();
    CheckRules();
    SkipTables();
    ReadLabels();
    CheckLength();
  }

  const RayFileHeader& header() const { return header_; }

  RayFile FileWithoutRays() const {
    RayFile file;
    file.header = header_;
    file.flux_is_luminous = flags_[tm25::kLuminous];
    return file;
  }

  void StreamRays(const RayTaker& take) {
    constexpr std::uint64_t kBatch = 4096;
    for (std::uint64_t first = 0; first < header_.ray_count; first += kBatch) {
      const auto count = std::min(kBatch, header_.ray_count - first);
      const auto bytes = Read(count * items_ * sizeof(float), "rays");
      for (std::uint64_t k = 0; k < count; ++k)
        take(ParseRay(bytes.data() + k * items_ * sizeof(float), first + k));
    }
  }

 private:
  [[noreturn]] void Fail(const std::string& problem, const char* remedy = kRemedy) const {
    throw InputError(path_.string(), problem, remedy);
  }

  std::vector<char> Read(std::uint64_t count, const char* what) {
    if (count > size_ - position_)
      Fail(fmt::format("ends within its {} (byte {} of {})", what, size_, position_ + count),
           "the file is truncated: copy it again");
    std::vector<char> bytes(count);
    stream_.read(bytes.data(), static_cast<std::streamsize>(count));
    if (!stream_) Fail(fmt::format("cannot read its {}", what), "check the disk");
    position_ += count;
    return bytes;
  }

  // Unknown is a NaN, byte-swapped in one vendor's files (2.36e-38), or 0.
  std::optional<double> Flux(const char* bytes, const char* field) const {
    const double value = Get<float>(bytes);
    if (std::isnan(value) || std::abs(value) < 1e-30) return {};
    if (value < 0 || std::isinf(value))
      Fail(fmt::format("{} = {} must be 0 or above", field, value));
    return value;
  }

  void ReadFixedPart() {
    const auto magic = Read(std::min<std::uint64_t>(size_, 4), "header");
    if (std::string_view(magic.data(), magic.size()) != "TM25")
      Fail("is no TM-25 ray file: it does not begin with 'TM25'", "name a TM-25 file");
    auto bytes = Read(tm25::kFixedBytes - 4, "header");
    const char* at = bytes.data() - 4;  // offsets as in the layout

    header_.version = Get<std::int32_t>(at + tm25::kAtVersion);
    if (header_.version != tm25::kVersion)
      Fail(fmt::format("version = {} where {} is understood", header_.version, tm25::kVersion));
    header_.creation_method = Get<std::int32_t>(at + tm25::kAtCreation);
    header_.luminous_flux_lm = Flux(at + tm25::kAtLuminous, "luminous flux");
    header_.radiant_flux_w = Flux(at + tm25::kAtRadiant, "radiant flux");
    header_.ray_count = Get<std::uint64_t>(at + tm25::kAtRays);
    header_.date_time.assign(at + tm25::kAtDate, strnlen(at + tm25::kAtDate, tm25::kDateBytes));
    header_.start_position = Get<std::int32_t>(at + tm25::kAtStart);
    header_.spectral_id = Get<std::int32_t>(at + tm25::kAtSpectral);
    wavelength_nm_ = Get<float>(at + tm25::kAtWavelength);
    minimum_nm_ = Get<float>(at + tm25::kAtMinimum);
    maximum_nm_ = Get<float>(at + tm25::kAtMaximum);
    tables_ = Get<std::int32_t>(at + tm25::kAtTables);
    additional_ = Get<std::int32_t>(at + tm25::kAtAdditional);
    text_bytes_ = Get<std::int32_t>(at + tm25::kAtText);
    at += tm25::kHeaderBytes;
    for (int flag = 0; flag < tm25::kFlags; ++flag) {
      const auto value = Get<std::int32_t>(at + 4 * flag);
      if (value != 0 && value != 1) Fail(fmt::format("flag {} = {} must be 0 or 1", flag, value));
      flags_[flag] = value == 1;
    }
    at += tm25::kFlagBytes;
    for (std::size_t text = 0; text < tm25::kTexts; ++text)
      header_.texts.push_back(Utf8FromUtf32({at + text * tm25::kTextBytes, tm25::kTextBytes}));
  }

  void CheckRange(const char* field, std::int32_t value, std::int32_t min, std::int32_t max) const {
    if (value < min || value > max)
      Fail(fmt::format("{} = {} must be between {} and {}", field, value, min, max));
  }

  void CheckRules() {
    CheckRange("creation method", header_.creation_method, -1, 1);
    CheckRange("ray start position", header_.start_position, 0, 7);
    CheckRange("spectral data identifier", header_.spectral_id, 0, 4);
    CheckRange("number of spectral tables", tables_, 0, INT32_MAX);
    CheckRange("number of additional items", additional_, 0, INT32_MAX);
    CheckRange("size of additional text", text_bytes_, 0, INT32_MAX);
    const int id = header_.spectral_id;
    const auto forbid = [&](bool wrong, const char* rule) {
      if (wrong) Fail(fmt::format("flags contradict: {} (spectral data identifier {})", rule, id));
    };
    const bool radiant = flags_[tm25::kRadiant], luminous = flags_[tm25::kLuminous];
    forbid(!flags_[tm25::kPosition] || !flags_[tm25::kDirection],
           "position and direction are required");
    forbid(!radiant && !luminous, "radiant or luminous flux is required");
    forbid((id == 2 || id == 4) && (!radiant || luminous),
           "a spectrum per ray needs radiant and forbids luminous flux");
    forbid(id == 2 && !flags_[tm25::kWavelength], "a wavelength per ray needs its column");
    forbid((id == 4) != flags_[tm25::kIndex],
           "a table per ray and the index column need each other");
    forbid(flags_[tm25::kTristimulus] && (!luminous || id != 0),
           "tristimulus values need luminous flux and no spectrum");
    forbid(flags_[tm25::kStokes] && !radiant, "Stokes parameters need radiant flux");
    if (id == 3 || id == 4) forbid(tables_ < 1, "a spectral table is required");
    if (id == 1) {
      if (!(wavelength_nm_ > 0) || std::isinf(wavelength_nm_))
        Fail(fmt::format("wavelength = {} nm must be above 0", wavelength_nm_));
      header_.wavelength_nm = wavelength_nm_;
    }
    if (id >= 2 && !(minimum_nm_ > 0 && maximum_nm_ > 0))
      Fail(fmt::format("wavelength range = {} to {} nm must be above 0", minimum_nm_, maximum_nm_));
  }

  // The tables together, not each, are padded to a multiple of 32 bytes.
  void SkipTables() {
    const std::uint64_t start = position_;
    for (std::int32_t table = 0; table < tables_; ++table) {
      const auto count = Get<std::int32_t>(Read(4, "spectral tables").data());
      if (count < 1) Fail(fmt::format("spectral table {} has {} rows", table + 1, count));
      const auto rows =
          Read(std::uint64_t{8} * static_cast<std::uint64_t>(count), "spectral tables");
      for (std::int32_t row = 0; row < count; ++row) {
        const float nm = Get<float>(rows.data() + 8 * static_cast<std::size_t>(row));
        const float weight = Get<float>(rows.data() + 8 * static_cast<std::size_t>(row) + 4);
        if (!(nm > 0) || std::isinf(nm) || !(weight >= 0) || std::isinf(weight))
          Fail(fmt::format("spectral table {} holds weight {} at {} nm", table + 1, weight, nm));
      }
    }
    const std::uint64_t used = (position_ - start) % tm25::kAlignment;
    if (used != 0) Read(tm25::kAlignment - used, "spectral tables");
  }

  void ReadLabels() {
    for (std::int32_t column = 0; column < additional_; ++column)
      header_.additional_columns.push_back(
          Utf8FromUtf32(Read(tm25::kLabelBytes, "additional column labels")));
    Read(static_cast<std::uint64_t>(text_bytes_), "additional text");
  }

  void CheckLength() {
    items_ = static_cast<std::size_t>(additional_);
    for (int flag = 0; flag < tm25::kFlags; ++flag)
      if (flags_[flag]) items_ += tm25::kItems[flag];
    const std::uint64_t ray_bytes = items_ * sizeof(float), rest = size_ - position_;
    if (rest % ray_bytes != 0 || rest / ray_bytes != header_.ray_count)
      Fail(fmt::format("number of rays = {} of {} bytes does not fit the {} bytes after the header",
                       header_.ray_count, ray_bytes, rest),
           "the file is truncated or its header is wrong");
  }

  Ray ParseRay(const char* bytes, std::uint64_t index) const {
    const auto fail = [&](const std::string& what) {
      Fail(fmt::format("ray {}: {}", index, what));
    };
    const auto item = [&](std::size_t k) { return double{Get<float>(bytes + k * sizeof(float))}; };
    Ray ray;
    ray.position_m = 1e-3 * lightfield::Vec3{item(0), item(1), item(2)};
    if (!std::isfinite(item(0)) || !std::isfinite(item(1)) || !std::isfinite(item(2)))
      fail(fmt::format("position {} {} {} mm is not finite", item(0), item(1), item(2)));
    ray.direction = {item(3), item(4), item(5)};
    if (!(std::abs(lightfield::Length(ray.direction) - 1) <= tm25::kUnitTolerance))
      fail(fmt::format("direction {} {} {} is not of unit length", item(3), item(4), item(5)));

    std::size_t next = 6;
    std::array<std::size_t, tm25::kFlags> at{};
    for (int flag = tm25::kRadiant; flag < tm25::kFlags; ++flag) {
      at[flag] = next;
      if (flags_[flag]) next += tm25::kItems[flag];
    }
    ray.flux = item(at[flags_[tm25::kLuminous] ? tm25::kLuminous : tm25::kRadiant]);
    if (!(ray.flux >= 0) || std::isinf(ray.flux))
      fail(fmt::format("flux = {} must be 0 or above", ray.flux));
    if (flags_[tm25::kTristimulus]) {
      const double x = item(at[tm25::kTristimulus]), z = item(at[tm25::kTristimulus] + 1);
      if (!std::isfinite(x) || !std::isfinite(z))
        fail(fmt::format("tristimulus X = {}, Z = {} is not finite", x, z));
      ray.tristimulus = {x, ray.flux, z};
    }
    return ray;
  }

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0;
  RayFileHeader header_;
  float wavelength_nm_ = 0, minimum_nm_ = 0, maximum_nm_ = 0;
  std::int32_t tables_ = 0, additional_ = 0, text_bytes_ = 0;
  std::array<bool, tm25::kFlags> flags_{};
  std::size_t items_ = 0;
};

}  // namespace

RayFile StreamTm25(const std::filesystem::path& path, const RayTaker& take) {
  Tm25Reader reader(path);
  reader.StreamRays(take);
  return reader.FileWithoutRays();
}

RayFile ReadTm25(const std::filesystem::path& path) {
  Tm25Reader reader(path);
  RayFile file = reader.FileWithoutRays();
  file.rays.reserve(file.header.ray_count);
  reader.StreamRays([&](const Ray& ray) { file.rays.push_back(ray); });
  return file;
}

RayFileHeader ReadTm25Header(const std::filesystem::path& path) {
  return Tm25Reader(path).header();
}

}  // namespace luxfield::formats
