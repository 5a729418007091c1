// What OpenEXR headers claim: small files that would take gigabytes are refused before they do, and
// files that are small because they are of one value are read.
#include "luxfield/core/exr_precheck.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/stopwatch.h"

namespace luxfield::core {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kTiled = 0x200, kNonImage = 0x800, kMultiPart = 0x1000;
constexpr double kMostMib = 300;  // for a file of some hundred bytes

// Numbers as they lie in a file.
template <typename... T>
std::string Bytes(T... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

std::string Text(const std::string& text) { return text + '\0'; }

struct Attribute {
  std::string name, type, value;
  std::optional<std::int32_t> stated;  // size, where it is not that of the value

  std::string text() const {
    return Text(name) + Text(type) +
           Bytes(stated.value_or(static_cast<std::int32_t>(value.size()))) + value;
  }
};
using Header = std::vector<Attribute>;

std::string Channel(const std::string& name, std::int32_t type = 1) {
  return Text(name) + Bytes(type, 0, 1, 1);
}
std::string Rgb(std::int32_t type = 1) {
  return Channel("B", type) + Channel("G", type) + Channel("R", type) + '\0';
}
Attribute Window(std::int32_t width, std::int32_t height) {
  return {"dataWindow", "box2i", Bytes(0, 0, width - 1, height - 1), {}};
}
Attribute Tiles(std::int32_t width, std::int32_t height) {
  return {"tiles", "tiledesc", Bytes(width, height, '\0'), {}};
}
Attribute TypeOf(const std::string& type) { return {"type", "string", type, {}}; }

Header Plain(std::int32_t width, std::int32_t height, char compression = 0, std::int32_t type = 1) {
  return {{"channels", "chlist", Rgb(type), {}},
          {"compression", "compression", Bytes(compression), {}},
          Window(width, height),
          {"displayWindow", "box2i", Bytes(0, 0, 63, 31), {}},
          {"lineOrder", "lineOrder", Bytes('\0'), {}},
          {"pixelAspectRatio", "float", Bytes(1.0f), {}},
          {"screenWindowCenter", "v2f", Bytes(0.0f, 0.0f), {}},
          {"screenWindowWidth", "float", Bytes(1.0f), {}}};
}

Header With(Header header, const Attribute& more) {
  std::erase_if(header, [&](const Attribute& one) { return one.name == more.name; });
  header.push_back(more);
  return header;
}

Header Without(Header header, const std::string& name) {
  std::erase_if(header, [&](const Attribute& one) { return one.name == name; });
  return header;
}

// A file of these headers and `length` bytes in all, with one chunk that begins behind the table.
std::string File(const std::vector<Header>& parts, std::uint32_t flags = 0,
                 std::size_t length = 700) {
  std::string bytes = Bytes(std::uint32_t{20000630}, 2 | flags);
  for (const Header& part : parts) {
    for (const Attribute& attribute : part) bytes += attribute.text();
    bytes += '\0';
  }
  if (flags & kMultiPart) bytes += '\0';
  bytes += Bytes(std::uint64_t{bytes.size() + 8});
  if (bytes.size() < length) bytes.resize(length, '\0');
  return bytes;
}

class ExrPrecheck : public testing::Test {
 protected:
  ~ExrPrecheck() override { fs::remove(path_); }

  // Opens the file and reads all that it shows; whether that was refused. Says what memory it took.
  bool IsRefused(const std::string& bytes) {
    std::ofstream(path_, std::ios::binary) << bytes;
    TakePeakMib();
    const double before = TakePeakMib();
    bool refused = false;
    try {
      ExrReader reader(path_);
      std::vector<std::vector<float>> planes;
      for (std::size_t part = 0; part < reader.parts().size(); ++part)
        for (const std::string& channel : reader.parts()[part].channels)
          planes.push_back(reader.ReadFloat(static_cast<int>(part), channel));
    } catch (const InputError& error) {
      said_ = error.what();
      EXPECT_THAT(said_, testing::HasSubstr(path_.string()));
      refused = true;
    }
    took_mib_ = TakePeakMib() - before;
    return refused;
  }

  fs::path path_ = fs::path(testing::TempDir()) / fmt::format("exr_precheck_{}.exr", ::getpid());
  std::string said_;
  double took_mib_ = 0;
};

TEST_F(ExrPrecheck, HeadersByHandAreRead) {
  // Two scan lines of three channels, uncompressed.
  std::string bytes = File({Plain(1, 2, 0, 2)}, 0, 0);
  bytes += Bytes(std::uint64_t{bytes.size() + 8 + 8 + 12});  // where the second line lies
  bytes += Bytes(0, 12, 1.0f, 2.0f, 3.0f) + Bytes(1, 12, 4.0f, 5.0f, 6.0f);
  const std::size_t first = bytes.size() - 2 * 20 - 16;
  const std::uint64_t at = first + 16;
  std::memcpy(bytes.data() + first, &at, 8);
  ASSERT_FALSE(IsRefused(bytes)) << said_;
  EXPECT_THAT(ExrReader(path_).ReadFloat(0, "R"), testing::ElementsAre(3, 6));
}

TEST_F(ExrPrecheck, LiesOfSomeHundredBytesAreRefusedForLittleMemory) {
  constexpr std::int32_t kWide = 1 << 25;
  const Header small = Plain(4, 4);
  const std::string wide = Window(kWide, 1).text();
  std::map<std::string, std::string> lies;
  const auto lie = [&](const std::string& name, const std::vector<Header>& parts,
                       std::uint32_t flags = 0) { lies[name] = File(parts, flags); };

  lie("a list of channels goes on", {With(Plain(kWide, 1), {"channels", "chlist", Rgb(), 4})});
  lie("a list of channels ends early, and hides a window",
      {With(small, {"channels", "chlist", Rgb() + Text("dataWindow") + Text("box2i") + wide, {}})});
  for (const auto& [type, size] : std::map<std::string, std::size_t>{
           {"box2f", 16},      {"box2i", 16},   {"chromaticities", 32},
           {"compression", 1}, {"double", 8},   {"envmap", 1},
           {"float", 4},       {"int", 4},      {"keycode", 28},
           {"lineOrder", 1},   {"m33d", 72},    {"m33f", 36},
           {"m44d", 128},      {"m44f", 64},    {"rational", 8},
           {"tiledesc", 9},    {"timecode", 8}, {"v2d", 16},
           {"v2f", 8},         {"v2i", 8},      {"v3d", 24},
           {"v3f", 12},        {"v3i", 12},     {"deepImageState", 1}}) {
    Header header = Without(small, "dataWindow");
    header.push_back(Window(4, 4));
    header.push_back({"x", type, std::string(size, '\0') + wide, {}});
    lie(type + " hides a window", {header});
  }
  lie("floats of 3 bytes", {With(small, {"x", "floatvector", std::string(3, 'x'), {}})});
  lie("a window of 4 bytes", {With(small, {"dataWindow", "box2i", Window(kWide, 1).value, 4})});
  lie("no window", {Without(small, "dataWindow")});
  lie("no channels", {Without(small, "channels")});
  for (const Attribute& twice : {Window(kWide, 1), Attribute{"channels", "chlist", Rgb(2), {}}}) {
    Header header = small;
    header.push_back(twice);
    lie(twice.name + " twice", {header});
  }
  lie("a window that is text", {With(small, {"dataWindow", "string", Window(kWide, 1).value, {}})});
  Header long_name = small;
  long_name.push_back({std::string(255, 'x'), "int", Bytes(0), {}});
  lie("a name of 255 letters", {long_name});

  for (char compression = 0; compression < 10; ++compression)
    lie(fmt::format("a line, compression {}", int{compression}), {Plain(kWide, 1, compression)});
  lie("a million lines", {Plain(1, 1 << 20)});
  lie("lines that tiles would have few of", {With(Plain(1, 1 << 20), Tiles(1, 1 << 20))});
  lie("large tiles", {With(small, Tiles(1 << 14, 1 << 13))}, kTiled);
  lie("tiles without end", {With(small, Tiles(INT32_MAX, INT32_MAX))}, kTiled);
  lie("a compression of no kind", {Plain(kWide, 1, 77)});
  lie("a preview",
      {With(small, {"preview", "preview", Bytes(1 << 14, 1 << 14) + std::string(16, '\0'), {}})});
  lie("a preview that claims its size",
      {With(small, {"preview", "preview", Bytes(1 << 13, 1 << 13), (1 << 28) + 8})});

  const auto part = [](Header header, const std::string& name, const std::string& type) {
    header.push_back({"name", "string", name, {}});
    header.push_back(TypeOf(type));
    header.push_back({"chunkCount", "int", Bytes(1 << 20), {}});
    return header;
  };
  lie("parts of lines",
      {part(Plain(kWide, 1, 8), "a", "scanlineimage"),
       part(Plain(kWide, 1, 8), "b", "scanlineimage")},
      kMultiPart);
  lie("a part of no kind", {part(Plain(4, 4), "a", "x"), part(small, "b", "scanlineimage")},
      kMultiPart);
  lie("deep lines", {With(small, TypeOf("deepscanline"))}, kNonImage);
  lie("deep tiles", {With(With(small, TypeOf("deeptile")), Tiles(4, 4))}, kNonImage | kTiled);
  lie("a deep part", {part(small, "a", "scanlineimage"), part(small, "b", "deepscanline")},
      kMultiPart | kNonImage);
  lie("an ID manifest", {With(small, {"x", "idmanifest", Bytes(std::uint64_t{1} << 40), {}})});

  for (const auto& [name, bytes] : lies) {
    ASSERT_LT(bytes.size(), 2000u) << name;
    EXPECT_TRUE(IsRefused(bytes)) << name;
    EXPECT_LT(took_mib_, 50) << name;
    EXPECT_THAT(said_, testing::Not(testing::HasSubstr("not a readable"))) << name << ": " << said_;
  }
}

// The widest line that is not refused for its size, of every compression.
TEST_F(ExrPrecheck, WhatASmallFileMayClaimTakesLittleMemory) {
  for (char compression = 0; compression < 10; ++compression)
    for (const std::uint32_t flags : {0u, kTiled}) {
      const auto file = [&](std::int32_t width) {
        Header header = Plain(width, 1, compression);
        if (flags) header.push_back(Tiles(width, 64));
        return File({header}, flags);
      };
      const auto is_passed = [&](std::int32_t width) {
        std::ofstream(path_, std::ios::binary) << file(width);
        try {
          CheckExrHeaders(path_);
          return true;
        } catch (const InputError&) {
          return false;
        }
      };
      std::int32_t passed = 1, refused = 1 << 28;
      ASSERT_TRUE(is_passed(passed));
      while (refused - passed > 1) {
        const std::int32_t middle = passed + (refused - passed) / 2;
        (is_passed(middle) ? passed : refused) = middle;
      }
      IsRefused(file(passed));
      EXPECT_LT(took_mib_, kMostMib) << int{compression} << ", " << passed << " pixels";
    }
}

// The smallest files that there are for their pixels.
TEST_F(ExrPrecheck, PicturesOfOneValueAreRead) {
  constexpr int kSide = 512;
  for (int compression = 0; compression < 10; ++compression)
    for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT})
      for (const bool tiled : {false, true})
        for (const float value : {0.0f, 0.5f}) {
          Imf::Header header(kSide, kSide);
          header.compression() = static_cast<Imf::Compression>(compression);
          if (tiled) header.setTileDescription(Imf::TileDescription(kSide, kSide));
          const std::vector<float> floats(std::size_t{kSide} * kSide, value);
          const std::vector<half> halves(std::size_t{kSide} * kSide, half(value));
          Imf::FrameBuffer buffer;
          const bool is_half = type == Imf::HALF;
          const auto* pixels = is_half ? static_cast<const void*>(halves.data()) : floats.data();
          const std::size_t size = is_half ? 2 : 4;
          for (const char* channel : {"A", "B", "G", "R"}) {
            header.channels().insert(channel, Imf::Channel(type));
            buffer.insert(
                channel, Imf::Slice(type, const_cast<char*>(static_cast<const char*>(pixels)), size,
                                    size * kSide));
          }
          if (tiled) {
            Imf::TiledOutputFile file(path_.c_str(), header);
            file.setFrameBuffer(buffer);
            file.writeTile(0, 0);
          } else {
            Imf::OutputFile file(path_.c_str(), header);
            file.setFrameBuffer(buffer);
            file.writePixels(kSide);
          }
          SCOPED_TRACE(fmt::format("compression {}, {}, {} bytes", compression,
                                   tiled ? "tiles" : "lines", fs::file_size(path_)));
          const auto read = ExrReader(path_).ReadFloat(0, "G");
          EXPECT_TRUE(std::all_of(read.begin(), read.end(),
                                  [&](float found) { return std::abs(found - value) < 0.01f; }));
        }
}

}  // namespace
}  // namespace luxfield::core
