#include "luxfield/shard/join_exr.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <deque>
#include <memory>

#include "luxfield/core/error.h"

namespace luxfield::shard {
namespace {

using core::ExrReader;

// Pixels of one part, [channel][row][column], floats or integers.
struct PartPixels {
  std::deque<std::vector<float>> floats;
  std::deque<std::vector<std::uint32_t>> integers;
  std::vector<core::ExrPixels> channels;
};

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
  PartPixels pixels;
  core::WriteExr(output, views, compression, [&](int part) {
    pixels = {};
    const ExrReader::Part& of_part = readers.front().parts()[part];
    const auto width = static_cast<std::size_t>(of_part.width),
               all = width * static_cast<std::size_t>(views[part].height);
    std::vector<std::string> names;
    for (std::size_t c = 0; c < of_part.channels.size(); ++c)
      if (!of_part.channel_is_uint[c]) {
        names.push_back(of_part.channels[c]);
        pixels.floats.emplace_back(all);
      }
    std::size_t row = 0;
    for (ExrReader& reader : readers) {
      const auto rows = static_cast<std::size_t>(reader.parts()[part].height);
      std::vector<std::span<float>> planes;
      for (auto& plane : pixels.floats)
        planes.push_back(std::span(plane).subspan(row * width, rows * width));
      if (!names.empty()) reader.ReadFloats(part, names, planes);
      row += rows;
    }
    std::size_t next = 0;
    for (std::size_t c = 0; c < of_part.channels.size(); ++c) {
      if (of_part.channel_is_uint[c]) {
        std::vector<std::uint32_t>& plane = pixels.integers.emplace_back();
        for (ExrReader& reader : readers) {
          const auto rows = reader.ReadUint(part, of_part.channels[c]);
          plane.insert(plane.end(), rows.begin(), rows.end());
        }
        pixels.channels.emplace_back(std::span<const std::uint32_t>(plane));
        continue;
      }
      std::vector<float>& plane = pixels.floats[next++];
      if (mend) mend(part, of_part.channels[c], plane);
      pixels.channels.emplace_back(std::span<const float>(plane));
    }
    return pixels.channels;
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
  PartPixels pixels;
  core::WriteExr(output, views, compression, [&](int number) {
    if (static_cast<std::size_t>(number) >= places.size()) {
      pixels = {};
      for (const auto& channel : views[number].channels) pixels.channels.push_back(channel.pixels);
      return pixels.channels;
    }
    const auto [file, part] = places[number];
    if (file != open) reader = std::make_unique<ExrReader>(files[file]);
    open = file;
    pixels = {};
    const ExrReader::Part& of_part = reader->parts()[part];
    std::vector<std::string> names;
    std::vector<std::span<float>> planes;
    for (std::size_t c = 0; c < of_part.channels.size(); ++c)
      if (!of_part.channel_is_uint[c]) {
        names.push_back(of_part.channels[c]);
        planes.emplace_back(
            pixels.floats.emplace_back(static_cast<std::size_t>(of_part.width) * of_part.height));
      }
    if (!names.empty()) reader->ReadFloats(part, names, planes);
    std::size_t next = 0;
    for (std::size_t c = 0; c < of_part.channels.size(); ++c) {
      if (of_part.channel_is_uint[c])
        pixels.channels.emplace_back(std::span<const std::uint32_t>(
            pixels.integers.emplace_back(reader->ReadUint(part, of_part.channels[c]))));
      else
        pixels.channels.emplace_back(std::span<const float>(pixels.floats[next++]));
    }
    return pixels.channels;
  });
}

}  // namespace luxfield::shard
