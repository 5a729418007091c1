// TM-25: files of other makers, files built here byte by byte, and what the reader refuses.
#include "luxfield/formats/ray_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <numeric>

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "tests/lightfield/support.h"
#include "tests/seed.h"
#include "tests/test_data.h"

namespace luxfield::formats {
namespace {

using testing::HasSubstr;

// The layout, written out again from the description: header 256 B, flags 32 B, texts 36 000 B,
// then what `tail` holds.
struct Bytes {
  std::string data = std::string(36288, '\0');

  template <typename T>
  void Set(std::size_t at, T value) {
    std::memcpy(data.data() + at, &value, sizeof(T));
  }
  template <typename T>
  void Append(T value) {
    data.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void AppendRow(std::initializer_list<float> row) {
    for (const float value : row) Append(value);
  }
  void SetFlag(int flag, bool value) { Set(256 + 4 * flag, std::int32_t{value}); }
  std::filesystem::path Save() const {
    const auto path = lightfield::UniquePath(".tm25ray");
    std::ofstream(path, std::ios::binary) << data;
    return path;
  }
};

// Radiant flux, no spectrum, no rays yet.
Bytes Plain(std::uint64_t rays) {
  Bytes b;
  b.data.replace(0, 4, "TM25");
  b.Set(4, std::int32_t{2013});
  b.Set(12, std::uint32_t{0x7FC00001});
  b.Set(16, 2.5f);
  b.Set(20, rays);
  b.data.replace(28, 24, "2025-02-24T15:22:34+0100");
  for (const int flag : {0, 1, 2}) b.SetFlag(flag, true);
  return b;
}

Bytes TwoRays() {
  Bytes b = Plain(2);
  b.AppendRow({1, 2, 3, 0, 0, 1, 0.5f});
  b.AppendRow({-4, 5, 6, 0.6f, 0, -0.8f, 0.25f});
  return b;
}

std::string Refusal(const Bytes& bytes) {
  const auto path = bytes.Save();
  std::string header_text;
  try {
    ReadTm25Header(path);
  } catch (const InputError& error) {
    header_text = error.what();
  }
  try {
    ReadTm25(path);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    if (!header_text.empty()) {
      EXPECT_EQ(header_text, error.what());
    }
    return error.what();
  }
  return "accepted";
}

TEST(RayFile, ReadsWhatTheLayoutSays) {
  const auto path = TwoRays().Save();
  const RayFile file = ReadTm25(path);
  EXPECT_EQ(file.header.version, 2013);
  EXPECT_FALSE(file.header.luminous_flux_lm.has_value());
  EXPECT_EQ(file.header.radiant_flux_w, 2.5);
  EXPECT_EQ(file.header.date_time, "2025-02-24T15:22:34+0100");
  EXPECT_FALSE(file.flux_is_luminous);
  ASSERT_EQ(file.rays.size(), 2u);
  EXPECT_EQ(file.rays[0].position_m.y, 0.002);
  EXPECT_EQ(file.rays[1].direction.z, -0.8f);
  EXPECT_EQ(file.rays[1].flux, 0.25);
  EXPECT_FALSE(file.rays[0].tristimulus.has_value());
  EXPECT_EQ(ReadTm25Header(path).ray_count, 2u);
}

// 51 rows leave 4 bytes of padding, 76 leave 28, 86 leave 12; two tables are padded together.
TEST(RayFile, SpectralTablesArePaddedAsABlock) {
  for (const auto& [rows, padding] : std::vector<std::pair<std::vector<int>, int>>{
           {{51}, 4}, {{76}, 28}, {{86}, 12}, {{3, 4}, 0}, {{3, 3}, 8}}) {
    Bytes b = Plain(1);
    const bool per_ray = rows.size() > 1;
    b.Set(60, std::int32_t{per_ray ? 4 : 3});
    b.Set(68, 380.0f);
    b.Set(72, 780.0f);
    b.Set(76, static_cast<std::int32_t>(rows.size()));
    if (per_ray) b.SetFlag(7, true);
    for (const int count : rows) {
      b.Append(std::int32_t{count});
      for (int k = 0; k < count; ++k) b.AppendRow({380.0f + static_cast<float>(k), 100});
    }
    b.data.append(static_cast<std::size_t>(padding), '\0');
    b.AppendRow({1, 2, 3, 0, 0, 1, 7});
    if (per_ray) b.AppendRow({2});
    const RayFile file = ReadTm25(b.Save());
    ASSERT_EQ(file.rays.size(), 1u) << rows[0];
    EXPECT_EQ(file.rays[0].flux, 7);
  }
}

TEST(RayFile, EveryOptionalColumnHasItsPlace) {
  // Radiant, wavelength, luminous, Stokes and polarisation, X Z, two additional columns, 5 bytes of
  // unpadded text.
  Bytes b = Plain(1);
  for (const int flag : {3, 4, 5, 6}) b.SetFlag(flag, true);
  b.Set(80, std::int32_t{2});
  b.Set(84, std::int32_t{5});
  for (const char32_t letter : {U'p', U'é'}) {
    std::string label(512, '\0');
    std::memcpy(label.data(), &letter, 4);
    b.data += label;
  }
  b.data += "hello";
  b.AppendRow({1, 2, 3, 0, 0, 1, /*W*/ 10, /*nm*/ 500, /*Y*/ 20, 0, 0, 0, 1, 0, 0, /*X Z*/ 30, 40,
               NAN, 99});
  const RayFile file = ReadTm25(b.Save());
  EXPECT_TRUE(file.flux_is_luminous);
  ASSERT_EQ(file.rays.size(), 1u);
  EXPECT_EQ(file.rays[0].flux, 20);
  EXPECT_EQ(*file.rays[0].tristimulus, (std::array<double, 3>{30, 20, 40}));
  EXPECT_EQ(file.header.additional_columns, (std::vector<std::string>{"p", "é"}));
}

TEST(RayFile, UnknownFluxesIncludeTheByteSwappedNan) {
  Bytes b = TwoRays();
  const unsigned char swapped[] = {0x7F, 0x80, 0x00, 0x01};
  std::memcpy(b.data.data() + 16, swapped, 4);
  b.Set(12, 0.0f);
  const RayFileHeader header = ReadTm25Header(b.Save());
  EXPECT_FALSE(header.radiant_flux_w.has_value());
  EXPECT_FALSE(header.luminous_flux_lm.has_value());
}

TEST(RayFile, WriteThenReadKeepsEveryBit) {
  RayFile file;
  file.flux_is_luminous = true;
  file.header.luminous_flux_lm = 123.5;
  file.header.creation_method = 1;
  file.header.start_position = 3;
  file.header.date_time = "2026-11-21T13:50:29";
  file.header.texts = {"Lampe für Straße",          "Ω", "", "", "", "", "",
                       "start points on U (z = 0)", "𝄞"};
  core::Random random(61, 0);
  for (int k = 0; k < 5000; ++k) {
    Ray ray;
    // Values that float32 millimetres hold exactly.
    ray.position_m = 1e-3 * lightfield::Vec3{random.UniformFloat(), random.UniformFloat(), 0};
    const float x = random.UniformFloat() - 0.5f;
    ray.direction = {x, 0, std::sqrt(1 - x * x)};
    ray.flux = random.UniformFloat();
    ray.tristimulus = {random.UniformFloat(), ray.flux, random.UniformFloat()};
    file.rays.push_back(ray);
  }
  const auto path = lightfield::UniquePath(".tm25ray");
  WriteTm25(path, file);
  EXPECT_EQ(std::filesystem::file_size(path), 36288u + 5000 * 4 * 9);
  const RayFile back = ReadTm25(path);
  ASSERT_EQ(back.rays.size(), file.rays.size());
  EXPECT_TRUE(back.flux_is_luminous);
  EXPECT_EQ(back.header.luminous_flux_lm, 123.5);
  EXPECT_FALSE(back.header.radiant_flux_w.has_value());
  EXPECT_EQ(back.header.texts, file.header.texts);
  EXPECT_EQ(back.header.date_time, file.header.date_time);
  EXPECT_EQ(back.header.start_position, 3);
  for (std::size_t k = 0; k < file.rays.size(); ++k) {
    EXPECT_NEAR(back.rays[k].position_m.x, file.rays[k].position_m.x, 1e-18);
    EXPECT_EQ(back.rays[k].direction.x, file.rays[k].direction.x);
    EXPECT_EQ(back.rays[k].flux, file.rays[k].flux);
    EXPECT_EQ(*back.rays[k].tristimulus, *file.rays[k].tristimulus);
  }
  // The second generation equals the first to the byte.
  const auto again = lightfield::UniquePath(".tm25ray");
  WriteTm25(again, back);
  EXPECT_EQ(core::ReadFile(again), core::ReadFile(path));
}

// The format holds UTF-32. A byte that begins no whole UTF-8 sequence becomes U+FFFD, which is EF BF
// BD in UTF-8, and the text goes on behind it.
TEST(RayFile, BytesThatAreNoUtf8AreReplacedOneByOne) {
  const std::string mark = "\xEF\xBF\xBD";
  RayFile file;
  file.header.texts = {
      "a\x80z",          // a continuation without its lead
      "a\xC3z",          // a lead, and no continuation after it
      "a\xE2\x82z",      // a continuation short
      "a\xE2\x82",       // the same at the text's end
      "a\xF8\x88\x80z",  // a lead that UTF-8 does not have
      "a\xE2\x82\xACz",  // the euro sign, whole
  };
  const auto path = lightfield::UniquePath(".tm25ray");
  WriteTm25(path, file);
  const std::vector<std::string> texts = {"a" + mark + "z",
                                          "a" + mark + "z",
                                          "a" + mark + mark + "z",
                                          "a" + mark + mark,
                                          "a" + mark + mark + mark + "z",
                                          "a\xE2\x82\xACz",
                                          "",
                                          "",
                                          ""};
  EXPECT_EQ(ReadTm25Header(path).texts, texts);
}

TEST(RayFile, FilesOfOtherMakersRead) {
  const std::filesystem::path data = testdata::Folder();
  LUXFIELD_NEEDS_DATA(data / "rays_tm25");
  struct Expected {
    const char* name;
    std::size_t rays;
    bool luminous;
    double wavelength_nm;
  };
  for (const Expected& e :
       {Expected{"CreatePointSourceRayFile__farfield.TM25ray", 100000, false, 500},
        Expected{"Cyl100k_intpl.TM25RAY", 100755, true, 0},
        Expected{"Cyl10k.1.tm25ray", 10000, true, 0}}) {
    const RayFile file = ReadTm25(data / "rays_tm25" / e.name);
    EXPECT_EQ(file.rays.size(), e.rays) << e.name;
    EXPECT_EQ(file.header.ray_count, e.rays);
    EXPECT_EQ(file.flux_is_luminous, e.luminous);
    EXPECT_EQ(file.header.wavelength_nm, e.wavelength_nm);
    const double flux = std::accumulate(file.rays.begin(), file.rays.end(), 0.0,
                                        [](double sum, const Ray& ray) { return sum + ray.flux; });
    EXPECT_GT(flux, 0);
  }
  EXPECT_EQ(ReadTm25Header(data / "rays_tm25" / "Cyl10k.1.tm25ray").texts[3], "LightTools 8.7.0 ");
  // Other makers' formats in the same folder are refused by name.
  for (const auto& entry : std::filesystem::directory_iterator(data / "rays_tm25")) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".ray" && extension != ".txt") continue;
    try {
      ReadTm25(entry.path());
      ADD_FAILURE() << entry.path() << " was accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(entry.path().filename().string()));
      EXPECT_THAT(error.what(), HasSubstr("TM25"));
    }
  }
}

TEST(RayFile, RefusesByField) {
  const auto spoiled = [](const std::function<void(Bytes&)>& spoil) {
    Bytes b = TwoRays();
    spoil(b);
    return Refusal(b);
  };
  EXPECT_EQ(spoiled([](Bytes&) {}), "accepted");
  EXPECT_THAT(spoiled([](Bytes& b) { b.data[0] = 'X'; }), HasSubstr("'TM25'"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(4, 2020); }), HasSubstr("version = 2020"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(8, 7); }), HasSubstr("creation method = 7"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(16, -1.0f); }), HasSubstr("radiant flux = -1"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(12, INFINITY); }), HasSubstr("luminous flux = inf"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(20, std::uint64_t{3}); }),
              HasSubstr("number of rays = 3"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(20, ~std::uint64_t{0}); }), HasSubstr("number of rays"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(20, std::uint64_t{1} << 62); }),
              HasSubstr("number of rays"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(56, 8); }), HasSubstr("ray start position = 8"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(60, 5); }), HasSubstr("spectral data identifier = 5"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(60, 1); }), HasSubstr("wavelength = 0"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(60, 2); }), HasSubstr("wavelength per ray"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(60, 3); }), HasSubstr("spectral table is required"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(60, 4); }), HasSubstr("index column"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(76, -1); }), HasSubstr("spectral tables = -1"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(76, 1); }), HasSubstr("spectral table"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(80, INT32_MAX); }), HasSubstr("label"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(84, INT32_MAX); }), HasSubstr("additional text"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(84, INT32_MIN); }), HasSubstr("additional text"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(256, 2); }), HasSubstr("flag 0 = 2"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.SetFlag(1, false); }), HasSubstr("direction"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.SetFlag(2, false); }), HasSubstr("flux is required"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.SetFlag(6, true); }), HasSubstr("tristimulus"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.SetFlag(7, true); }), HasSubstr("index column"));
  EXPECT_THAT(spoiled([](Bytes& b) {
                b.SetFlag(2, false);
                b.SetFlag(4, true);
                b.SetFlag(5, true);
              }),
              HasSubstr("Stokes"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(36288, NAN); }), HasSubstr("ray 0: position"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(36288 + 28 + 12, 0.7f); }),
              HasSubstr("ray 1: direction"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(36288 + 20, NAN); }), HasSubstr("ray 0: direction"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(36288 + 24, -1.0f); }), HasSubstr("flux = -1"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.Set(36288 + 24, NAN); }), HasSubstr("flux = nan"));
  EXPECT_THAT(spoiled([](Bytes& b) { b.data += '\0'; }), HasSubstr("number of rays = 2"));
}

TEST(RayFile, RefusesSpectraThatMakeNoSense) {
  Bytes b = Plain(0);
  b.Set(60, 3);
  b.Set(76, 1);
  EXPECT_THAT(Refusal(b), HasSubstr("wavelength range"));
  b.Set(68, 380.0f);
  b.Set(72, 780.0f);
  b.Append(std::int32_t{3});
  for (int k = 0; k < 3; ++k) b.AppendRow({500, 1});
  b.data.append(4, '\0');
  EXPECT_EQ(Refusal(b), "accepted");
  Bytes bad = b;
  bad.Set(36288 + 4, -500.0f);
  EXPECT_THAT(Refusal(bad), HasSubstr("spectral table 1"));
  bad = b;
  bad.Set(36288 + 8, -1.0f);
  EXPECT_THAT(Refusal(bad), HasSubstr("weight -1"));
  bad = b;
  bad.Set(36288, -3);
  EXPECT_THAT(Refusal(bad), HasSubstr("-3 rows"));
  bad.Set(36288, INT32_MAX);
  EXPECT_THAT(Refusal(bad), HasSubstr("ends within"));
}

TEST(RayFile, TruncatedAnywhereIsRefused) {
  const Bytes whole = TwoRays();
  for (const std::size_t length : {0ul, 1ul, 3ul, 4ul, 5ul, 20ul, 255ul, 256ul, 287ul, 300ul,
                                   20000ul, 36287ul, 36288ul, 36289ul, 36315ul, 36316ul, 36343ul}) {
    Bytes cut = whole;
    cut.data.resize(length);
    EXPECT_NE(Refusal(cut), "accepted") << length;
  }
}

TEST(RayFile, MissingAndFolderAreRefused) {
  EXPECT_THROW(ReadTm25("/nonexistent/x.tm25ray"), InputError);
  EXPECT_THROW(ReadTm25Header(testing::TempDir()), InputError);
}

TEST(RayFile, MutatedFilesEndInSuccessOrAnInputError) {
  core::Random random(TestSeed(62), 0);
  const auto path = lightfield::UniquePath(".tm25ray");
  for (int k = 0; k < 200; ++k) {
    Bytes b = TwoRays();
    // The fields, not the texts: half of the mutations hit the first 288 bytes, half the rays.
    for (int hit = 0; hit < 1 + static_cast<int>(random() % 3); ++hit) {
      const std::size_t at = k % 2 ? random() % 288 : 36288 + random() % 56;
      b.data[at] = static_cast<char>(random());
    }
    std::ofstream(path, std::ios::binary) << b.data;
    try {
      EXPECT_EQ(ReadTm25(path).rays.size(), 2u);
    } catch (const InputError&) {
    }
  }
}

TEST(RayFile, WriterRefusesWhatTheFormatCannotHold) {
  RayFile file;
  file.rays.push_back({{0, 0, 0}, {0, 0, 1}, 1, {}});
  const auto path = lightfield::UniquePath(".tm25ray");
  const auto refused = [&](const std::function<void(RayFile&)>& spoil) {
    RayFile bad = file;
    spoil(bad);
    EXPECT_THROW(WriteTm25(path, bad), InputError);
    EXPECT_FALSE(std::filesystem::exists(path));
  };
  refused([](RayFile& f) { f.header.spectral_id = 3; });
  refused([](RayFile& f) { f.header.date_time = std::string(29, 'x'); });
  refused([](RayFile& f) { f.header.texts = {std::string(1001, 'x')}; });
  refused([](RayFile& f) { f.header.texts.resize(10); });
  refused([](RayFile& f) { f.rays[0].tristimulus = {1, 1, 1}; });  // with radiant flux
  refused([](RayFile& f) { f.rays[0].position_m.x = 1e300; });
  refused([](RayFile& f) { f.rays[0].flux = -1; });
  refused([](RayFile& f) { f.rays[0].direction.z = 0.5; });
  WriteTm25(path, file);
  EXPECT_EQ(ReadTm25(path).rays.size(), 1u);
}

}  // namespace
}  // namespace luxfield::formats
