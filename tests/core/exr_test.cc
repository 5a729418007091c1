// OpenEXR: bit-exact round trips, foreign files, hostile files.
#include "luxfield/core/exr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>

#include "luxfield/core/error.h"
#include "luxfield/core/exr_bytes.h"
#include "luxfield/core/file.h"
#include "luxfield/core/random.h"
#include "tests/seed.h"
#include "tests/test_data.h"

namespace luxfield::core {
namespace {

using testing::HasSubstr;

// Paths in a folder of this process that goes when it ends.
std::filesystem::path UniquePath() {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::path(testing::TempDir()) / ("core_exr_" + std::to_string(::getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  static int counter = 0;
  return folder.path / (std::to_string(counter++) + ".exr");
}

void WriteBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

struct TwoParts {
  std::vector<float> a, b;
  std::vector<std::uint32_t> n;
  std::vector<ExrPartView> views;

  TwoParts() {
    Random random(91, 0);
    for (int k = 0; k < 35; ++k) a.push_back(std::bit_cast<float>(random() & 0xBFFFFFFFu));
    a[0] = NAN, a[1] = -INFINITY, a[2] = -0.0f, a[3] = 1e-42f;
    for (int k = 0; k < 12; ++k) b.push_back(random.UniformFloat());
    for (int k = 0; k < 35; ++k) n.push_back(random());
    views = {{"first",
              7,
              5,
              {{"z", std::span<const float>(a)}, {"n", std::span<const std::uint32_t>(n)}},
              {{"i", 7}, {"d", 0.1}, {"s", "text"}, {"a long name beyond thirty-one letters", 1}}},
             {"second", 4, 3, {{"Y", std::span<const float>(b)}}, {}}};
  }
};

TEST(Exr, RoundTripIsBitExact) {
  for (const auto compression : {ExrCompression::kNone, ExrCompression::kZip}) {
    const TwoParts out;
    const auto path = UniquePath();
    WriteExr(path, out.views, compression);
    ExrReader reader(path);
    ASSERT_EQ(reader.parts().size(), 2u);
    const int first = reader.find_part("first"), second = reader.find_part("second");
    ASSERT_GE(first, 0);
    EXPECT_EQ(reader.find_part("third"), -1);
    EXPECT_EQ(reader.parts()[first].width, 7);
    EXPECT_EQ(reader.parts()[first].height, 5);
    const auto a = reader.ReadFloat(first, "z");
    ASSERT_EQ(a.size(), out.a.size());
    EXPECT_EQ(std::memcmp(a.data(), out.a.data(), 4 * a.size()), 0);
    EXPECT_EQ(reader.ReadUint(first, "n"), out.n);
    EXPECT_EQ(reader.ReadFloat(second, "Y"), out.b);
    EXPECT_EQ(reader.GetInt(first, "i"), 7);
    EXPECT_EQ(reader.GetDouble(first, "d"), 0.1);
    EXPECT_EQ(reader.GetDouble(first, "i"), 7);
    EXPECT_EQ(reader.GetString(first, "s"), "text");
    EXPECT_EQ(reader.GetInt(first, "a long name beyond thirty-one letters"), 1);
  }
}

TEST(Exr, EqualInputsGiveEqualBytes) {
  const TwoParts out;
  const auto a = UniquePath(), b = UniquePath();
  WriteExr(a, out.views);
  WriteExr(b, out.views);
  EXPECT_EQ(ReadFile(a), ReadFile(b));
}

TEST(Exr, PicturesRoundTrip) {
  for (const int channels : {1, 3}) {
    Image image(5, 4, channels);
    Random random(92, 0);
    for (float& v : image.data) v = random.UniformFloat();
    const auto path = UniquePath();
    WriteExrImage(path, image);
    const Image back = ReadExrImage(path);
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.data, image.data);
    EXPECT_EQ(ExrImageBytes(image, "picture"), ReadFile(path));
  }
}

TEST(Exr, WrongQuestionsAreInputErrorsThatNameTheFile) {
  const TwoParts out;
  const auto path = UniquePath();
  WriteExr(path, out.views);
  ExrReader reader(path);
  const auto error = [&](auto&& use) -> std::string {
    try {
      use();
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr(path.string()));
      return e.what();
    }
    return "no error";
  };
  const int first = reader.find_part("first");
  EXPECT_THAT(error([&] { reader.ReadFloat(first, "absent"); }), HasSubstr("'absent'"));
  EXPECT_THAT(error([&] { reader.ReadUint(first, "absent"); }), HasSubstr("'absent'"));
  EXPECT_THAT(error([&] { reader.ReadFloat(first, "n"); }), HasSubstr("integers"));
  EXPECT_THAT(error([&] { reader.ReadUint(first, "z"); }), HasSubstr("floats"));
  EXPECT_THAT(error([&] { reader.GetInt(first, "absent"); }), HasSubstr("'absent'"));
  EXPECT_THAT(error([&] { reader.GetInt(first, "d"); }), HasSubstr("'d'"));
  EXPECT_THAT(error([&] { reader.GetDouble(first, "s"); }), HasSubstr("'s'"));
  EXPECT_THAT(error([&] { reader.GetString(first, "i"); }), HasSubstr("'i'"));
  EXPECT_THAT(error([&] { ReadExrImage(path); }), HasSubstr("neither"));
}

TEST(Exr, CannotWriteIsADeviceErrorAndLeavesNothing) {
  const TwoParts out;
  EXPECT_THROW(WriteExr("/nonexistent/a.exr", out.views), DeviceError);
}

void ExpectRefused(const std::filesystem::path& path, const std::string& what) {
  try {
    ExrReader reader(path);
    for (int part = 0; part < static_cast<int>(reader.parts().size()); ++part)
      for (const auto& channel : reader.parts()[part].channels) {
        const auto& names = reader.parts()[part].channels;
        const auto at = std::find(names.begin(), names.end(), channel) - names.begin();
        if (reader.parts()[part].channel_is_uint[static_cast<std::size_t>(at)])
          reader.ReadUint(part, channel);
        else
          reader.ReadFloat(part, channel);
      }
    ADD_FAILURE() << what << " was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string())) << what;
  }
}

// To the last byte, by every way of writing: what the disk does not take is no file.
TEST(Exr, AFileThatTheDiskDoesNotTakeWholeIsNone) {
  const std::vector<float> pixels(40 * 30, 0.5f);
  const std::vector<ExrPartView> parts = {{.name = "a",
                                           .width = 40,
                                           .height = 30,
                                           .channels = {{"Y", std::span(pixels)}},
                                           .attributes = {}}};
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  for (const ExrCompression compression : {ExrCompression::kNone, ExrCompression::kZip}) {
    const auto whole = UniquePath(), path = UniquePath();
    WriteExr(whole, parts, compression);
    const auto size = std::filesystem::file_size(whole);
    for (const std::uintmax_t room : {size - 1, size - 100, size / 2, std::uintmax_t{1}}) {
      const rlimit less{room, before.rlim_max};
      ::setrlimit(RLIMIT_FSIZE, &less);
      EXPECT_THROW(WriteExr(path, parts, compression), DeviceError) << room << " of " << size;
      ::setrlimit(RLIMIT_FSIZE, &before);
      EXPECT_FALSE(std::filesystem::exists(path)) << room << " of " << size;
    }
  }
  ::signal(SIGXFSZ, handler);
}

TEST(Exr, MissingFolderEmptyAndTruncatedFilesAreRefused) {
  ExpectRefused("/nonexistent/a.exr", "missing");
  ExpectRefused(testing::TempDir(), "folder");
  const TwoParts out;
  const auto path = UniquePath();
  WriteExr(path, out.views);
  const std::string whole = ReadFile(path);
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 101) {
    WriteBytes(path, whole.substr(0, length));
    ExpectRefused(path, "length " + std::to_string(length));
  }
}

// Claims that would have the library reserve gigabytes: each must be refused from the header alone.
TEST(Exr, ClaimsBeyondTheFileAreRefused) {
  Image image(4, 4, 1);
  const auto path = UniquePath();
  WriteExrImage(path, image);
  const std::string whole = ReadFile(path);
  const auto spoil = [&](const std::string& attribute, std::size_t skip, std::int32_t value) {
    std::string bytes = whole;
    const std::size_t at = bytes.find(attribute) + attribute.size() + skip;
    std::memcpy(bytes.data() + at, &value, 4);
    WriteBytes(path, bytes);
    ExpectRefused(path, attribute);
  };
  const std::string window("dataWindow\0box2i\0", 17);
  spoil(window, 0, INT32_MAX);  // size of the attribute
  spoil(window, 0, -16);
  spoil(window, 4 + 8, INT32_MAX);   // x max
  spoil(window, 4 + 12, INT32_MAX);  // y max
  spoil(window, 4 + 12, 1 << 20);    // 4 million pixels in 400 bytes
  spoil(window, 4 + 8, INT32_MIN);   // negative width
  spoil(std::string("channels\0chlist\0", 16), 0, 0x7fffff00);
}

// 16384 x 16384 zeros of three channels, which DEFLATE stores in 3 MB, take 3 GiB.
TEST(Exr, FilesThatUnpackToGigabytesAreRefusedBeforeTheyDo) {
  const std::vector<float> noise = [] {
    Random random(94, 0);
    std::vector<float> values(64 * 64);
    for (float& value : values) value = static_cast<float>(random.Uniform());
    return values;
  }();
  const auto path = UniquePath();
  WriteExr(path,
           std::vector{ExrPartView{"", 64, 64, {{"R", noise}, {"G", noise}, {"B", noise}}, {}}});
  std::string bytes = ReadFile(path);
  const std::string window("dataWindow\0box2i\0", 17);
  const auto claim = [&](std::int32_t side) {
    const std::int32_t last[] = {side - 1, side - 1};
    std::memcpy(bytes.data() + bytes.find(window) + window.size() + 4 + 8, last, sizeof last);
    WriteBytes(path, bytes);
  };
  claim(16384);
  EXPECT_THAT([&] { ExrReader reader(path); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("takes 3072 MiB of memory")));
}

TEST(Exr, MutatedFilesEndInSuccessOrAnInputError) {
  Random random(TestSeed(93), 0);
  const TwoParts out;
  const auto path = UniquePath();
  WriteExr(path, out.views);
  const std::string whole = ReadFile(path);
  int refused = 0;
  for (int k = 0; k < 300; ++k) {
    std::string bytes = whole;
    for (int hit = 0; hit < 1 + static_cast<int>(random() % 3); ++hit)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    WriteBytes(path, bytes);
    try {
      ExrReader reader(path);
      for (std::size_t part = 0; part < reader.parts().size(); ++part)
        for (const auto& channel : reader.parts()[part].channels)
          reader.ReadFloat(static_cast<int>(part), channel);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

TEST(Exr, FilesOfOtherMakersRead) {
  const std::filesystem::path data = testdata::Folder();
  LUXFIELD_NEEDS_DATA(data / "env");
  int read = 0;
  for (const char* name : {"env", "exr_formats", "hdr_formats"})
    for (const auto& entry : std::filesystem::directory_iterator(data / name)) {
      if (entry.path().extension() != ".exr") continue;
      SCOPED_TRACE(entry.path().string());
      ExrReader reader(entry.path());
      for (std::size_t part = 0; part < reader.parts().size(); ++part)
        for (const auto& channel : reader.parts()[part].channels)
          EXPECT_GT(reader.ReadFloat(static_cast<int>(part), channel).size(), 1u);
      ++read;
    }
  EXPECT_GE(read, 10);
}

}  // namespace
}  // namespace luxfield::core
