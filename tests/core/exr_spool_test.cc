// Files of bands of rows are, to the byte, those of whole parts.
#include "luxfield/core/exr_spool.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>

#include "luxfield/core/exr_rows.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "tests/core/memory_folder.h"
#include "tests/seed.h"

namespace luxfield::core {
namespace {

// Parts of one size; half of the planes become smaller, the others cannot.
struct Parts {
  std::vector<ExrPartView> views;
  std::vector<std::vector<std::uint32_t>> planes;  // bits, channel after channel of each part

  Parts(Random& random, int width, int height, int count) {
    const std::size_t channels = 1 + random() % 3;
    const std::vector<std::string> names{"R", "B", "G"};  // not in the order of the file
    for (int part = 0; part < count; ++part) {
      ExrPartView& view =
          views.emplace_back(ExrPartView{fmt::format("p{}", part), width, height, {}, {}});
      for (std::size_t c = 0; c < channels; ++c) {
        const bool smooth = random() % 2;
        auto& plane = planes.emplace_back();
        for (int k = 0; k < width * height; ++k)
          plane.push_back(smooth ? std::bit_cast<std::uint32_t>(1 + 0.01f * static_cast<float>(k))
                                 : random() & 0xBFFFFFFFu);
        if (c == 1)
          view.channels.push_back({names[c], std::span<const std::uint32_t>()});
        else
          view.channels.push_back({names[c], std::span<const float>()});
      }
    }
    views.front().attributes["kind"] = std::string("bands");
  }

  std::size_t channels() const { return views.front().channels.size(); }
  std::vector<ExrPixels> Rows(int part, int first, int rows) const {
    const auto width = static_cast<std::size_t>(views.front().width);
    std::vector<ExrPixels> pixels;
    for (std::size_t c = 0; c < channels(); ++c) {
      const auto of_rows =
          std::span(planes[part * channels() + c]).subspan(first * width, rows * width);
      if (c == 1)
        pixels.emplace_back(of_rows);
      else
        pixels.emplace_back(
            std::span(reinterpret_cast<const float*>(of_rows.data()), of_rows.size()));
    }
    return pixels;
  }
};

class ExrRowSpoolTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ = MemoryFolder() / fmt::format("exr_spool_{}", ::getpid());
};

TEST_F(ExrRowSpoolTest, FilesOfBandsAreThoseOfWholeParts) {
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    Random random(TestSeed(34), stream);
    const int height = 1 + static_cast<int>(random() % 70);
    const Parts parts(random, 1 + static_cast<int>(random() % 90), height,
                      1 + static_cast<int>(random() % 4));
    WriteExr(folder_ / "whole.exr", parts.views, ExrCompression::kZip,
             [&](int part) { return parts.Rows(part, 0, height); });
    ExrRowSpool spool(folder_ / "bands.exr", parts.views);
    for (int first = 0; first < height;) {
      const int rows = std::min(height - first, 16 * (1 + static_cast<int>(random() % 3)));
      spool.Add(rows, [&](int part) { return parts.Rows(part, first, rows); });
      first += rows;
    }
    spool.Write();
    EXPECT_EQ(ReadFile(folder_ / "bands.exr"), ReadFile(folder_ / "whole.exr"))
        << "stream " << stream;
  }
  // Scratch has no name.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 2);
}

// Rows of float channels that were marked, and no others, are mended before they are written.
TEST_F(ExrRowSpoolTest, MarkedRowsAreMended) {
  Random random(TestSeed(35), 0);
  constexpr int kHeight = 40;
  const Parts parts(random, 9, kHeight, 2);
  ExrRowSpool spool(folder_ / "mended.exr", parts.views);
  spool.Add(32, [&](int part) { return parts.Rows(part, 0, 32); }, {false, true});
  spool.Add(8, [&](int part) { return parts.Rows(part, 32, 8); });
  spool.Write([](int part, const std::string& channel, std::span<float> row) {
    row.front() = static_cast<float>(part) + (channel == "R" ? 0.5f : 0.25f);
  });
  ExrReader reader(folder_ / "mended.exr");
  for (int part = 0; part < 2; ++part)
    for (std::size_t c = 0; c < parts.channels(); c += 2) {
      const std::string channel = parts.views[part].channels[c].name;
      const auto read = reader.ReadFloat(part, channel);
      const auto pixels = parts.Rows(part, 0, kHeight);
      const auto written = std::get<0>(pixels[c]);
      for (std::size_t k = 0; k < read.size(); ++k) {
        const bool mended = k % 9 == 0 && k / 9 >= 16 && k / 9 < 32;
        const float wanted =
            mended ? static_cast<float>(part) + (channel == "R" ? 0.5f : 0.25f) : written[k];
        ASSERT_EQ(std::bit_cast<std::uint32_t>(read[k]), std::bit_cast<std::uint32_t>(wanted)) << k;
      }
    }
}

// Rows of a file are those of the whole part, packed or not.
TEST_F(ExrRowSpoolTest, SomeRowsAreReadAlone) {
  Random random(TestSeed(36), 0);
  constexpr int kHeight = 53, kWidth = 21;
  const Parts parts(random, kWidth, kHeight, 2);
  for (const auto compression : {ExrCompression::kNone, ExrCompression::kZip}) {
    WriteExr(folder_ / "rows.exr", parts.views, compression,
             [&](int part) { return parts.Rows(part, 0, kHeight); });
    const ExrReader reader(folder_ / "rows.exr");
    ExrRowReader of_rows(reader);
    for (const auto& [first, count] : std::vector<std::pair<int, int>>{{0, 53}, {0, 1}, {15, 20}}) {
      std::vector<float> rows(static_cast<std::size_t>(kWidth * count));
      std::vector<std::uint32_t> integers(rows.size());
      std::vector<ExrTarget> targets{{"R", std::span(rows)}};
      if (parts.channels() > 1) targets.push_back({"B", std::span(integers)});
      of_rows.Read(1, targets, first, count);
      const auto pixels = parts.Rows(1, first, count);
      EXPECT_EQ(std::memcmp(rows.data(), std::get<0>(pixels[0]).data(), 4 * rows.size()), 0)
          << first;
      if (parts.channels() < 2) continue;
      EXPECT_EQ(std::memcmp(integers.data(), std::get<1>(pixels[1]).data(), 4 * integers.size()), 0)
          << first;
    }
  }
}

}  // namespace
}  // namespace luxfield::core
