#include "luxfield/shard/join_exr.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "luxfield/core/error.h"

namespace luxfield::shard {
namespace {

using core::ExrReader;

// Pixels of one channel of a part, [row][column].
using Plane = std::variant<std::vector<float>, std::vector<std::uint32_t>>;

// For the channels of a part, each of so many pixels.
std::vector<Plane> MakePlanes(const ExrReader::Part& part, std::size_t pixels) {
  std::vector<Plane> planes;
  for (const bool is_uint : part.channel_is_uint) {
    if (is_uint)
      planes.emplace_back(std::vector<std::uint32_t>(pixels));
    else
      planes.emplace_back(std::vector<float>(pixels));
  }
  return planes;
}

// Reads a part whose first pixel is `first` of the planes.
void ReadInto(std::vector<Plane>& planes, ExrReader& reader, int number, std::size_t first) {
  const ExrReader::Part& part = reader.parts()[number];
  const std::size_t pixels =
      static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height);
  std::vector<core::ExrTarget> targets;
  for (std::size_t c = 0; c < planes.size(); ++c)
    std::visit(
        [&](auto& plane) {
          targets.push_back({part.channels[c], std::span(plane).subspan(first, pixels)});
        },
        planes[c]);
  reader.Read(number, targets);
}

std::vector<core::ExrPixels> PixelsOf(const std::vector<Plane>& planes) {
  std::vector<core::ExrPixels> pixels;
  for (const Plane& plane : planes)
    std::visit([&](const auto& values) { pixels.emplace_back(std::span(values)); }, plane);
  return pixels;
}

// A part to write: channels without pixels. OpenEXR writes the attributes that every part has.
core::ExrPartView ViewOf(const ExrReader::Part& part, int height) {
  core::ExrPartView view{part.name, part.width, height, {}, part.attributes};
  for (const char* own : {"name", "type", "chunkCount", "pixelAspectRatio", "screenWindowWidth"})
    view.attributes.erase(own);
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    if (part.channel_is_uint[c])
      view.channels.push_back({part.channels[c], std::span<const std::uint32_t>()});
    else
      view.channels.push_back({part.channels[c], std::span<const float>()});
  }
  return view;
}

// Every file is open at once.
void AllowOpenFiles(std::size_t files) {
  rlimit limit{};
  const rlim_t wanted = files + 64;
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

std::string Shown(const core::ExrAttributes& attributes, const std::string& name) {
  const auto found = attributes.find(name);
  if (found == attributes.end()) return "nothing";
  return std::visit([](const auto& value) { return fmt::format("'{}'", value); }, found->second);
}

// That two files are pieces of one.
void RequireAlike(const ExrReader& first, const ExrReader& other) {
  const auto fail = [&](const std::string& what) {
    throw InputError(other.path().string(),
                     fmt::format("differs from {} in {}", first.path().string(), what),
                     "do all shards on machines and devices of one kind, and this one again");
  };
  if (first.parts().size() != other.parts().size()) fail("the number of parts");
  for (std::size_t p = 0; p < first.parts().size(); ++p) {
    const ExrReader::Part &a = first.parts()[p], &b = other.parts()[p];
    if (a.name != b.name || a.width != b.width || a.channels != b.channels ||
        a.channel_is_uint != b.channel_is_uint)
      fail(fmt::format("name, width or channels of part {}", p));
    const core::ExrAttributes of_a = ViewOf(a, 1).attributes, of_b = ViewOf(b, 1).attributes;
    if (of_a == of_b) continue;
    for (const auto* attributes : {&of_a, &of_b})
      for (const auto& [name, value] : *attributes)
        if (Shown(of_a, name) != Shown(of_b, name))
          fail(fmt::format("{} ({} and {})", name, Shown(of_a, name), Shown(of_b, name)));
    fail("an attribute");
  }
}

}  // namespace

void JoinExrRows(std::span<const std::filesystem::path> files, const std::filesystem::path& output,
                 core::ExrCompression compression, const MendChannel& mend) {
  AllowOpenFiles(files.size());
  std::vector<ExrReader> readers;
  for (const auto& file : files) {
    readers.emplace_back(file);
    RequireAlike(readers.front(), readers.back());
  }
  std::vector<core::ExrPartView> views;
  for (std::size_t p = 0; p < readers.front().parts().size(); ++p) {
    int height = 0;
    for (const ExrReader& reader : readers) height += reader.parts()[p].height;
    views.push_back(ViewOf(readers.front().parts()[p], height));
  }
  std::vector<Plane> planes;
  core::WriteExr(output, views, compression, [&](int part) {
    planes = {};  // makes room
    const ExrReader::Part& of_part = readers.front().parts()[part];
    const auto width = static_cast<std::size_t>(of_part.width);
    planes = MakePlanes(of_part, width * static_cast<std::size_t>(views[part].height));
    std::size_t row = 0;
    for (ExrReader& reader : readers) {
      ReadInto(planes, reader, part, row * width);
      row += static_cast<std::size_t>(reader.parts()[part].height);
    }
    for (std::size_t c = 0; mend && c < planes.size(); ++c)
      if (auto* floats = std::get_if<std::vector<float>>(&planes[c]))
        mend(part, of_part.channels[c], *floats);
    return PixelsOf(planes);
  });
}

void JoinExrParts(std::span<const std::filesystem::path> files, const std::filesystem::path& output,
                  core::ExrCompression compression, std::span<const core::ExrPartView> more) {
  std::vector<core::ExrPartView> views;
  std::vector<std::pair<std::size_t, int>> places;  // file and part in it
  for (std::size_t f = 0; f < files.size(); ++f) {
    const ExrReader reader(files[f]);
    for (std::size_t p = 0; p < reader.parts().size(); ++p) {
      views.push_back(ViewOf(reader.parts()[p], reader.parts()[p].height));
      places.emplace_back(f, static_cast<int>(p));
    }
  }
  views.insert(views.end(), more.begin(), more.end());
  std::unique_ptr<ExrReader> reader;
  std::size_t open = files.size();
  std::vector<Plane> planes;
  core::WriteExr(output, views, compression, [&](int number) {
    planes = {};  // makes room
    if (static_cast<std::size_t>(number) >= places.size()) {
      std::vector<core::ExrPixels> pixels;
      for (const auto& channel : views[number].channels) pixels.push_back(channel.pixels);
      return pixels;
    }
    const auto [file, part] = places[number];
    if (file != open) reader = std::make_unique<ExrReader>(files[file]);
    open = file;
    const ExrReader::Part& of_part = reader->parts()[part];
    planes = MakePlanes(of_part, static_cast<std::size_t>(of_part.width) *
                                     static_cast<std::size_t>(of_part.height));
    ReadInto(planes, *reader, part, 0);
    return PixelsOf(planes);
  });
}

}  // namespace luxfield::shard
