// What the readers of *.lf.exr and *.meas.exr make of files that are wrong: one InputError that
// names the file, never more.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include "luxfield/core/error.h"
#include "luxfield/core/exr.h"
#include "luxfield/core/file.h"
#include "luxfield/lightfield/light_field.h"
#include "luxfield/lightfield/measurements.h"
#include "support.h"
#include "tests/seed.h"

namespace luxfield::lightfield {
namespace {

using testing::HasSubstr;

// An EXR file in pieces that a test can spoil one by one.
struct Draft {
  struct Channel {
    std::string name;
    bool is_uint = false;
  };
  struct Part {
    std::string name;
    int width = 3, height = 2;
    std::vector<Channel> channels;
    core::ExrAttributes attributes;
    float fill = 1;
  };
  std::vector<Part> parts;

  Part& part(const std::string& name) {
    for (Part& p : parts)
      if (p.name == name) return p;
    throw std::logic_error("no part " + name);
  }
  std::filesystem::path Save() const {
    std::vector<core::ExrPartView> views;
    std::vector<std::vector<float>> floats;
    const std::vector<std::uint32_t> zeros(64, 0);
    floats.reserve(parts.size());
    for (const Part& p : parts) {
      floats.emplace_back(static_cast<std::size_t>(p.width) * p.height, p.fill);
      core::ExrPartView view{p.name, p.width, p.height, {}, p.attributes};
      for (const Channel& c : p.channels) {
        if (c.is_uint)
          view.channels.push_back({c.name, std::span(zeros).first(floats.back().size())});
        else
          view.channels.push_back({c.name, std::span<const float>(floats.back())});
      }
      views.push_back(std::move(view));
    }
    const auto path = UniquePath(".exr");
    core::WriteExr(path, views);
    return path;
  }
};

core::ExrAttributes Attributes(const std::string& kind) {
  return {{"luxfield:kind", kind},      {"luxfield:version", 1},        {"luxfield:unit", "lm"},
          {"luxfield:delta_m", 0.1},    {"luxfield:basis", "bspline2"}, {"luxfield:basis_width", 2},
          {"luxfield:basis_height", 2}, {"luxfield:u0_m", -0.04},       {"luxfield:v0_m", -0.04},
          {"luxfield:spacing_m", 0.02}, {"luxfield:s0_m", -0.1},        {"luxfield:t1_m", 0.1},
          {"luxfield:ds_m", 0.01},      {"luxfield:dt_m", 0.01}};
}

struct Kind {
  const char* name;
  const char* prefix;
  std::function<void(const std::filesystem::path&)> read;
  Draft good;
};

std::vector<Kind> Kinds() {
  std::vector<Kind> kinds{
      {"light-field", "C", [](const auto& path) { ReadLightField(path); }, {}},
      {"measurements", "E", [](const auto& path) { ReadMeasurements(path); }, {}}};
  for (Kind& kind : kinds) {
    for (const char* index : {".00.00", ".00.01", ".01.00", ".01.01"}) {
      Draft::Part part;
      part.name = std::string(kind.prefix) + index;
      if (kind.prefix[0] == 'C')
        part.channels = {{"Y"}};
      else
        part.channels = {{"E.Y"}, {"undetected.Y"}, {"sigma.Y"}, {"count"}, {"mask", true}};
      kind.good.parts.push_back(part);
    }
    kind.good.parts[0].attributes = Attributes(kind.name);
    if (kind.prefix[0] == 'E') {
      kind.good.parts[0].attributes["luxfield:filter"] = "basis";
      kind.good.parts[0].attributes["luxfield:filter_scale"] = 1.0;
    }
  }
  return kinds;
}

std::string Refusal(const Kind& kind, const std::filesystem::path& path) {
  try {
    kind.read(path);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    return error.what();
  }
  return "accepted";
}

std::string Spoiled(const Kind& kind, const std::function<void(Draft&)>& spoil) {
  Draft draft = kind.good;
  spoil(draft);
  return Refusal(kind, draft.Save());
}

TEST(HostileExr, TheDraftItselfIsGood) {
  for (const Kind& kind : Kinds()) EXPECT_EQ(Refusal(kind, kind.good.Save()), "accepted");
}

TEST(HostileExr, EveryAttributeIsNeededAndTyped) {
  for (const Kind& kind : Kinds())
    for (const auto& [name, value] : kind.good.parts[0].attributes) {
      const std::string first = std::string(kind.prefix) + ".00.00";
      const auto missing = Spoiled(kind, [&](Draft& d) { d.part(first).attributes.erase(name); });
      EXPECT_THAT(missing, HasSubstr(name));
      EXPECT_THAT(missing, HasSubstr("missing"));
      EXPECT_THAT(missing, HasSubstr(first));
      const bool text = std::holds_alternative<std::string>(value);
      EXPECT_THAT(Spoiled(kind,
                          [&](Draft& d) {
                            d.part(first).attributes[name] =
                                text ? core::ExrValue(1.5) : core::ExrValue("text");
                          }),
                  HasSubstr(name));
    }
}

TEST(HostileExr, ValuesThatMakeNoSenseAreNamed) {
  const std::vector<std::pair<std::string, core::ExrValue>> wrong{
      {"luxfield:kind", "tables"},       {"luxfield:version", 2},
      {"luxfield:version", -1},          {"luxfield:unit", "cd"},
      {"luxfield:delta_m", 0.0},         {"luxfield:delta_m", -0.1},
      {"luxfield:delta_m", double{NAN}}, {"luxfield:basis", "cubic"},
      {"luxfield:basis_width", 0},       {"luxfield:basis_width", -2},
      {"luxfield:basis_width", 3},       {"luxfield:basis_width", 2000000000},
      {"luxfield:spacing_m", -0.02},     {"luxfield:spacing_m", double{INFINITY}},
      {"luxfield:u0_m", double{NAN}},    {"luxfield:ds_m", 0.0},
      {"luxfield:dt_m", -1.0},           {"luxfield:s0_m", 1e300}};
  for (const Kind& kind : Kinds())
    for (const auto& [name, value] : wrong) {
      const auto text = Spoiled(kind, [&](Draft& d) { d.parts[0].attributes[name] = value; });
      std::string field = name.substr(std::string("luxfield:").size());
      if (field == "basis_width") field = "basis";  // told as "basis width" or "basis_width x ..."
      EXPECT_THAT(text, HasSubstr(field)) << kind.name;
    }
  const Kind measurements = Kinds()[1];
  EXPECT_THAT(
      Spoiled(measurements, [](Draft& d) { d.parts[0].attributes["luxfield:filter"] = "red"; }),
      HasSubstr("filter = 'red'"));
  EXPECT_THAT(
      Spoiled(measurements, [](Draft& d) { d.parts[0].attributes["luxfield:filter_scale"] = 0.0; }),
      HasSubstr("filter_scale = 0"));
}

TEST(HostileExr, TheQuadraticBasisNeedsItsParameter) {
  for (const Kind& kind : Kinds()) {
    const auto with_a = [&](std::optional<core::ExrValue> a) {
      return Spoiled(kind, [&](Draft& d) {
        d.parts[0].attributes["luxfield:basis"] = "quadratic";
        if (a) d.parts[0].attributes["luxfield:basis_a"] = *a;
      });
    };
    EXPECT_EQ(with_a(-0.5), "accepted");
    EXPECT_THAT(with_a({}), HasSubstr("basis_a"));
    EXPECT_THAT(with_a(2.0), HasSubstr("a = 2"));
    EXPECT_THAT(with_a("half"), HasSubstr("basis_a"));
  }
}

TEST(HostileExr, PartsMustBeCompleteAndAlike) {
  for (const Kind& kind : Kinds()) {
    const std::string p = kind.prefix;
    EXPECT_THAT(Spoiled(kind, [](Draft& d) { d.parts.pop_back(); }), HasSubstr("3 parts"));
    EXPECT_THAT(Spoiled(kind, [&](Draft& d) { d.parts[3].name = p + ".01.02"; }),
                HasSubstr("'" + p + ".01.01' is missing"));
    EXPECT_THAT(Spoiled(kind, [](Draft& d) { d.parts[2].width = 5; }),
                HasSubstr("'" + p + ".01.00' is 5 x 2"));
    EXPECT_THAT(Spoiled(kind, [](Draft& d) { d.parts[0].name = "picture"; }),
                HasSubstr(p + ".00.00"));
    // Order in the file does not matter.
    EXPECT_EQ(Spoiled(kind, [](Draft& d) { std::swap(d.parts[0], d.parts[3]); }), "accepted");
  }
}

TEST(HostileExr, ChannelsMustExistAndHaveTheirType) {
  const auto kinds = Kinds();
  EXPECT_THAT(Spoiled(kinds[0], [](Draft& d) { d.parts[1].channels[0].name = "Z"; }),
              HasSubstr("'C.00.01'"));
  EXPECT_THAT(Spoiled(kinds[0], [](Draft& d) { d.parts[1].channels[0].is_uint = true; }),
              HasSubstr("'Y'"));
  // R alone makes it a colour file without G and B.
  EXPECT_THAT(Spoiled(kinds[0],
                      [](Draft& d) {
                        for (auto& part : d.parts) part.channels[0].name = "R";
                      }),
              HasSubstr("'G'"));
  for (std::size_t channel = 0; channel < 5; ++channel) {
    EXPECT_THAT(Spoiled(kinds[1],
                        [&](Draft& d) {
                          d.parts[2].channels.erase(d.parts[2].channels.begin() +
                                                    static_cast<std::ptrdiff_t>(channel));
                        }),
                HasSubstr("'E.01.00'"));
    EXPECT_THAT(Spoiled(kinds[1],
                        [&](Draft& d) {
                          auto& c = d.parts[2].channels[channel];
                          c.is_uint = !c.is_uint;
                        }),
                HasSubstr("channel"));
  }
}

TEST(HostileExr, NonFiniteAndImpossibleValuesAreNamed) {
  for (const Kind& kind : Kinds())
    for (const float bad : {NAN, INFINITY, -INFINITY}) {
      const auto text = Spoiled(kind, [&](Draft& d) { d.parts[3].fill = bad; });
      EXPECT_THAT(text, HasSubstr(std::string("'") + kind.prefix + ".01.01'"));
      EXPECT_THAT(text, HasSubstr("row 0, column 0"));
    }
  const auto kinds = Kinds();
  EXPECT_EQ(Spoiled(kinds[0], [](Draft& d) { d.parts[3].fill = -1; }), "accepted");
  EXPECT_THAT(Spoiled(kinds[1], [](Draft& d) { d.parts[3].fill = -1; }), HasSubstr("holds -1"));
}

TEST(HostileExr, UnknownMaskBitsAreRefused) {
  Measurements m;
  m.geometry = SmallGeometry(Basis::Make(BasisKind::kBox));
  const std::size_t n = m.geometry.plane_size();
  m.positions.assign(12, {std::vector<float>(n), std::vector<float>(n), std::vector<float>(n),
                          std::vector<std::uint32_t>(n)});
  m.positions[5].mask[7] = 64;
  const auto path = UniquePath(".meas.exr");
  WriteMeasurements(path, m);
  EXPECT_THAT(Refusal(Kinds()[1], path), HasSubstr("0x40"));
}

TEST(HostileExr, NoFileFolderEmptyGarbageAndOtherFormats) {
  for (const Kind& kind : Kinds()) {
    EXPECT_NE(Refusal(kind, "/nonexistent/lamp.exr"), "accepted");
    EXPECT_NE(Refusal(kind, testing::TempDir()), "accepted");
    core::Random random(71, 0);
    std::string noise(5000, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    for (const std::string& content : {std::string(), std::string("v/1\x01", 4), noise,
                                       "\x76\x2f\x31\x01" + noise, std::string("#?RADIANCE\n")}) {
      const auto path = UniquePath(".exr");
      core::WriteFileAtomically(path, content);
      EXPECT_NE(Refusal(kind, path), "accepted");
    }
  }
  // Each kind refuses the other's file.
  const auto kinds = Kinds();
  EXPECT_NE(Refusal(kinds[0], kinds[1].good.Save()), "accepted");
  EXPECT_NE(Refusal(kinds[1], kinds[0].good.Save()), "accepted");
  core::Image picture(4, 4, 3);
  const auto path = UniquePath(".exr");
  core::WriteExrImage(path, picture);
  for (const Kind& kind : kinds) EXPECT_NE(Refusal(kind, path), "accepted");
}

void WriteBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(HostileExr, TruncatedAnywhereIsRefused) {
  for (const Kind& kind : Kinds()) {
    const std::string whole = core::ReadFile(kind.good.Save());
    const auto path = UniquePath(".exr");
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 97) {
      WriteBytes(path, whole.substr(0, length));
      EXPECT_NE(Refusal(kind, path), "accepted") << kind.name << ' ' << length;
    }
    WriteBytes(path, whole.substr(0, whole.size() - 1));
    EXPECT_NE(Refusal(kind, path), "accepted");
  }
}

TEST(HostileExr, MutatedFilesEndInSuccessOrAnInputError) {
  core::Random random(TestSeed(72), 0);
  for (const Kind& kind : Kinds()) {
    const std::string whole = core::ReadFile(kind.good.Save());
    const auto path = UniquePath(".exr");
    int refused = 0;
    for (int k = 0; k < 200; ++k) {
      std::string bytes = whole;
      for (int hit = 0; hit < 1 + static_cast<int>(random() % 3); ++hit)
        bytes[random() % bytes.size()] = static_cast<char>(random());
      WriteBytes(path, bytes);
      refused += Refusal(kind, path) != "accepted";
    }
    EXPECT_GT(refused, 20);
  }
}

TEST(HostileExr, AHeaderThatClaimsMoreThanTheFileCanHoldIsRefused) {
  // 2^26 pixels a part of one constant compress to a few hundred kilobytes, so such a file is
  // legal; the same claim with hardly any data is not. The part's window is raised in place: 2 ints
  // after "dataWindow\0box2i\0" + size.
  const Kind kind = Kinds()[0];
  std::string bytes = core::ReadFile(kind.good.Save());
  for (std::size_t at = bytes.find("dataWindow"); at != std::string::npos;
       at = bytes.find("dataWindow", at + 1)) {
    const std::size_t value = at + std::string("dataWindow").size() + 1 + 6 + 4;
    const std::int32_t max[] = {8191, 8191};
    std::memcpy(bytes.data() + value + 8, max, 8);
  }
  const auto path = UniquePath(".exr");
  WriteBytes(path, bytes);
  EXPECT_NE(Refusal(kind, path), "accepted");
}

}  // namespace
}  // namespace luxfield::lightfield
