// Pixels read and written past the library, by the library.
#include "luxfield/core/exr_chunks.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <fstream>

#include "luxfield/core/exr_precheck.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "tests/core/memory_folder.h"
#include "tests/seed.h"

namespace luxfield::core {
namespace {

struct Folder {
  std::filesystem::path path = MemoryFolder() / ("exr_chunks_" + std::to_string(::getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

struct Picture {
  int width = 1, height = 1, top = 0, left = 0;
  std::vector<std::vector<std::uint32_t>> planes;  // bits, of channels "a", "b", ...

  std::string name(std::size_t k) const { return std::string(1, static_cast<char>('a' + k)); }
  bool is_uint(std::size_t k) const { return k % 3 == 1; }
};

// Half of the planes are smooth and become smaller, half of them cannot.
Picture MakePicture(Random& random) {
  Picture picture{1 + static_cast<int>(random() % 90),
                  1 + static_cast<int>(random() % 70),
                  static_cast<int>(random() % 9) - 4,
                  static_cast<int>(random() % 9) - 4,
                  {}};
  picture.planes.resize(1 + random() % 4);
  for (auto& plane : picture.planes) {
    const bool smooth = random() % 2;
    for (int k = 0; k < picture.width * picture.height; ++k)
      plane.push_back(smooth ? std::bit_cast<std::uint32_t>(1 + 0.01f * static_cast<float>(k))
                             : random() & 0xBFFFFFFFu);
  }
  return picture;
}

Imf::FrameBuffer BufferOf(Picture& picture) {
  Imf::FrameBuffer buffer;
  for (std::size_t k = 0; k < picture.planes.size(); ++k)
    buffer.insert(picture.name(k),
                  Imf::Slice(picture.is_uint(k) ? Imf::UINT : Imf::FLOAT,
                             reinterpret_cast<char*>(picture.planes[k].data()) -
                                 4 * (std::ptrdiff_t{picture.top} * picture.width + picture.left),
                             4, std::size_t{4} * static_cast<std::size_t>(picture.width)));
  return buffer;
}

void WriteByLibrary(const std::filesystem::path& path, std::vector<Picture>& parts,
                    Imf::Compression compression, Imf::LineOrder order) {
  std::vector<Imf::Header> headers;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Picture& part = parts[p];
    const Imath::Box2i window({part.left, part.top},
                              {part.left + part.width - 1, part.top + part.height - 1});
    Imf::Header header(Imath::Box2i({0, 0}, {9, 9}), window, 1, {0, 0}, 1, order, compression);
    header.setType(Imf::SCANLINEIMAGE);
    header.setName("part " + std::to_string(p));
    for (std::size_t k = 0; k < part.planes.size(); ++k)
      header.channels().insert(part.name(k),
                               Imf::Channel(part.is_uint(k) ? Imf::UINT : Imf::FLOAT));
    headers.push_back(header);
  }
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    Imf::OutputPart output(file, static_cast<int>(p));
    output.setFrameBuffer(BufferOf(parts[p]));
    output.writePixels(parts[p].height);
  }
}

// Whether all of a part's channels, or some rows, can be read here; they are in `read` then.
bool ReadHere(const std::filesystem::path& path, int part, const Picture& like, Picture& read,
              int first, int rows) {
  const std::uint64_t tables = CheckExrHeaders(path);
  Imf::MultiPartInputFile file(path.c_str());
  std::vector<const Imf::Header*> headers;
  for (int p = 0; p < file.parts(); ++p) headers.push_back(&file.header(p));
  const ExrChunks chunks(path, headers, tables);
  std::vector<ExrTarget> targets;
  read = like;
  for (std::size_t k = read.planes.size(); k-- > 0;) {  // in any order
    read.planes[k].assign(static_cast<std::size_t>(rows) * like.width, 7);
    const std::span<std::uint32_t> bits(read.planes[k]);
    if (read.is_uint(k))
      targets.push_back({read.name(k), bits});
    else
      targets.push_back(
          {read.name(k), std::span(reinterpret_cast<float*>(bits.data()), bits.size())});
  }
  return chunks.Read(part, targets, first, rows);
}

std::vector<std::uint32_t> Rows(const Picture& picture, std::size_t plane, int first, int rows) {
  const auto begin = picture.planes[plane].begin() + std::ptrdiff_t{first} * picture.width;
  return {begin, begin + std::ptrdiff_t{rows} * picture.width};
}

TEST(ExrChunks, ReadWhatTheLibraryWrote) {
  const Folder folder;
  const auto path = folder.path / "a.exr";
  Random random(TestSeed(401), 0);
  for (int round = 0; round < 24; ++round) {
    std::vector<Picture> parts;
    for (std::size_t p = 0; p < 1 + random() % 3; ++p) parts.push_back(MakePicture(random));
    constexpr Imf::Compression kCompressions[] = {Imf::NO_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                                  Imf::ZIP_COMPRESSION};
    WriteByLibrary(path, parts, kCompressions[round % 3],
                   random() % 2 ? Imf::INCREASING_Y : Imf::DECREASING_Y);
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const int first = static_cast<int>(random() % static_cast<unsigned>(parts[p].height)),
                rows =
                    1 + static_cast<int>(random() % static_cast<unsigned>(parts[p].height - first));
      Picture read;
      ASSERT_TRUE(ReadHere(path, static_cast<int>(p), parts[p], read, first, rows)) << round;
      for (std::size_t k = 0; k < read.planes.size(); ++k)
        EXPECT_EQ(read.planes[k], Rows(parts[p], k, first, rows)) << round << " " << k;
      EXPECT_FALSE(
          ReadHere(path, static_cast<int>(p), parts[p], read, first, parts[p].height - first + 1));
    }
  }
}

TEST(ExrChunks, LeaveToTheLibraryWhatTheyDoNotKnow) {
  const Folder folder;
  const auto path = folder.path / "a.exr";
  Random random(TestSeed(402), 0);
  std::vector<Picture> parts{MakePicture(random)};
  Picture read;
  for (const auto compression :
       {Imf::RLE_COMPRESSION, Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION}) {
    WriteByLibrary(path, parts, compression, Imf::INCREASING_Y);
    EXPECT_FALSE(ReadHere(path, 0, parts[0], read, 0, 1)) << compression;
  }
  WriteByLibrary(path, parts, Imf::ZIP_COMPRESSION, Imf::INCREASING_Y);
  Picture other = parts[0];
  other.planes.emplace_back();  // a channel more than there are
  EXPECT_FALSE(ReadHere(path, 0, other, read, 0, 1));
  EXPECT_FALSE(ReadHere(path, 1, parts[0], read, 0, 1));
}

TEST(ExrChunks, LeaveToTheLibraryWhatIsDamaged) {
  const Folder folder;
  const auto path = folder.path / "a.exr";
  Random random(TestSeed(403), 0);
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::ZIP_COMPRESSION}) {
    Picture picture{40, 64, 0, 0, {std::vector<std::uint32_t>(40 * 64)}};
    for (std::size_t k = 0; k < picture.planes[0].size(); ++k)
      picture.planes[0][k] = std::bit_cast<std::uint32_t>(1 + 0.01f * static_cast<float>(k));
    std::vector<Picture> parts(2, picture);
    WriteByLibrary(path, parts, compression, Imf::INCREASING_Y);
    const std::string whole = ReadFile(path);
    const std::uint64_t tables = CheckExrHeaders(path);
    const std::size_t chunks = compression == Imf::ZIP_COMPRESSION ? 4 : 64;
    std::uint64_t offset = 0;
    std::memcpy(&offset, whole.data() + tables + 8 * chunks, 8);  // of the first of the second part
    const auto damaged = [&](const auto& damage) {
      std::string bytes = whole;
      damage(bytes);
      std::ofstream(path, std::ios::binary) << bytes;
      Picture read;
      return !ReadHere(path, 1, picture, read, 0, 64);
    };
    EXPECT_FALSE(damaged([](std::string&) {}));
    for (const int field : {0, 4})  // part, row
      EXPECT_TRUE(damaged([&](std::string& bytes) { ++bytes[offset + field]; })) << field;
    EXPECT_TRUE(damaged([&](std::string& bytes) { bytes[offset + 11] = '\x80'; }));  // size
    EXPECT_TRUE(damaged([&](std::string& bytes) { bytes.resize(bytes.size() - 1); }));
    EXPECT_TRUE(damaged([&](std::string& bytes) {  // an offset of none
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(tables + 8 * (chunks + 1)), 8, '\0');
    }));
    EXPECT_TRUE(damaged([&](std::string& bytes) {  // an offset beyond all
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(tables + 8 * (chunks + 1)), 8,
                  '\xff');
    }));
    if (compression == Imf::ZIP_COMPRESSION) {
      EXPECT_TRUE(damaged([&](std::string& bytes) { bytes[offset + 40] ^= 1; }));
    }
  }
}

TEST(ExrChunks, TheLibraryReadsWhatIsWritten) {
  const Folder folder;
  const auto path = folder.path / "a.exr";
  Random random(TestSeed(404), 0);
  for (int round = 0; round < 20; ++round) {
    std::vector<Picture> parts;
    std::vector<std::vector<std::vector<float>>> floats;
    std::vector<ExrPartView> views;
    for (std::size_t p = 0; p < 1 + random() % 3; ++p) parts.push_back(MakePicture(random));
    for (std::size_t p = 0; p < parts.size(); ++p) {
      Picture& part = parts[p];
      part.top = part.left = 0;
      ExrPartView view{"part " + std::to_string(p), part.width, part.height, {}, {{"n", 3}}};
      floats.emplace_back(part.planes.size());
      for (std::size_t k = part.planes.size(); k-- > 0;) {  // not in the order of the names
        if (part.is_uint(k)) {
          view.channels.push_back({part.name(k), std::span<const std::uint32_t>(part.planes[k])});
          continue;
        }
        for (const std::uint32_t bits : part.planes[k])
          floats[p][k].push_back(std::bit_cast<float>(bits));
        view.channels.push_back({part.name(k), std::span<const float>(floats[p][k])});
      }
      views.push_back(std::move(view));
    }
    WriteExr(path, views);
    Imf::MultiPartInputFile file(path.c_str());
    ASSERT_EQ(file.parts(), static_cast<int>(parts.size()));
    for (std::size_t p = 0; p < parts.size(); ++p) {
      ASSERT_TRUE(file.partComplete(static_cast<int>(p)));
      Picture read = parts[p];
      for (auto& plane : read.planes) plane.assign(plane.size(), 7);
      Imf::InputPart input(file, static_cast<int>(p));
      input.setFrameBuffer(BufferOf(read));
      input.readPixels(0, read.height - 1);
      for (std::size_t k = 0; k < read.planes.size(); ++k)
        EXPECT_EQ(read.planes[k], parts[p].planes[k]) << round << " " << k;
    }
  }
}

TEST(ExrChunks, SmoothPicturesShrinkAndNoiseIsStored) {
  const Folder folder;
  const auto path = folder.path / "a.exr";
  Random random(TestSeed(405), 0);
  constexpr int kWidth = 64, kHeight = 48;
  constexpr std::size_t kBytes = std::size_t{4} * kWidth * kHeight;
  std::vector<float> smooth, noise;
  for (int k = 0; k < kWidth * kHeight; ++k) {
    const int row = k / kWidth;
    smooth.push_back(1 + 0.01f * static_cast<float>(row));
    noise.push_back(std::bit_cast<float>(random() & 0xBFFFFFFFu));
  }
  const auto size_of = [&](const std::vector<float>& pixels) {
    const ExrPartView view{"", kWidth, kHeight, {{"Y", std::span<const float>(pixels)}}, {}};
    WriteExr(path, std::span(&view, 1));
    return std::filesystem::file_size(path);
  };
  EXPECT_LT(size_of(smooth), kBytes / 4);
  EXPECT_GE(size_of(noise), kBytes);
}

}  // namespace
}  // namespace luxfield::core
