#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/input_file.h"
#include "luxfield/core/printable.h"
#include "luxfield/formats/ray_formats.h"
#include "luxfield/formats/ray_formats_layout.h"
#include "luxfield/formats/text_reader.h"

namespace luxfield::formats {
namespace {

namespace fs = std::filesystem;

template <typename T>
T Get(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

// A ray's columns as stored: x y z l m n flux, and what follows.
using TakeRow = std::function<void(const float* row, std::uint64_t index)>;

// An open binary file.
class RowFile {
 public:
  explicit RowFile(const fs::path& path) : name_(path.string()) {
    core::RequireRegularFile(path);
    size_ = fs::file_size(path);
    stream_.open(path, std::ios::binary);
    if (!stream_) Fail("cannot be opened", "check its permissions");
  }

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }

  [[noreturn]] void Fail(const std::string& problem,
                         const char* remedy = "have it exported anew") const {
    throw InputError(name_, problem, remedy);
  }

  std::string Read(std::uint64_t count, const char* what) {
    if (count > size_ - position_)
      Fail(fmt::format("ends within its {} (byte {} of {})", what, size_, position_ + count),
           "the file is truncated: copy it again");
    std::string bytes(count, '\0');
    stream_.read(bytes.data(), static_cast<std::streamsize>(count));
    if (!stream_) Fail(fmt::format("cannot read its {}", what), "check the disk");
    position_ += count;
    return bytes;
  }

  // All but the last `tail` bytes as rows; InputError where they are no whole number, or not
  // `count` where that is known.
  std::uint64_t CountRows(std::size_t columns, std::uint64_t tail) const {
    const std::uint64_t row = columns * sizeof(float);
    if (size_ < position_ + tail || (size_ - position_ - tail) % row != 0)
      Fail(fmt::format("the {} bytes behind its header are no whole number of rays of {} bytes",
                       size_ - position_, row),
           "the file is truncated or its header is wrong");
    return (size_ - position_ - tail) / row;
  }

  void ReadRows(std::uint64_t count, std::size_t columns, const TakeRow& take) {
    constexpr std::uint64_t kBatch = 4096;
    std::vector<float> rows;
    for (std::uint64_t first = 0; first < count; first += kBatch) {
      const std::uint64_t batch = std::min(kBatch, count - first);
      const std::string bytes = Read(batch * columns * sizeof(float), "rays");
      rows.resize(batch * columns);
      std::memcpy(rows.data(), bytes.data(), bytes.size());
      for (std::uint64_t k = 0; k < batch; ++k) take(rows.data() + k * columns, first + k);
    }
  }

 private:
  std::string name_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0;
};

Ray RayOf(const RowFile& file, const float* row, std::uint64_t index, double unit_m) {
  Ray ray;
  ray.position_m = unit_m * lightfield::Vec3{row[0], row[1], row[2]};
  ray.direction = {row[3], row[4], row[5]};
  ray.flux = row[6];
  if (!(lightfield::Length(ray.position_m) <= 1e30))
    file.Fail(
        fmt::format("ray {}: position {} {} {} is not finite", index, row[0], row[1], row[2]));
  if (!(std::abs(lightfield::Length(ray.direction) - 1) <= kUnitTolerance))
    file.Fail(fmt::format("ray {}: direction {} {} {} is not of unit length", index, row[3], row[4],
                          row[5]));
  if (!(ray.flux >= 0) || std::isinf(ray.flux))
    file.Fail(fmt::format("ray {}: flux = {} must be 0 or above", index, ray.flux));
  return ray;
}

std::optional<double> FluxOf(double value) {
  if (!(value > 1e-30) || std::isinf(value)) return {};
  return value;
}

void CheckWavelength(const RowFile& file, double value, const char* unit, std::uint64_t index) {
  if (!(value > 0) || std::isinf(value))
    file.Fail(fmt::format("ray {}: wavelength = {} {} must be above 0", index, value, unit));
}

// Reads a header, then, where something takes them, the rays.
struct Wanted {
  RayFile file;   // without its rays
  RayTaker take;  // none: the header alone
  std::function<void(std::uint64_t count)> reserve;

  void Start(std::uint64_t count) {
    file.header.ray_count = count;
    if (reserve) reserve(count);
  }
};

void ReadZemax(const fs::path& path, Wanted& wanted) {
  RowFile file(path);
  const std::string head = file.Read(zemax::kHeaderBytes, "header");
  const auto magic = Get<std::int32_t>(head, 0);
  if (magic != zemax::kMagic && magic != zemax::kOldMagic)
    file.Fail(fmt::format("is no Zemax ray file: it begins with {}, not {}", magic, zemax::kMagic),
              "name a binary .dat or .sdf file");
  const auto rays = Get<std::uint32_t>(head, zemax::kAtRays);
  const auto units = Get<std::uint32_t>(head, zemax::kAtUnits);
  const auto format = Get<std::int32_t>(head, zemax::kAtRayFormat);
  const auto flux_type = Get<std::int32_t>(head, zemax::kAtFluxType);
  if (units >= std::size(zemax::kMetres))
    file.Fail(fmt::format("units code = {} is none of 0 to 4", units));
  if (format != zemax::kFluxOnly && format != zemax::kSpectral)
    file.Fail(fmt::format("ray format = {} where 0 and 2 are understood", format),
              "export it as flux only or spectral colour");
  if (flux_type != 0 && flux_type != 1)
    file.Fail(fmt::format("flux type = {} where 0 (W) and 1 (lm) are understood", flux_type));
  const bool spectral = format == zemax::kSpectral;
  const std::size_t columns = spectral ? 8 : 7;
  if (file.CountRows(columns, 0) != rays)
    file.Fail(
        fmt::format("number of rays = {} of {} bytes does not fit the {} bytes after the header",
                    rays, columns * sizeof(float), file.size() - zemax::kHeaderBytes),
        "the file is truncated or its header is wrong");
  RayFileHeader& header = wanted.file.header;
  const char* text = head.data() + zemax::kAtDescription;
  header.texts = {Utf8FromLatin1(Trimmed({text, strnlen(text, zemax::kDescriptionBytes)}))};
  wanted.file.flux_is_luminous = !spectral && flux_type == 1;
  const auto flux = FluxOf(Get<float>(head, zemax::kAtRayFlux));
  (wanted.file.flux_is_luminous ? header.luminous_flux_lm : header.radiant_flux_w) = flux;
  wanted.Start(rays);
  if (!wanted.take) return;
  file.ReadRows(rays, columns, [&](const float* row, std::uint64_t index) {
    if (spectral) CheckWavelength(file, row[7], "um", index);
    wanted.take(RayOf(file, row, index, zemax::kMetres[units]));
  });
}

void ReadLightTools(const fs::path& path, Wanted& wanted) {
  RowFile file(path);
  const std::string head = file.Read(lighttools::kHeaderBytes, "header");
  const auto require = [&](const char* field, std::size_t at, std::uint32_t most) {
    const auto value = Get<std::uint32_t>(head, at);
    if (value > most)
      file.Fail(fmt::format("{} = {} where 0 to {} are understood", field, value, most));
    return value;
  };
  const auto major = Get<std::uint32_t>(head, lighttools::kAtMajor);
  if (major != lighttools::kMajor)
    file.Fail(fmt::format("major version = {} where {} is understood", major, lighttools::kMajor),
              "export it without polarisation");
  const bool lumens = require("data type", lighttools::kAtDataType, 1) == lighttools::kLumens;
  if (require("far field flag", lighttools::kAtFarField, 1) != 0)
    file.Fail("holds a far field, whose rays have no positions", "export the near field");
  const auto colour = require("colour information", lighttools::kAtColour, 2);
  const auto units = Get<std::uint32_t>(head, lighttools::kAtUnits);
  if (units != lighttools::kMillimetres)
    file.Fail(fmt::format("length units = {} where 1 (mm) is understood", units),
              "export it in millimetres");
  lightfield::Vec3 origin_mm{Get<float>(head, lighttools::kAtOrigin),
                             Get<float>(head, lighttools::kAtOrigin + 4),
                             Get<float>(head, lighttools::kAtOrigin + 8)};
  if (!(lightfield::Length(origin_mm) <= 1e9)) file.Fail("its origin is not finite");
  const std::size_t columns = lighttools::kColumns[colour];
  const std::uint64_t rays = file.CountRows(columns, lighttools::kEndBytes);
  wanted.file.flux_is_luminous = lumens;
  const auto flux = FluxOf(Get<float>(head, lighttools::kAtFlux));
  auto& header = wanted.file.header;
  (lumens ? header.luminous_flux_lm : header.radiant_flux_w) = flux;
  wanted.Start(rays);
  if (!wanted.take) return;
  file.ReadRows(rays, columns, [&](const float* row, std::uint64_t index) {
    if (colour == 2) CheckWavelength(file, row[7], "nm", index);
    Ray ray = RayOf(file, row, index, 1e-3);
    ray.position_m = ray.position_m + 1e-3 * origin_mm;
    wanted.take(ray);
  });
  if (file.Read(lighttools::kEndBytes, "end") != lighttools::kEnd)
    file.Fail("does not end with LTRFEND", "the file is truncated: copy it again");
}

void ReadSpeos(const fs::path& path, Wanted& wanted) {
  RowFile file(path);
  const std::string head = file.Read(speos::kHeaderBytes, "header");
  const auto watts = FluxOf(Get<float>(head, 0)),
             lumens = FluxOf(Get<float>(head, speos::kAtLumens));
  if (!watts) file.Fail(fmt::format("radiant flux = {} W must be above 0", Get<float>(head, 0)));
  const std::uint64_t rays = file.CountRows(8, 0);
  RayFile& read = wanted.file;
  read.header.radiant_flux_w = watts;
  read.header.luminous_flux_lm = lumens;
  wanted.Start(rays);
  if (!wanted.take) return;
  double sum = 0;
  float first_nm = 0;
  bool one_wavelength = true;
  const auto ray_of = [&](const float* row, std::uint64_t index) {
    const float columns[] = {row[0], row[1], row[2], row[3], row[4], row[5], row[7]};
    return RayOf(file, columns, index, 1e-3);
  };
  file.ReadRows(rays, 8, [&](const float* row, std::uint64_t index) {
    CheckWavelength(file, row[6], "nm", index);
    if (index == 0) first_nm = row[6];
    one_wavelength = one_wavelength && row[6] == first_nm;
    sum += ray_of(row, index).flux;
  });
  if (!(sum > 0)) file.Fail("its rays carry no energy");
  read.flux_is_luminous = one_wavelength && lumens;
  const double flux = read.flux_is_luminous ? *lumens : *watts;
  RowFile again(path);
  again.Read(speos::kHeaderBytes, "header");
  again.ReadRows(rays, 8, [&](const float* row, std::uint64_t index) {
    Ray ray = ray_of(row, index);
    ray.flux *= flux / sum;
    wanted.take(ray);
  });
}

// One line of a text file, at most 4096 bytes of it.
bool NextLine(std::ifstream& stream, std::string& line) {
  constexpr std::size_t kLongest = 4096;
  line.clear();
  for (char c; stream.get(c);) {
    if (c == '\n') return true;
    if (line.size() < kLongest) line += c;
  }
  return !line.empty();
}

double TextUnit(const std::string& name, const std::function<void(const std::string&)>& fail) {
  for (const auto& [unit, metres] :
       {std::pair{"millimeters", 1e-3}, std::pair{"centimeters", 1e-2}, std::pair{"meters", 1.0},
        std::pair{"inches", 0.0254}, std::pair{"feet", 0.3048}})
    if (name == unit) return metres;
  fail(fmt::format("lt_length_units '{}' is not known", core::Printable(name)));
  return 0;
}

std::vector<double> NumbersOf(std::string_view line) {
  std::vector<double> numbers;
  while (!(line = Trimmed(line)).empty()) {
    double value = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (error != std::errc()) return {};
    numbers.push_back(value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  }
  return numbers;
}

void ReadLightToolsText(const fs::path& path, Wanted& wanted) {
  RowFile file(path);  // that it is a regular file
  std::ifstream stream(path, std::ios::binary);
  std::uint64_t number = 0;
  const auto fail = [&](const std::string& problem) {
    file.Fail(fmt::format("line {}: {}", number, problem));
  };
  double unit_m = 1e-3, flux = 0;
  lightfield::Vec3 origin;
  std::size_t columns = 7;
  bool data = false, ended = false;
  RayFile& read = wanted.file;
  for (std::string line; NextLine(stream, line) && !ended;) {
    ++number;
    const std::string text(Trimmed(line));
    if (text.empty() || text.front() == '#') continue;
    const auto colon = text.find(':');
    const std::string key = text.substr(0, colon);
    const std::string value(colon == std::string::npos
                                ? std::string_view()
                                : Trimmed(std::string_view(text).substr(colon + 1)));
    if (key == "lt_endofdata") {
      ended = true;
    } else if (data) {
      const auto numbers = NumbersOf(text);
      if (numbers.size() != columns)
        fail(fmt::format("'{}' is no ray of {} numbers", core::Printable(text), columns));
      float row[7];
      for (std::size_t k = 0; k < 7; ++k) row[k] = static_cast<float>(numbers[k]);
      if (columns == 8) CheckWavelength(file, numbers[7], "nm", read.header.ray_count);
      Ray ray = RayOf(file, row, read.header.ray_count, unit_m);
      ray.position_m = ray.position_m + origin;
      ++read.header.ray_count;
      if (wanted.take) wanted.take(ray);
    } else if (key == "lt_startofdata") {
      data = true;
    } else if (key == "dataname") {
      read.header.texts = {Utf8FromLatin1(value)};
    } else if (key == "lt_datatype") {
      if (value != "radiant_power" && value != "luminous_flux")
        fail(fmt::format("lt_datatype '{}' is not known", core::Printable(value)));
      read.flux_is_luminous = value == "luminous_flux";
    } else if (key == "lt_far_field_data") {
      if (value != "no") fail("holds a far field, whose rays have no positions");
    } else if (key == "lt_color_info") {
      if (value != "none" && value != "wavelength" && value != "tristimulus")
        fail(fmt::format("lt_color_info '{}' is not known", core::Printable(value)));
      columns = value == "none" ? 7 : value == "wavelength" ? 8 : 10;
    } else if (key == "lt_length_units") {
      unit_m = TextUnit(value, fail);
    } else if (key == "lt_data_origin") {
      const auto numbers = NumbersOf(value);
      if (numbers.size() != 3) fail("lt_data_origin needs three numbers");
      origin = unit_m * lightfield::Vec3{numbers[0], numbers[1], numbers[2]};
      if (!(lightfield::Length(origin) <= 1e9)) fail("lt_data_origin is not finite");
    } else if (key == "lt_radiant_flux" || key == "lt_luminous_flux") {
      const auto numbers = NumbersOf(value);
      if (numbers.size() != 1) fail(fmt::format("{} needs a number", key));
      flux = numbers[0];
    }
  }
  if (!ended) file.Fail("ends without lt_endofdata", "the file is truncated: copy it again");
  (read.flux_is_luminous ? read.header.luminous_flux_lm : read.header.radiant_flux_w) =
      FluxOf(flux);
}

RaySummary Read(const fs::path& path, Wanted& wanted) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path.string(), "no such file", "check the path");
  const auto format = RayFormatOf(path);
  if (!format)
    throw InputError(path.string(), "is no ray file of TM-25, Zemax, LightTools or Speos",
                     "export TM-25; ASAP's and LucidShape's own layouts are not public");
  switch (*format) {
    case RayFormat::kTm25:
      if (!wanted.take) {
        wanted.file.header = ReadTm25Header(path);
        break;
      }
      if (wanted.reserve) wanted.reserve(ReadTm25Header(path).ray_count);
      wanted.file = StreamTm25(path, wanted.take);
      break;
    case RayFormat::kZemax:
      ReadZemax(path, wanted);
      break;
    case RayFormat::kLightTools:
      ReadLightTools(path, wanted);
      break;
    case RayFormat::kLightToolsText:
      ReadLightToolsText(path, wanted);
      break;
    case RayFormat::kSpeos:
      ReadSpeos(path, wanted);
      break;
  }
  return {*format, wanted.file.header, wanted.file.flux_is_luminous};
}

}  // namespace

std::string RayFormatName(RayFormat format) {
  switch (format) {
    case RayFormat::kTm25:
      return "TM-25";
    case RayFormat::kZemax:
      return "Zemax";
    case RayFormat::kLightTools:
      return "LightTools";
    case RayFormat::kLightToolsText:
      return "LightTools text";
    case RayFormat::kSpeos:
      return "Speos";
  }
  return {};
}

std::optional<RayFormat> RayFormatOf(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};
  std::ifstream stream(path, std::ios::binary);
  std::string start(4096, '\0');
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (start.starts_with("TM25") || ending == ".tm25ray") return RayFormat::kTm25;
  if (start.starts_with(lighttools::kMagic)) return RayFormat::kLightTools;
  if (start.find("lt_rdf_version") != std::string::npos) return RayFormat::kLightToolsText;
  const bool is_zemax = ending == ".dat" || ending == ".sdf" || ending == ".ray";
  if (is_zemax && start.size() >= zemax::kHeaderBytes) {
    const auto magic = Get<std::int32_t>(start, 0);
    if (magic == zemax::kMagic || magic == zemax::kOldMagic) return RayFormat::kZemax;
  }
  const auto size = fs::file_size(path, error);
  if (!error && ending == ".ray" && size > speos::kHeaderBytes &&
      (size - speos::kHeaderBytes) % speos::kRayBytes == 0 &&
      Get<float>(start, 4) == speos::kFiller)
    return RayFormat::kSpeos;
  return {};
}

RayFile StreamRays(const fs::path& path, const RayTaker& take) {
  Wanted wanted;
  wanted.take = take;
  Read(path, wanted);
  return std::move(wanted.file);
}

RayFile ReadRays(const fs::path& path) {
  std::vector<Ray> rays;
  Wanted wanted;
  wanted.take = [&](const Ray& ray) { rays.push_back(ray); };
  wanted.reserve = [&](std::uint64_t count) { rays.reserve(count); };
  Read(path, wanted);
  wanted.file.rays = std::move(rays);
  return std::move(wanted.file);
}

RaySummary SummariseRays(const fs::path& path) {
  Wanted wanted;
  return Read(path, wanted);
}

}  // namespace luxfield::formats
